#include <benchmark/benchmark.h>

#include <vector>

#include "someip/core/e2e/checker.hpp"
#include "someip/core/e2e/crc.hpp"
#include "someip/core/e2e/protector.hpp"

namespace trestle::someip::e2e {
namespace {

template <auto Crc>
void e2e_crc(benchmark::State& state) {
  std::vector<std::byte> bytes(static_cast<std::size_t>(state.range(0)), std::byte{0x5a});
  for (auto _ : state) {
    benchmark::DoNotOptimize(bytes.data());
    benchmark::DoNotOptimize(Crc(bytes, 0));
  }
  state.SetBytesProcessed(state.iterations() * state.range(0));
}
BENCHMARK(e2e_crc<crc8>)->Name("e2e_crc8")->Arg(30);
BENCHMARK(e2e_crc<crc16>)->Name("e2e_crc16")->Arg(4096);
BENCHMARK(e2e_crc<crc32>)->Name("e2e_crc32")->Arg(64)->Arg(4 << 20);
BENCHMARK(e2e_crc<crc32_p4>)->Name("e2e_crc32_p4")->Arg(64)->Arg(4 << 20);
BENCHMARK(e2e_crc<crc64>)->Name("e2e_crc64")->Arg(64)->Arg(4 << 20);

/// One event, from protect() to check(), with everything that belongs to it.
template <typename Profile>
void e2e_round_trip(benchmark::State& state) {
  Profile profile;
  auto protector = Protector::create(profile);
  auto checker = Checker::create(profile);
  std::vector<std::byte> bytes(static_cast<std::size_t>(state.range(0)), std::byte{0x5a});
  for (auto _ : state) {
    static_cast<void>(protector->protect(bytes));
    benchmark::DoNotOptimize(checker->check(bytes));
  }
  state.SetBytesProcessed(state.iterations() * state.range(0));
}
BENCHMARK(e2e_round_trip<Profile4>)->Name("e2e_round_trip_p04")->Arg(64)->Arg(1400);
BENCHMARK(e2e_round_trip<Profile7>)->Name("e2e_round_trip_p07")->Arg(64)->Arg(4 << 20);

}  // namespace
}  // namespace trestle::someip::e2e
