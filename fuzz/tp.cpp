// Property: on any sequence of segments and pauses the reassembler does what a model with one entry per byte
// does: the same messages, refusals, counters and number of messages under way. Its memory is exactly as
// large as its limits say, so the address sanitizer sees every byte beyond. And what the segmenter cuts comes
// together again.
//
// The input is a list of records of 8 bytes:
//   0  bits 0-1 sender, 2 port, 3 event, 4-5 session, 6 no TP flag, 7 a whole message instead of one segment
//   1  more segments flag and reserved bits, as in the TP header
//   2-3  offset in 16 bytes; 0xffff stands for the largest
//   4-5  size of the slice; the low 9 bits
//   6  milliseconds that pass before it
//   7  first byte of the slice
#include <array>
#include <cstdlib>

#include "someip/core/tp_segmenter.hpp"
#include "test/someip/tp_model.hpp"
#include "test/someip/tp_slots.hpp"

using namespace trestle;
using namespace trestle::someip;
using namespace std::chrono_literals;

namespace {

constexpr std::size_t max_messages = 3;
constexpr TpReassemblyLimits limits{
    .max_message_bytes = 600, .max_per_sender = 2, .max_age = 200ms, .protected_bytes_per_s = 20'000};
constexpr std::size_t record_bytes = 8;

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

struct Peer {
  test::TpSlots memory{max_messages, limits.max_message_bytes};
  TpReassembler reassembler{memory.slots(), limits};
  test::TpModel model{max_messages, limits};

  void offer(const Endpoint& from, const Message& message, TimePoint now) {
    const auto ours = reassembler.on_segment(from, message, now);
    std::optional<TpDrop> drop;
    const auto theirs = model.on_segment(from, message, now, drop);
    require(ours.has_value() == !drop.has_value());
    require(ours || ours.error() == *drop);
    require((ours && *ours) == theirs.has_value());
    require(reassembler.counters().drops == model.drops);
    require(reassembler.size() == model.size() && reassembler.size() <= max_messages);
    require(reassembler.deadline().has_value() == (model.size() != 0));
    if (theirs) {
      require((*ours)->header == theirs->header && (*ours)->from == theirs->from);
      require(std::ranges::equal((*ours)->payload, theirs->payload));
    }
  }
};

std::vector<std::byte> counting_bytes(std::size_t size, std::uint8_t first) {
  std::vector<std::byte> result(size);
  for (std::byte& byte : result) {
    byte = std::byte{first};
    first = static_cast<std::uint8_t>(first * 5U + 1U);
  }
  return result;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Peer peer;
  TimePoint now{1000s};
  for (; size >= record_bytes; data += record_bytes, size -= record_bytes) {
    const std::span<const std::uint8_t, record_bytes> record{data, record_bytes};
    const Endpoint from{IpAddress::v4(10, 0, 0, record[0] & 3U),
                        static_cast<std::uint16_t>((record[0] >> 2U) & 1U)};
    const bool tp = (record[0] & 0x40U) == 0;
    Header header{.method = MethodId{static_cast<std::uint16_t>((record[0] >> 3U) & 1U)},
                  .session = SessionId{static_cast<std::uint16_t>((record[0] >> 4U) & 3U)},
                  .type = tp ? MessageType::tp_notification : MessageType::notification,
                  .return_code = ReturnCode{record[7]}};
    const std::uint32_t unit = record[2] * 256U + record[3];
    const std::size_t bytes = (record[4] * 256U + record[5]) % 512;
    now += std::chrono::milliseconds{record[6]};
    const std::vector<std::byte> payload = counting_bytes(bytes, record[7]);
    if ((record[0] & 0x80U) != 0) {
      const std::size_t segment_bytes = 16 * (1 + unit % 32);
      TpSegmenter segments{header, bytes, segment_bytes};
      std::size_t count = 0;
      while (const auto segment = segments.next()) {
        std::vector<std::byte> datagram{segment->header.begin(), segment->header.end()};
        require(segment->offset + segment->bytes <= bytes && segment->bytes <= segment_bytes);
        const ByteView slice = ByteView{payload}.subspan(segment->offset, segment->bytes);
        datagram.insert(datagram.end(), slice.begin(), slice.end());
        const auto message = decode(datagram);
        require(message && message->size() == datagram.size());
        peer.offer(from, *message, now);
        ++count;
      }
      require(count == segments.size() && segments.offset() == bytes);
      continue;
    }
    const std::uint32_t offset = unit == 0xffff ? 0xfffffff0 : unit % 64 * 16;
    std::vector<std::byte> segment(tp_header_bytes);
    const std::uint32_t word = offset | (record[1] & 0xfU);
    for (std::size_t i = 0; i < tp_header_bytes; ++i) {
      segment[i] = static_cast<std::byte>(word >> (24 - 8 * i));
    }
    segment.insert(segment.end(), payload.begin(), payload.end());
    // The largest sizes stand for payloads too short for a TP header.
    segment.resize(bytes >= 508 ? bytes - 508 : segment.size());
    peer.offer(from, Message{header, segment}, now);
  }
  now += limits.max_age;
  peer.reassembler.on_time(now);
  require(peer.reassembler.size() == 0 && !peer.reassembler.deadline());
  return 0;
}
