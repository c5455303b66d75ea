#include <benchmark/benchmark.h>

#include <array>

#include "someip/wire/header.hpp"

namespace trestle::someip {
namespace {

constexpr Header event{.service = ServiceId{0x1234},
                       .method = MethodId{0x8001},
                       .session = SessionId{7},
                       .interface_version = 1,
                       .type = MessageType::notification};

void header_encode(benchmark::State& state) {
  std::array<std::byte, header_bytes> room{};
  Header header = event;
  for (auto _ : state) {
    benchmark::DoNotOptimize(header);
    auto bytes = encode_header(header, 1392, room);
    benchmark::DoNotOptimize(bytes);
    benchmark::ClobberMemory();
  }
}
BENCHMARK(header_encode);

void header_decode(benchmark::State& state) {
  std::array<std::byte, header_bytes + 1392> datagram{};
  static_cast<void>(encode_header(event, 1392, datagram));
  for (auto _ : state) {
    benchmark::DoNotOptimize(datagram.data());
    benchmark::ClobberMemory();
    auto message = decode(datagram);
    benchmark::DoNotOptimize(message);
  }
}
BENCHMARK(header_decode);

}  // namespace
}  // namespace trestle::someip
