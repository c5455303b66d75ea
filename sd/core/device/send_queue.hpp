#pragma once
#include "sd/core/device/happenings.hpp"
#include "sd/core/device/memory.hpp"

namespace trestle::device {

/// The messages of a device that wait to be sent. Those that fit a datagram leave in their order; of larger
/// ones, in segments and paced, one is sent at a time, and the others pass it.  [feat_req_someiptp_801]
class SendQueue {
 public:
  /// Whose memory a payload is, until it is sent.
  using Payload = SendSlot::Payload;

  SendQueue(const MemoryView& memory, const someip::TpPacing& pacing) noexcept;

  /// How a payload is kept: small ones of the application are copied.
  [[nodiscard]] Payload kind_of(ByteView payload) const noexcept {
    return payload.size() <= max_copied_bytes() ? Payload::copied : Payload::of_application;
  }
  [[nodiscard]] std::size_t max_copied_bytes() const noexcept {
    return std::min(bytes_.size(), someip::max_plain_payload_bytes);
  }

  /// Whether so many messages with so many bytes that are to be copied can be pushed.
  [[nodiscard]] bool has_room(std::size_t messages, std::size_t copied_bytes) const noexcept;

  /// Adds a message to one receiver; there must be room.
  void push(const someip::Header& header, std::uint16_t from_port, const Endpoint& to, ByteView payload,
            Payload kind) noexcept;
  /// Adds a message to subscribers of a service; there must be room.
  /// @param receivers  tells for each place of the table of subscribers whether it goes there.
  template <typename IsReceiver>
  void push_event(const someip::Header& header, std::uint16_t from_port, std::uint16_t service,
                  ByteView payload, Payload kind, IsReceiver receivers) noexcept {
    SendSlot& send = add(header, from_port, payload, kind);
    send.service = service;
    const std::span<std::uint8_t> bits = receivers_of(send);
    for (std::size_t place = 0; place < bits.size() * 8; ++place) {
      if (receivers(place)) {
        bits[place / 8] = static_cast<std::uint8_t>(bits[place / 8] | (1U << (place % 8)));
      }
    }
  }

  /// The next datagram, or nothing: all is sent, or waits for deadline().
  [[nodiscard]] std::optional<Transmit> poll(ByteSpan room, const sd::ServiceDiscovery& discovery,
                                             Counters& counters, TimePoint now) noexcept;
  /// When to poll again.
  [[nodiscard]] std::optional<TimePoint> deadline() const noexcept;

  /// Whether the value of a field in this memory is being sent in segments, and must stay.
  [[nodiscard]] bool needs(const std::byte* room) const noexcept;
  /// The next payload of the application that is not needed any more; null: none.
  [[nodiscard]] const std::byte* take_finished() noexcept;
  void clear() noexcept;

 private:
  [[nodiscard]] SendSlot& add(const someip::Header& header, std::uint16_t from_port, ByteView payload,
                              Payload kind) noexcept;
  [[nodiscard]] std::span<std::uint8_t> receivers_of(const SendSlot& send) const noexcept;
  [[nodiscard]] SendSlot* earliest(std::uint32_t from) const noexcept;
  [[nodiscard]] const Endpoint* take_receiver(SendSlot& send,
                                              const sd::ServiceDiscovery& discovery) const noexcept;
  [[nodiscard]] std::optional<Transmit> poll(SendSlot& send, ByteSpan room,
                                             const sd::ServiceDiscovery& discovery, Counters& counters,
                                             TimePoint now) noexcept;
  [[nodiscard]] ByteView write(const SendSlot& send, ByteSpan room) const noexcept;
  void finish(SendSlot& send) noexcept;

  std::span<SendSlot> sends_;
  std::span<std::uint8_t> receivers_;
  std::span<const ServiceSlot> services_;
  ByteSpan bytes_;
  std::size_t used_bytes_ = 0;
  std::uint32_t next_number_ = 0;
  bool paused_ = false;  // all that waits does so for the end of a pause
  someip::TpPacing pacing_;
  someip::PaceWindow window_;
};

}  // namespace trestle::device
