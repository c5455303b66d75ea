// Device as a client: needs, subscriptions, calls.
#include "sd/core/device/device.hpp"

namespace trestle::device {

using someip::Header;
using someip::Message;
using someip::MessageType;

// Ids, ports and times were checked before. What discovery still refuses depends on its own settings.
tl::unexpected<Error> Device::refused(sd::SdError error) noexcept {
  switch (error) {
    case sd::SdError::table_full:
      return tl::unexpected{Error::table_full};
    case sd::SdError::duplicate:
      return tl::unexpected{Error::duplicate};
    case sd::SdError::bad_argument:
    case sd::SdError::unknown_handle:
      break;
  }
  return bad(Argument::discovery);
}

bool Device::is_needed(std::size_t need) const noexcept {
  return need < need_slots_.size() && need_slots_[need].requirement != sd::RequirementHandle{};
}

std::span<SubscriptionSlot> Device::subscriptions_of(std::size_t need) const noexcept {
  std::size_t first = 0;
  for (const Need& one : needs_.first(need)) {
    first += one.subscriptions.size();
  }
  return subscription_slots_.subspan(first, needs_[need].subscriptions.size());
}

Result<void> Device::require(std::size_t index, TimePoint now) noexcept {
  if (index >= needs_.size()) {
    return bad(Argument::need);
  }
  const Need& need = needs_[index];
  if (!may_be_port(need.port)) {
    return bad(Argument::port);
  }
  if (const BadArgument mistake = mistake_in(need); mistake.argument != Argument::none) {
    return bad(mistake);
  }
  if (is_needed(index)) {
    return tl::unexpected{Error::duplicate};
  }
  std::size_t subscriptions = 0;
  for (const Need& one : needs_.first(index + 1)) {
    subscriptions += one.subscriptions.size();
  }
  if (index >= need_slots_.size() || subscriptions > subscription_slots_.size()) {
    return tl::unexpected{Error::table_full};
  }
  const auto requirement = discovery_.require(
      {.service = need.service, .instance = need.instance, .major = need.major, .minor = need.minor}, now);
  if (!requirement) {
    return refused(requirement.error());
  }
  const std::span<SubscriptionSlot> slots = subscriptions_of(index);
  for (std::size_t i = 0; i < need.subscriptions.size(); ++i) {
    const Subscription& one = need.subscriptions[i];
    const auto subscription = discovery_.subscribe(*requirement,
                                                   {.eventgroup = one.eventgroup,
                                                    .udp = Endpoint{own_.address, need.port},
                                                    .ttl_s = one.ttl_s,
                                                    .silence_timeout = one.silence_timeout,
                                                    .receive_buffer_bytes = need.receive_buffer_bytes},
                                                   now);
    if (!subscription) {
      discovery_.release(*requirement, now);
      std::ranges::fill(slots, SubscriptionSlot{});
      return refused(subscription.error());
    }
    slots[i].handle = *subscription;
  }
  need_slots_[index].requirement = *requirement;
  return {};
}

void Device::release(std::size_t need, TimePoint now) noexcept {
  if (is_needed(need)) {
    discovery_.release(need_slots_[need].requirement, now);
    need_slots_[need] = {};
    std::ranges::fill(subscriptions_of(need), SubscriptionSlot{});
  }
}

// --- Calls ------------------------------------------------------------------------------------------------

// Chooses once, and again only when the chosen server is gone: calls that belong together go to one server.
std::optional<sd::RemoteService> Device::server_of(std::size_t need) noexcept {
  if (!is_needed(need)) {
    return std::nullopt;
  }
  NeedSlot& slot = need_slots_[need];
  auto server = discovery_.remote(slot.server);
  if (!server) {
    server = discovery_.choose(slot.requirement);
    slot.server = server ? server->handle : sd::RemoteHandle{};
  }
  return server && server->udp ? server : std::nullopt;
}

bool Device::available(std::size_t need) noexcept {
  return server_of(need).has_value();
}

Result<sd::RemoteService> Device::way_to(std::size_t need, ByteView payload) noexcept {
  if (need >= needs_.size()) {
    return bad(Argument::need);
  }
  const auto server = server_of(need);
  if (!server) {
    return tl::unexpected{Error::unavailable};
  }
  if (const auto possible = check_payload(payload); !possible) {
    return tl::unexpected{possible.error()};
  }
  return *server;
}

Result<someip::CallHandle> Device::call(std::size_t need, MethodId method, ByteView payload, Duration timeout,
                                        TimePoint now) noexcept {
  const auto server = way_to(need, payload);
  if (!server) {
    return tl::unexpected{server.error()};
  }
  const auto started = calls_ ? calls_->start({*server->udp, Transport::udp}, server->service, method,
                                              server->major, timeout, now)
                              : std::nullopt;
  if (!started) {
    return tl::unexpected{Error::table_full};
  }
  timed_out_[started->call.index] = 0;
  queue_.push(started->header, needs_[need].port, *server->udp, payload, queue_.kind_of(payload));
  return started->call;
}

Result<void> Device::tell(std::size_t need, MethodId method, ByteView payload) noexcept {
  const auto server = way_to(need, payload);
  if (!server) {
    return tl::unexpected{server.error()};
  }
  const Header header{.service = server->service,
                      .method = method,
                      .client = client_,
                      .session = tell_sessions_.next(),
                      .interface_version = server->major,
                      .type = MessageType::request_no_return};
  queue_.push(header, needs_[need].port, *server->udp, payload, queue_.kind_of(payload));
  return {};
}

bool Device::cancel(someip::CallHandle call) noexcept {
  return calls_ && calls_->cancel(call);
}

void Device::on_answer(const Message& message) noexcept {
  const auto answer = calls_ ? calls_->on_answer({from_, Transport::udp}, message.header)
                             : tl::unexpected{someip::AnswerDrop::unknown};
  if (!answer) {
    ++counters_.unexpected;
    return;
  }
  ready_ =
      CallEnded{.call = answer->call, .answered = true, .code = answer->code, .payload = message.payload};
}

// --- Events -----------------------------------------------------------------------------------------------

// The subscription for which a notification is; if there is none, counts why.
std::optional<Device::Found> Device::find_subscription(const Header& header) noexcept {
  if (header.return_code != someip::ReturnCode::ok) {  // [feat_req_someip_683] [feat_req_someip_367]
    ++counters_.bad_return_code;
    return std::nullopt;
  }
  std::uint32_t Counters::*fault = &Counters::unexpected;
  for (std::size_t i = 0; i < needs_.size(); ++i) {
    const Need& need = needs_[i];
    const bool here = need.port == to_.port || to_.address.is_multicast();
    if (!is_needed(i) || need.service != header.service || !here) {
      continue;
    }
    for (std::size_t j = 0; j < need.subscriptions.size(); ++j) {
      const std::span<const MethodId> events = need.subscriptions[j].events;
      if (!events.empty() && std::ranges::find(events, header.method) == events.end()) {
        continue;
      }
      const auto server = discovery_.server_of(subscriptions_of(i)[j].handle);
      if (!server || server->udp != from_) {
        fault = &Counters::unknown_sender;
      } else if (header.protocol != someip::protocol_version || header.interface_version != server->major) {
        fault = &Counters::wrong_version;
      } else {
        return Found{i, j};
      }
    }
  }
  ++(counters_.*fault);
  return std::nullopt;
}

void Device::on_notification(const Message& message, TimePoint now) noexcept {
  if (const auto found = find_subscription(message.header)) {
    ++counters_.events;
    discovery_.event_received(subscriptions_of(found->need)[found->subscription].handle, now);
    ready_ = EventReceived{.need = found->need,
                           .subscription = found->subscription,
                           .header = message.header,
                           .payload = message.payload};
  }
}

// --- What discovery tells ---------------------------------------------------------------------------------

std::optional<std::size_t> Device::need_of(sd::RequirementHandle requirement) const noexcept {
  const auto found = std::ranges::find(need_slots_, requirement, &NeedSlot::requirement);
  return found == need_slots_.end() ? std::nullopt
                                    : std::optional{static_cast<std::size_t>(found - need_slots_.begin())};
}

std::optional<Device::Found> Device::subscription_of(sd::SubscriptionHandle handle) const noexcept {
  for (std::size_t i = 0; i < needs_.size(); ++i) {
    if (!is_needed(i)) {
      continue;
    }
    const std::span<const SubscriptionSlot> slots = subscriptions_of(i);
    const auto found = std::ranges::find(slots, handle, &SubscriptionSlot::handle);
    if (found != slots.end()) {
      return Found{i, static_cast<std::size_t>(found - slots.begin())};
    }
  }
  return std::nullopt;
}

std::optional<Happening> Device::on_event(const sd::ServiceAvailable& event) noexcept {
  const auto need = need_of(event.requirement);
  return need ? std::optional<Happening>{ServiceAvailable{*need, event.service}} : std::nullopt;
}

std::optional<Happening> Device::on_event(const sd::ServiceLost& event) noexcept {
  const auto need = need_of(event.requirement);
  return need ? std::optional<Happening>{ServiceLost{*need, event.service, event.reason}} : std::nullopt;
}

std::optional<Happening> Device::on_event(const sd::Subscribed& event) noexcept {
  const auto found = subscription_of(event.subscription);
  return found ? std::optional<Happening>{Subscribed{found->need, found->subscription, event.multicast}}
               : std::nullopt;
}

std::optional<Happening> Device::on_event(const sd::SubscriptionRefused& event) noexcept {
  const auto found = subscription_of(event.subscription);
  return found ? std::optional<Happening>{SubscriptionRefused{found->need, found->subscription}}
               : std::nullopt;
}

std::optional<Happening> Device::on_event(const sd::SubscriptionLost& event) noexcept {
  const auto found = subscription_of(event.subscription);
  return found ? std::optional<Happening>{SubscriptionLost{found->need, found->subscription, event.reason}}
               : std::nullopt;
}

// Devices have no TCP.
std::optional<Happening> Device::on_event(const sd::ConnectionOutdated& /*event*/) noexcept {
  return std::nullopt;
}

}  // namespace trestle::device
