#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "bridge/conform/replay/replay.hpp"

/// Headers, requests, responses and events.
namespace trestle::conform {
namespace {

using someip::MessageType;
using someip::ReturnCode;

/// What was sent so long ago that nobody remembers has no say any more.
constexpr std::size_t most_requests = 200'000;

std::string number(unsigned value) {
  return fmt::format("{:#06x}", value);
}

std::uint32_t message_id(const someip::Header& header) {
  return (std::uint32_t{value(header.service)} << 16U) | value(header.method);
}
std::uint32_t request_id(const someip::Header& header) {
  return (std::uint32_t{value(header.client)} << 16U) | value(header.session);
}

bool is_defined(MessageType type) {
  constexpr std::array defined{MessageType::request, MessageType::request_no_return,
                               MessageType::notification, MessageType::response, MessageType::error};
  return std::ranges::find(defined, someip::without_tp(type)) != defined.end();
}

}  // namespace

void Replay::judge_header(const At& at) {
  const someip::Header& header = at.message.header;
  const MessageType type = someip::without_tp(header.type);
  check(Rule::header_protocol, at, header.protocol == someip::protocol_version, "Protocol Version", "1",
        std::to_string(header.protocol));
  check(Rule::header_type, at, is_defined(header.type), "Message Type", "one that is defined",
        fmt::format("{:#04x}", static_cast<unsigned>(header.type)));
  const bool may_have_code = type == MessageType::response || type == MessageType::error;
  const bool good_code = type == MessageType::error ? header.return_code != ReturnCode::ok
                                                    : may_have_code || header.return_code == ReturnCode::ok;
  check(Rule::header_code, at, good_code, "Return Code", type == MessageType::error ? "an error" : "0x00",
        fmt::format("{:#04x}", static_cast<unsigned>(header.return_code)));
  const bool cookie =
      value(header.service) == 0xffff && (value(header.method) == 0x0000 || value(header.method) == 0x8000);
  const bool discovery = value(header.service) == 0xffff && value(header.method) == 0x8100;
  check(Rule::ids_service, at, cookie || discovery || someip::names_a_service(header.service), "Service ID",
        "that of a service", number(value(header.service)));
  if (at.place.transport == Transport::udp) {
    check(Rule::udp_size, at, at.message.payload.size() <= someip::max_plain_payload_bytes + 4, "payload",
          "1400 bytes at most", fmt::format("{} bytes", at.message.payload.size()));
    const bool at_port = at.place.flow.to.port == 30490;
    if (at_port || discovery) {
      check(Rule::sd_port, at, at_port == discovery, "destination port",
            discovery ? "30490 for service discovery" : "not 30490, where service discovery is",
            std::to_string(at.place.flow.to.port));
    }
  }
}

void Replay::remember(const At& at) {
  const someip::Header& header = at.message.header;
  const auto& [from, to] = at.place.flow;
  if (talked_.size() < most_requests) {
    talked_.emplace(from, to);
  }
  // A request in segments comes here once for each; that makes no difference.
  if (someip::without_tp(header.type) == MessageType::request && requests_.size() < most_requests) {
    requests_[{from, to, message_id(header), request_id(header)}] = {.interface_version =
                                                                         header.interface_version};
  }
}

void Replay::judge_rpc(const At& at) {
  const someip::Header& header = at.message.header;
  const auto& [from, to] = at.place.flow;
  const unsigned method = value(header.method);
  const bool reserved = (method & 0x7fffU) == 0 || (method & 0x7fffU) == 0x7fff;
  check(Rule::ids_reserved, at, !reserved, "Method ID", "none of 0x0000, 0x7fff, 0x8000 and 0xffff",
        number(method));
  if (header.type == MessageType::notification) {
    check(Rule::ids_event, at, method >= 0x8000, "Event ID", "0x8000 or more", number(method));
    judge_event(at);
    judge_session_of_event(at);
    return;
  }
  if (!is_defined(header.type)) {
    return;
  }
  check(Rule::ids_method, at, method < 0x8000, "Method ID", "less than 0x8000", number(method));
  if (header.type == MessageType::request) {
    check(Rule::rpc_session, at, value(header.session) != 0, "Session ID", "not 0", "0");
    judge_session_of_call(at);
  } else if (header.type == MessageType::request_no_return) {
    judge_session_of_event(at);
  } else if (requests_.size() < most_requests && talked_.contains({to, from})) {
    // Only where the other direction was seen before: a capture may begin with a response, or have one
    // direction only.
    const auto request = requests_.find({to, from, message_id(header), request_id(header)});
    const bool known = request != requests_.end();
    check(Rule::rpc_response_asked, at, known, "request before it",
          "one with the same Message ID and Request ID", "none");
    if (known) {
      check(Rule::rpc_response_once, at, !request->second.answered, "answers", "1", "2 or more");
      // An error about the version may have the one or the other.
      if (header.return_code != ReturnCode::wrong_interface_version) {
        check(Rule::rpc_response_version, at, header.interface_version == request->second.interface_version,
              "Interface Version", std::to_string(request->second.interface_version),
              std::to_string(header.interface_version));
      }
      request->second.answered = true;
    }
  }
}

void Replay::judge_session_of_call(const At& at) {
  const someip::Header& header = at.message.header;
  const std::uint16_t session = value(header.session);
  if (session == 0 || last_session_.size() >= most_requests) {
    return;
  }
  const auto [last, is_new] = last_session_.try_emplace(
      {at.place.flow.from, at.place.flow.to, message_id(header), value(header.client)}, session);
  if (!is_new) {
    // A client that was restarted begins with 1 again.
    check(Rule::rpc_session_counts, at, session != last->second || session == 1, "Session ID",
          "another one than in the call before", number(session));
    last->second = session;
  }
}

void Replay::judge_session_of_event(const At& at) {
  const someip::Header& header = at.message.header;
  const std::uint16_t session = value(header.session);
  if (event_sessions_.size() >= most_requests) {
    return;
  }
  const auto [last, is_new] = event_sessions_.try_emplace(
      {at.place.flow.from, at.place.flow.to, message_id(header), value(header.client)}, Run{session, 1});
  if (is_new) {
    return;
  }
  Run& run = last->second;
  run = {session, run.session == session ? run.times + 1U : 1U};
  // Twice may be a restart, or one event for two subscriptions at one endpoint.
  check(Rule::rpc_event_session, at, session == 0 || run.times < 3, "Session ID",
        "0, or another one than before", fmt::format("{:#06x}, {} times in a row", session, run.times));
}

}  // namespace trestle::conform
