// Device: reception, polling, and what client and server share.
#include "sd/core/device/device.hpp"

#include "someip/wire/enumerator_name.hpp"

namespace trestle::device {

using someip::Header;
using someip::Message;
using someip::MessageType;

namespace {

// An address in four bytes: of IPv4 itself. Others with the same mark lose a large message at a reboot.
std::uint32_t mark_of(const IpAddress& address) noexcept {
  std::uint32_t mark = 0;
  for (std::size_t i = 0; i < address.bytes.size(); ++i) {
    mark ^= std::uint32_t{address.bytes[i]} << i % 4 * 8;
  }
  return mark;
}

}  // namespace

const char* to_string(Error error) noexcept {
  static constexpr std::array names{"bad argument", "table full", "duplicate", "not offered",
                                    "unavailable",  "no room",    "busy",      "too large"};
  return someip::enumerator_name<Error::too_large>(names, error);
}

Device::Device(const Settings& settings, const MemoryView& memory) noexcept
    : own_{settings.discovery.unicast},
      services_{settings.services},
      needs_{settings.needs},
      client_{settings.client},
      service_slots_{memory.services},
      event_slots_{memory.events},
      need_slots_{memory.needs},
      subscription_slots_{memory.subscriptions},
      timed_out_{memory.timed_out},
      max_subscribers_{memory.discovery.subscribers.size()},
      discovery_{settings.discovery, memory.discovery},
      tp_senders_{memory.tp_senders},
      reassembler_{
          memory.tp_slots,
          {.max_message_bytes = memory.tp_slots.empty() ? 0 : memory.tp_bytes.size() / memory.tp_slots.size(),
           .max_per_sender = memory.tp_slots.size(),
           .max_age = settings.reassembly_timeout}},
      queue_{memory, settings.pacing} {
  if (!memory.calls.empty()) {
    calls_.emplace(memory.calls, settings.client);
  }
}

tl::unexpected<Error> Device::bad(const BadArgument& argument) noexcept {
  bad_argument_ = argument;
  return tl::unexpected{Error::bad_argument};
}

bool Device::may_be_port(std::uint16_t port) const noexcept {
  return port != 0 && port != own_.port;
}

// --- Reception --------------------------------------------------------------------------------------------

void Device::on_datagram(ByteView datagram, const Endpoint& from, const Endpoint& to,
                         TimePoint now) noexcept {
  if (to.port == own_.port) {
    const auto reboots = discovery_.counters().reboots_detected;
    discovery_.on_datagram(datagram, from, to.address.is_multicast(), now);
    if (discovery_.counters().reboots_detected != reboots) {
      forget_large(from.address, now);
    }
    return;
  }
  drop_rest();
  ++counters_.datagrams_received;
  counters_.malformed += datagram.empty() ? 1U : 0U;
  incoming_ = someip::MessageCursor{datagram};
  from_ = from;
  to_ = to;
}

void Device::drop_rest() noexcept {
  const bool unread = incoming_.next().has_value() || !std::holds_alternative<std::monostate>(ready_);
  counters_.not_polled += unread ? 1U : 0U;
  incoming_ = someip::MessageCursor{{}};
  ready_ = std::monostate{};
}

// Takes messages until one is for the application, or has to be answered; false at the end of the datagram.
bool Device::take_message(TimePoint now) noexcept {
  // Handling a message needs room for at most one response and one notification.
  if (!std::holds_alternative<std::monostate>(ready_) || !queue_.has_room(2, 0)) {
    return false;
  }
  const auto message = incoming_.next();
  if (!message) {
    counters_.malformed += incoming_.error() ? 1U : 0U;
    incoming_ = someip::MessageCursor{{}};
    return false;
  }
  if (!someip::is_tp(message->header.type)) {
    on_message(*message, now);
  } else if (admit(message->header)) {
    const auto whole = reassembler_.on_segment(from_, *message, now);
    if (!whole) {
      ++counters_.not_reassembled;
      return true;
    }
    tp_senders_[reassembler_.recent()] = mark_of(from_.address);
    if (*whole) {
      on_message({.header = (*whole)->header, .payload = (*whole)->payload}, now);
    }
  }
  return true;
}

// Whether segments with this header should be reassembled.
bool Device::admit(const Header& header) noexcept {
  switch (someip::without_tp(header.type)) {
    case MessageType::notification:
      return find_subscription(header).has_value();
    case MessageType::response:
    case MessageType::error:
      if (calls_ && calls_->awaits({from_, Transport::udp}, header)) {
        return true;
      }
      break;
    default:
      if (takes(header)) {
        return true;
      }
  }
  ++counters_.unexpected;
  return false;
}

// A host that was started anew counts its sessions from 1 on, as before: what it sends now would be taken for
// the rest of a message that it had begun, or for stragglers of one that was whole. Only discovery knows. Of
// whole messages it forgets all: to make room their sessions are forgotten at any time.
// [feat_req_someipsd_863] [feat_req_someiptp_781]
void Device::forget_large(const IpAddress& sender, TimePoint now) noexcept {
  for (std::size_t i = 0; i < tp_senders_.size(); ++i) {
    if (reassembler_.under_way(i) && tp_senders_[i] == mark_of(sender)) {
      static_cast<void>(reassembler_.end(i, someip::TpDrop::replaced, now));
    }
  }
  while (reassembler_.forget(TimePoint::max())) {
  }
}

void Device::on_message(const Message& message, TimePoint now) noexcept {
  switch (message.header.type) {
    case MessageType::notification:
      return on_notification(message, now);
    case MessageType::response:
    case MessageType::error:
      return on_answer(message);
    default:
      return on_request(message);
  }
}

// --- Sending ----------------------------------------------------------------------------------------------

// Errors in what the application asks for.
Result<void> Device::check_payload(ByteView payload) const noexcept {
  if (payload.size() > max_payload_bytes) {
    return tl::unexpected{Error::too_large};
  }
  const bool copied = queue_.kind_of(payload) == SendQueue::Payload::copied;
  if (!queue_.has_room(1, copied ? payload.size() : 0)) {
    return tl::unexpected{Error::no_room};
  }
  return {};
}

// Answers without the application being asked.
void Device::answer(const Header& header, ByteView payload) noexcept {
  if (!queue_.has_room(1, 0)) {
    ++counters_.send_queue_full;
    return;
  }
  queue_.push(header, to_.port, from_, payload, SendQueue::Payload::of_field);
}

// --- Polling ----------------------------------------------------------------------------------------------

void Device::on_time(TimePoint now) noexcept {
  discovery_.on_time(now);
  reassembler_.on_time(now);
  if (calls_) {
    calls_->on_time(now, [this](someip::CallHandle call) { timed_out_[call.index] = call.generation; });
  }
}

std::optional<Transmit> Device::poll_transmit(ByteSpan room, TimePoint now) noexcept {
  // Discovery first: an Ack must leave before the initial events.  [feat_req_someipsd_107]
  if (const auto datagram = discovery_.poll_transmit(room, now)) {
    return Transmit{own_.port, datagram->destination, datagram->bytes};
  }
  do {
    if (const auto datagram = queue_.poll(room, discovery_, counters_, now)) {
      return datagram;
    }
  } while (take_message(now));
  return std::nullopt;
}

std::optional<Happening> Device::poll_happening() noexcept {
  if (const std::byte* const payload = queue_.take_finished()) {
    return SendFinished{payload};
  }
  for (std::size_t i = 0; i < timed_out_.size(); ++i) {
    if (const std::uint16_t generation = std::exchange(timed_out_[i], std::uint16_t{0})) {
      return CallEnded{.call = {static_cast<std::uint16_t>(i), generation}};
    }
  }
  if (const auto unusual = next_unusual_id()) {
    return unusual;
  }
  while (const auto event = discovery_.poll_event()) {
    if (const auto what = happening_of(*event)) {
      return what;
    }
  }
  return std::visit(
      [this](const auto& ready) -> std::optional<Happening> {
        if constexpr (std::is_same_v<decltype(ready), const std::monostate&>) {
          return std::nullopt;
        } else {
          const std::optional<Happening> what{ready};
          ready_ = std::monostate{};
          return what;
        }
      },
      ready_);
}

std::optional<TimePoint> Device::deadline() const noexcept {
  std::optional<TimePoint> earliest;
  for (const auto& due : {discovery_.deadline(), queue_.deadline(), reassembler_.deadline(),
                          calls_ ? calls_->deadline() : std::nullopt}) {
    if (due && (!earliest || *due < *earliest)) {
      earliest = due;
    }
  }
  return earliest;
}

void Device::link_down() noexcept {
  discovery_.link_down();
  queue_.clear();
}

void Device::link_up(TimePoint now) noexcept {
  discovery_.link_up(now);
}

void Device::shutdown(TimePoint now) noexcept {
  discovery_.shutdown(now);
  queue_.clear();
  drop_rest();
  std::ranges::fill(service_slots_, ServiceSlot{});
  std::ranges::fill(need_slots_, NeedSlot{});
  std::ranges::fill(subscription_slots_, SubscriptionSlot{});
}

// --- What discovery tells ---------------------------------------------------------------------------------

std::optional<Happening> Device::happening_of(const sd::Happening& event) noexcept {
  return std::visit([this](const auto& what) -> std::optional<Happening> { return on_event(what); }, event);
}

}  // namespace trestle::device
