#include "sd/core/device/send_queue.hpp"

#include <cstring>

#include "someip/core/tp_segmenter.hpp"

namespace trestle::device {

namespace {

bool is_large(const SendSlot& send) noexcept {
  return send.bytes > someip::max_plain_payload_bytes;
}

// Whether `later` must not overtake a large message that waits: messages with the same Message ID to one
// receiver keep their order, and large messages share one pace.
bool must_follow(const SendSlot& large, const SendSlot& later) noexcept {
  const bool same_id =
      later.header.service == large.header.service && later.header.method == large.header.method;
  const bool other_receiver = large.service == SendSlot::one_receiver &&
                              later.service == SendSlot::one_receiver && later.to != large.to;
  return is_large(later) || (same_id && !other_receiver);
}

}  // namespace

SendQueue::SendQueue(const MemoryView& memory, const someip::TpPacing& pacing) noexcept
    : sends_{memory.sends},
      receivers_{memory.receivers},
      services_{memory.services},
      bytes_{memory.send_bytes},
      pacing_{pacing} {}

bool SendQueue::has_room(std::size_t messages, std::size_t copied_bytes) const noexcept {
  return static_cast<std::size_t>(std::ranges::count(sends_, SendSlot::State::unused, &SendSlot::state)) >=
             messages &&
         bytes_.size() - used_bytes_ >= copied_bytes;
}

SendSlot& SendQueue::add(const someip::Header& header, std::uint16_t from_port, ByteView payload,
                         Payload kind) noexcept {
  const auto place = std::ranges::find(sends_, SendSlot::State::unused, &SendSlot::state);
  assert(place != sends_.end());
  SendSlot& send = *place;
  send = SendSlot{};
  send.state = SendSlot::State::waiting;
  send.kind = kind;
  send.from_port = from_port;
  send.header = header;
  send.number = next_number_++;
  send.payload = payload.data();
  send.bytes = payload.size();
  if (kind == Payload::copied) {
    const ByteSpan copy = bytes_.subspan(used_bytes_, payload.size());
    std::ranges::copy(payload, copy.begin());
    send.payload = copy.data();
    used_bytes_ += payload.size();
  }
  std::ranges::fill(receivers_of(send), std::uint8_t{0});
  paused_ = false;
  return send;
}

void SendQueue::push(const someip::Header& header, std::uint16_t from_port, const Endpoint& to,
                     ByteView payload, Payload kind) noexcept {
  add(header, from_port, payload, kind).to = to;
}

std::span<std::uint8_t> SendQueue::receivers_of(const SendSlot& send) const noexcept {
  const std::size_t bytes = receivers_.size() / sends_.size();
  return receivers_.subspan(static_cast<std::size_t>(&send - sends_.data()) * bytes, bytes);
}

// The first waiting message whose number is not before `from`. Numbers may wrap.
SendSlot* SendQueue::earliest(std::uint32_t from) const noexcept {
  SendSlot* first = nullptr;
  for (SendSlot& send : sends_) {
    const std::uint32_t age = next_number_ - send.number;
    if (send.state == SendSlot::State::waiting && age <= next_number_ - from &&
        (first == nullptr || age > next_number_ - first->number)) {
      first = &send;
    }
  }
  return first;
}

const Endpoint* SendQueue::take_receiver(SendSlot& send,
                                         const sd::ServiceDiscovery& discovery) const noexcept {
  if (send.service == SendSlot::one_receiver) {
    return send.next_receiver++ == 0 ? &send.to : nullptr;
  }
  const std::span<const std::uint8_t> bits = receivers_of(send);
  while (send.next_receiver < bits.size() * 8) {
    const std::size_t place = send.next_receiver++;
    if ((bits[place / 8] >> (place % 8) & 1U) == 0) {
      continue;
    }
    const sd::slots::Subscriber* const subscriber =
        discovery.subscription(services_[send.service].offer, place);
    if (subscriber != nullptr && subscriber->udp) {
      return &*subscriber->udp;
    }
  }
  return nullptr;
}

std::optional<Transmit> SendQueue::poll(ByteSpan room, const sd::ServiceDiscovery& discovery,
                                        Counters& counters, TimePoint now) noexcept {
  const SendSlot* waiting = nullptr;  // the large message whose turn it is, in a pause
  SendSlot* send = sends_.empty() ? nullptr : earliest(next_number_ - 0x8000'0000U);
  while (send != nullptr) {
    const std::uint32_t next = send->number + 1;
    if (waiting == nullptr || !must_follow(*waiting, *send)) {
      if (const auto datagram = poll(*send, room, discovery, counters, now)) {
        ++counters.datagrams_sent;
        return datagram;
      }
      if (send->state == SendSlot::State::waiting && waiting == nullptr) {
        waiting = send;
      }
    }
    send = earliest(next);
  }
  paused_ = waiting != nullptr;
  return std::nullopt;
}

// A round sends one segment to each receiver; between two is a pause. A small message has one round.
std::optional<Transmit> SendQueue::poll(SendSlot& send, ByteSpan room, const sd::ServiceDiscovery& discovery,
                                        Counters& counters, TimePoint now) noexcept {
  while (send.state == SendSlot::State::waiting) {
    const bool first_of_round = send.next_receiver == 0;
    if (is_large(send) && first_of_round && window_.room(pacing_, now) == 0) {
      return std::nullopt;
    }
    const Endpoint* const to = take_receiver(send, discovery);
    if (to == nullptr) {
      send.offset += is_large(send) ? pacing_.segment_bytes : send.bytes;
      send.next_receiver = 0;
      if (first_of_round || send.offset >= send.bytes) {  // no receiver is left, or everything has been sent
        finish(send);
      }
      continue;
    }
    const ByteView bytes = write(send, room);
    if (bytes.empty()) {
      ++counters.room_too_small;
      finish(send);
      continue;
    }
    if (is_large(send) && first_of_round) {
      window_.sent(1);
    }
    return Transmit{send.from_port, *to, bytes};
  }
  return std::nullopt;
}

ByteView SendQueue::write(const SendSlot& send, ByteSpan room) const noexcept {
  const ByteView payload{send.payload, send.bytes};
  if (!is_large(send)) {
    const auto message = someip::encode(send.header, payload, room);
    return message ? *message : ByteView{};
  }
  const ByteView rest = payload.subspan(send.offset);
  const ByteView slice = rest.first(std::min(rest.size(), pacing_.segment_bytes));
  const someip::TpHeader tp{static_cast<std::uint32_t>(send.offset), slice.size() < rest.size()};
  const auto header = someip::encode_tp_header(send.header, tp, slice.size(), room);
  if (!header || room.size() - header->size() < slice.size()) {
    return {};
  }
  std::ranges::copy(slice, room.begin() + static_cast<std::ptrdiff_t>(header->size()));
  return room.first(header->size() + slice.size());
}

void SendQueue::finish(SendSlot& send) noexcept {
  send.state = send.kind == Payload::of_application ? SendSlot::State::finished : SendSlot::State::unused;
  if (send.kind != Payload::copied || send.bytes == 0) {
    return;
  }
  // Payloads that were copied later move up.
  const auto begin = static_cast<std::size_t>(send.payload - bytes_.data());
  const std::size_t end = begin + send.bytes;
  std::memmove(bytes_.data() + begin, bytes_.data() + end, used_bytes_ - end);
  used_bytes_ -= send.bytes;
  for (SendSlot& other : sends_) {
    if (other.state == SendSlot::State::waiting && other.kind == Payload::copied &&
        other.payload > send.payload) {
      other.payload -= send.bytes;
    }
  }
}

std::optional<TimePoint> SendQueue::deadline() const noexcept {
  if (std::ranges::find(sends_, SendSlot::State::waiting, &SendSlot::state) == sends_.end()) {
    return std::nullopt;
  }
  return paused_ ? window_.resume(pacing_) : TimePoint{};
}

bool SendQueue::needs(const std::byte* room) const noexcept {
  return std::ranges::any_of(sends_, [room](const SendSlot& send) {
    return send.state == SendSlot::State::waiting && is_large(send) && send.payload == room;
  });
}

const std::byte* SendQueue::take_finished() noexcept {
  const auto done = std::ranges::find(sends_, SendSlot::State::finished, &SendSlot::state);
  if (done == sends_.end()) {
    return nullptr;
  }
  done->state = SendSlot::State::unused;
  return done->payload;
}

void SendQueue::clear() noexcept {
  for (SendSlot& send : sends_) {
    if (send.state == SendSlot::State::waiting) {
      send.state = send.kind == Payload::of_application ? SendSlot::State::finished : SendSlot::State::unused;
    }
  }
  used_bytes_ = 0;
}

}  // namespace trestle::device
