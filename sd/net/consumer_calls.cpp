// Consumer: calls of methods.
#include "sd/net/consumer.hpp"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <stdexcept>

#include "sd/core/receive_buffer.hpp"
#include "sd/net/checks.hpp"
#include "sd/net/clock.hpp"
#include "sd/net/discovery_text.hpp"
#include "sd/net/shielded.hpp"
#include "someip/wire/enumerator_name.hpp"
#include "someip/wire/slices.hpp"

namespace trestle::sd {

using someip::CallHandle;
using someip::Header;
using someip::Message;
using someip::MessageType;
using someip::ReturnCode;

const char* to_string(CallFault fault) noexcept {
  static constexpr std::array names{"unavailable",    "not_connected", "not_sent",
                                    "too_many_calls", "timed_out",     "error"};
  return someip::enumerator_name<CallFault::error>(names, fault);
}

// Draws anew only when what was drawn is gone, or silent while there is another: calls stay at one server.
void Consumer::choose(Search& search) {
  const auto chosen = search.chosen
                          ? std::ranges::find(search.servers, *search.chosen, &RemoteService::instance)
                          : search.servers.end();
  if (chosen == search.servers.end() || (search.servers.size() > 1 && discovery_.is_mute(chosen->handle))) {
    const auto service = discovery_.choose(search.handle);
    search.chosen = service ? std::optional{service->instance} : std::nullopt;
  }
}

// Which server a call goes to, and by which protocol; nothing if no server has what is asked for.
std::optional<Consumer::CallPath> Consumer::route(Search& search, const CallSpec& spec, std::size_t bytes) {
  choose(search);
  std::optional<CallPath> way;
  for (const RemoteService& server : search.servers) {
    if (spec.instance && *spec.instance != server.instance) {
      continue;
    }
    const bool large = bytes > someip::max_plain_payload_bytes;
    const bool tcp =
        spec.transport ? *spec.transport == Transport::tcp : !server.udp || (large && server.tcp.has_value());
    const auto& endpoint = tcp ? server.tcp : server.udp;
    if (!endpoint) {
      discovery_.is_of_no_use(server.handle);
    } else if (!way || server.instance == search.chosen) {
      way = CallPath{
          &server, {*endpoint, tcp ? Transport::tcp : Transport::udp}, spec.pacing.value_or(config_.pacing)};
    }
  }
  // As the application wants, else as the server can take it.
  if (way && way->target.transport == Transport::udp && bytes > someip::max_plain_payload_bytes &&
      !way->pacing.burst) {
    way->pacing.burst = someip::burst_into(receive_buffer_in(discovery_.configuration(way->server->handle)));
  }
  return way;
}

// Sends a request, or says why it cannot.
std::optional<CallFault> Consumer::transmit(const CallPath& route, const Requirement& requirement,
                                            const Header& header, std::span<const ByteView> payload,
                                            std::shared_ptr<const void> keep_alive) {
  E2eChannel* const channel = requirement.e2e.find(header.method);
  return channel != nullptr && channel->protects()
             ? transmit_protected(*channel, route, requirement.spec, header, payload)
             : transmit_bytes(route, requirement.spec, header, payload, std::move(keep_alive));
}

std::optional<CallFault> Consumer::transmit_bytes(const CallPath& route, const RequireSpec& spec,
                                                  const Header& header, std::span<const ByteView> payload,
                                                  std::shared_ptr<const void> keep_alive) {
  const Endpoint& to = route.target.server;
  if (route.target.transport == Transport::udp) {
    // [feat_req_someiptp_788]
    if (spec.segmented && size_of(payload) > someip::max_plain_payload_bytes &&
        std::ranges::find(*spec.segmented, header.method) == spec.segmented->end()) {
      ++counters_.not_to_be_segmented;
      return CallFault::not_sent;
    }
    const bool sent = call_port_->sender.send(to, header, payload, std::move(keep_alive), route.pacing);
    return sent ? std::nullopt : std::optional{CallFault::not_sent};
  }
  Connection& connection = connection_to(to);  // opened by the first call  [feat_req_someip_646]
  connection.called = true;
  const std::uint64_t refused = connection.client->counters().not_connected;
  if (connection.client->send(header, payload, std::move(keep_alive))) {
    return std::nullopt;
  }
  return connection.client->counters().not_connected == refused ? CallFault::not_sent
                                                                : CallFault::not_connected;
}

bool Consumer::is_full_for(RequirementId id, const CallSpec& spec, std::size_t bytes) {
  const auto requirement = find(id);
  bytes += requirement ? requirement->e2e.added_bytes(spec.method) : 0;
  const auto way = requirement ? route(*requirement, spec, bytes) : std::nullopt;
  if (!way) {
    return false;
  }
  if (way->target.transport == Transport::udp) {
    return call_port_->sender.is_full_for(way->target.server, bytes);
  }
  const auto connection = connections_.find(way->target.server);
  return connection != connections_.end() && connection->second.client->is_full_for(bytes);
}

CallId Consumer::call(RequirementId id, const CallSpec& spec, std::span<const ByteView> payload,
                      std::shared_ptr<const void> keep_alive, ResponseHandler handler) {
  const auto started = try_call(id, spec, payload, std::move(keep_alive), handler);
  if (!started) {
    fail_later(std::move(handler), started.error());
  }
  return started.value_or(CallId{});
}

someip::Result<CallId, CallFault> Consumer::try_call(RequirementId id, const CallSpec& spec,
                                                     std::span<const ByteView> payload,
                                                     std::shared_ptr<const void> keep_alive,
                                                     ResponseHandler& handler) {
  if (!handler) {
    throw std::invalid_argument{"call of method " + hexadecimal(value(spec.method)) + ": handler: missing"};
  }
  check(spec);
  const auto requirement = find(id);
  const std::size_t bytes = size_of(payload) + (requirement ? requirement->e2e.added_bytes(spec.method) : 0);
  const auto way = requirement ? route(*requirement, spec, bytes) : std::nullopt;
  if (!way) {
    return tl::unexpected{CallFault::unavailable};
  }
  const auto started = calls_.start(way->target, requirement->spec.service, spec.method, way->server->major,
                                    spec.timeout, now());
  if (!started) {
    return tl::unexpected{CallFault::too_many_calls};
  }
  if (const auto fault = transmit(*way, *requirement, started->header, payload, std::move(keep_alive))) {
    calls_.cancel(started->call);
    if (*fault == CallFault::not_connected) {
      discovery_.not_answered(way->server->handle);
    }
    return tl::unexpected{*fault};
  }
  E2eChannel* const channel = requirement->e2e.find(spec.method);
  asked_[started->call.index] = way->server->handle;
  waiting_[started->call.index] = channel != nullptr && channel->checks()
                                      ? checked(*channel, way->target, std::move(handler))
                                      : std::move(handler);
  call_timer_.arm(calls_.deadline());
  return CallId{started->call.generation * 0x10000U + started->call.index};
}

bool Consumer::send(RequirementId id, const CallSpec& spec, std::span<const ByteView> payload,
                    std::shared_ptr<const void> keep_alive) {
  check(spec);
  const auto requirement = find(id);
  const std::size_t bytes = size_of(payload) + (requirement ? requirement->e2e.added_bytes(spec.method) : 0);
  const auto way = requirement ? route(*requirement, spec, bytes) : std::nullopt;
  if (!way) {
    return false;
  }
  // Segments need one to be put together.  [feat_req_someiptp_762]
  const bool with_session = spec.session || bytes > someip::max_plain_payload_bytes;
  const Header header{.service = requirement->spec.service,
                      .method = spec.method,
                      .client = config_.client,
                      .session = with_session ? tell_sessions_.next() : someip::SessionId{0},
                      .interface_version = way->server->major,
                      .type = MessageType::request_no_return};
  return !transmit(*way, *requirement, header, payload, std::move(keep_alive));
}

bool Consumer::cancel(CallId call) {
  const auto number = static_cast<std::uint32_t>(call);
  const CallHandle handle{static_cast<std::uint16_t>(number), static_cast<std::uint16_t>(number >> 16U)};
  if (!calls_.cancel(handle)) {
    return false;
  }
  waiting_[handle.index] = nullptr;
  call_timer_.arm(calls_.deadline());
  return true;
}

// Never from within call(): who calls does not expect to be called back before it returns.
void Consumer::fail_later(ResponseHandler handler, CallFault fault) {
  boost::asio::post(io_, [weak = std::weak_ptr{alive_}, handler = std::move(handler), fault] {
    if (!weak.expired()) {
      handler(tl::unexpected{CallError{.fault = fault}});
    }
  });
}

void Consumer::finish(CallHandle call, const CallResult& result) {
  // Taken out first: the handler may call again, and get the same place.
  const ResponseHandler handler = std::exchange(waiting_[call.index], nullptr);
  handler(result);
}

void Consumer::time_out(CallHandle call) {
  discovery_.not_answered(asked_[call.index]);
  shielded(io_, [&] {
    finish(call, tl::unexpected{CallError{.fault = CallFault::timed_out, .code = ReturnCode::timeout}});
  });
}

std::size_t Consumer::room_for(const Header& header, const Source& source) {
  if (someip::without_tp(header.type) == MessageType::notification) {
    if (!find_listeners(header, source)) {
      return 0;
    }
    std::size_t most = 0;
    for (const auto& listener : called_) {
      most = std::max(most, listener->max_event_bytes.value_or(config_.max_message_bytes));
    }
    return most;
  }
  const bool awaited = calls_.awaits({source.from, source.transport}, header);
  counters_.unexpected += awaited ? 0 : 1;
  return awaited ? config_.max_message_bytes : 0;
}

void Consumer::on_answer(const Message& message, const Source& source) {
  const auto answer = calls_.on_answer({source.from, source.transport}, message.header);
  if (!answer) {
    ++counters_.unexpected;
    return;
  }
  call_timer_.arm(calls_.deadline());
  discovery_.answered(asked_[answer->call.index]);
  if (answer->code == ReturnCode::ok) {
    finish(answer->call, message);
  } else {
    finish(answer->call, tl::unexpected{CallError{.fault = CallFault::error,
                                                  .code = answer->code,
                                                  .payload = message.payload,
                                                  .header = &message.header}});
  }
}

}  // namespace trestle::sd
