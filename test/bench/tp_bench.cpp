// What SOME/IP-TP costs beside moving the bytes once. Every benchmark reports bytes of payload per second,
// and all touch the same amount of memory: a payload of the given size, read from one place and written to
// another.
#include <benchmark/benchmark.h>

#include <cstring>
#include <vector>

#include "someip/core/tp_reassembler.hpp"
#include "someip/core/tp_segmenter.hpp"

namespace trestle::someip {
namespace {

constexpr Endpoint peer{IpAddress::v4(127, 0, 0, 1), 30501};
constexpr Header event{.service = ServiceId{0x1234},
                       .method = MethodId{0x8001},
                       .session = SessionId{1},
                       .interface_version = 1,
                       .type = MessageType::notification};

/// A message as it comes from the network: whole datagrams one behind the other.
std::vector<std::byte> segmented(std::size_t payload_bytes) {
  std::vector<std::byte> result;
  for (TpSegmenter segments{event, payload_bytes}; const auto segment = segments.next();) {
    result.insert(result.end(), segment->header.begin(), segment->header.end());
    result.resize(result.size() + segment->bytes, std::byte{0x5a});
  }
  return result;
}

void report_bytes(benchmark::State& state, std::size_t payload_bytes) {
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(payload_bytes));
}

/// The yardstick.
void payload_memcpy(benchmark::State& state) {
  const auto size = static_cast<std::size_t>(state.range(0));
  const std::vector<std::byte> from(size, std::byte{0x5a});
  std::vector<std::byte> to(size);
  for (auto _ : state) {
    std::memcpy(to.data(), from.data(), size);
    benchmark::ClobberMemory();
  }
  report_bytes(state, size);
}

/// The headers of all segments; the payload is not touched.
void tp_segmentation(benchmark::State& state) {
  const auto size = static_cast<std::size_t>(state.range(0));
  for (auto _ : state) {
    for (TpSegmenter segments{event, size}; auto segment = segments.next();) {
      benchmark::DoNotOptimize(segment);
    }
  }
  report_bytes(state, size);
}

/// Received datagrams, in order, to a whole message.
void tp_reassembly(benchmark::State& state) {
  const auto size = static_cast<std::size_t>(state.range(0));
  std::vector<std::byte> datagrams = segmented(size);
  std::vector<std::byte> buffer(size);
  std::vector<std::uint32_t> map(tp_map_words(size));
  std::array<TpSlot, 1> slots{TpSlot{buffer, map}};
  using namespace std::chrono_literals;
  TpReassembler reassembler{slots, {.max_message_bytes = size, .max_per_sender = 1, .max_age = 1s}};
  TimePoint now{};
  for (auto _ : state) {
    now += 2s;  // the previous message of the same session is forgotten
    for (MessageCursor cursor{datagrams}; const auto message = cursor.next();) {
      auto outcome = reassembler.on_segment(peer, *message, now);
      benchmark::DoNotOptimize(outcome);
    }
  }
  if (reassembler.counters().messages != static_cast<std::uint64_t>(state.iterations())) {
    state.SkipWithError("a message was not complete");
  }
  report_bytes(state, size);
}

void sizes(benchmark::internal::Benchmark* benchmark) {
  benchmark->RangeMultiplier(4)->Range(64 << 10, 4 << 20)->Unit(benchmark::kMicrosecond);
}
BENCHMARK(payload_memcpy)->Apply(sizes);
BENCHMARK(tp_segmentation)->Apply(sizes);
BENCHMARK(tp_reassembly)->Apply(sizes);

}  // namespace
}  // namespace trestle::someip
