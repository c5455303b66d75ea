// Conversion between CDR and SOME/IP payloads, beside memcpy of the same bytes in the same run.
#include <benchmark/benchmark.h>

#include <array>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "bridge/convert/conversion_plan.hpp"
#include "bridge/types/type_library.hpp"

namespace trestle::bridge {
namespace {

ConversionPlan plan_of(std::string_view type,
                       std::size_t reference_from = ConversionPlan::default_reference_from) {
  const auto tree = TypeLibrary{{TRESTLE_BENCH_TYPES}}.resolve(type);
  if (!tree) {
    throw std::runtime_error{to_string(tree.error())};
  }
  auto plan = ConversionPlan::compile(*tree, someip::PayloadRules{}, reference_from);
  if (!plan) {
    throw std::runtime_error{plan.error()};
  }
  return std::move(*plan);
}

/// Writes little-endian CDR.
class Sample {
 public:
  Sample() : bytes_{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}} {}

  template <typename Number>
  Sample& number(Number value) {
    while ((bytes_.size() - 4) % sizeof(Number) != 0) {
      bytes_.push_back(std::byte{0});
    }
    std::array<std::byte, sizeof(Number)> raw;
    std::memcpy(raw.data(), &value, sizeof(Number));
    bytes_.insert(bytes_.end(), raw.begin(), raw.end());
    return *this;
  }
  Sample& text(std::string_view text) {
    number(static_cast<std::uint32_t>(text.size() + 1));
    for (const char c : text) {
      number(c);
    }
    return number('\0');
  }
  Sample& header() { return number(1700000000).number(123456789U).text("velodyne"); }
  [[nodiscard]] std::vector<std::byte> bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

/// A lidar cloud as drivers send it: x y z intensity ring time, 24 bytes a point.
std::vector<std::byte> cloud(std::size_t points) {
  constexpr std::uint32_t point_step = 24;
  Sample sample;
  sample.header().number(1U).number(static_cast<std::uint32_t>(points)).number(6U);
  std::uint32_t offset = 0;
  for (const char* field : {"x", "y", "z", "intensity", "ring", "time"}) {
    sample.text(field).number(offset).number(std::uint8_t{7}).number(1U);
    offset += 4;
  }
  const auto size = static_cast<std::uint32_t>(points * point_step);
  sample.number(std::uint8_t{0}).number(point_step).number(size).number(size);
  for (std::uint32_t i = 0; i < size; ++i) {
    sample.number(static_cast<std::uint8_t>(i * 2654435761U >> 24U));
  }
  return sample.number(std::uint8_t{1}).bytes();
}

std::vector<std::byte> transforms(std::size_t count) {
  Sample sample;
  sample.number(static_cast<std::uint32_t>(count));
  for (std::size_t i = 0; i < count; ++i) {
    sample.number(1700000000)
        .number(static_cast<std::uint32_t>(i))
        .text("map")
        .text("base_link_" + std::to_string(i));
    for (int k = 0; k < 7; ++k) {
      sample.number(0.25 * k);
    }
  }
  return sample.bytes();
}

std::vector<std::byte> path(std::size_t count) {
  Sample sample;
  sample.header().number(static_cast<std::uint32_t>(count));
  for (std::size_t i = 0; i < count; ++i) {
    sample.number(1700000000).number(static_cast<std::uint32_t>(i)).text("map");
    for (int k = 0; k < 7; ++k) {
      sample.number(0.25 * k);
    }
  }
  return sample.bytes();
}

/// Lines of 100 points with a colour each.
std::vector<std::byte> markers(std::size_t count) {
  constexpr std::uint32_t points = 100;
  Sample sample;
  sample.number(static_cast<std::uint32_t>(count));
  for (std::size_t i = 0; i < count; ++i) {
    sample.header().text("objects").number(static_cast<std::uint32_t>(i)).number(4).number(0);
    for (int k = 0; k < 10; ++k) {  // pose and scale
      sample.number(0.25 * k);
    }
    for (int k = 0; k < 4; ++k) {
      sample.number(0.5F);
    }
    sample.number(0).number(0U).number(std::uint8_t{0}).number(points);
    for (std::uint32_t k = 0; k < 3 * points; ++k) {
      sample.number(0.5 * k);
    }
    sample.number(points);
    for (std::uint32_t k = 0; k < 4 * points; ++k) {
      sample.number(0.25F);
    }
    sample.text("").text("").number(std::uint8_t{0});
  }
  return sample.bytes();
}

std::vector<std::byte> floats(std::size_t count) {
  Sample sample;
  sample.number(0U).number(0U).number(static_cast<std::uint32_t>(count));
  for (std::size_t i = 0; i < count; ++i) {
    sample.number(static_cast<float>(i) * 0.1F);
  }
  return sample.bytes();
}

std::vector<std::byte> joined(const Gathered& gathered) {
  std::vector<std::byte> bytes(gathered.bytes);
  copy_to(gathered, bytes.data());
  return bytes;
}

void run(benchmark::State& state, const std::vector<std::byte>& input, auto&& convert) {
  ConversionScratch scratch;
  for (auto _ : state) {
    auto result = convert(input, scratch);
    if (!result) {
      state.SkipWithError("refused");
      return;
    }
    benchmark::DoNotOptimize(result->bytes);
    benchmark::ClobberMemory();
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(input.size()));
}

void copy(benchmark::State& state, const std::vector<std::byte>& input) {
  std::vector<std::byte> to(input.size());
  for (auto _ : state) {
    std::memcpy(to.data(), input.data(), input.size());
    benchmark::DoNotOptimize(to.data());
    benchmark::ClobberMemory();
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(input.size()));
}

void to_someip(benchmark::State& state, const ConversionPlan& plan, const std::vector<std::byte>& sample) {
  run(state, sample, [&](const auto& input, auto& scratch) { return plan.cdr_to_someip(input, scratch); });
}

void to_cdr(benchmark::State& state, const ConversionPlan& plan, const std::vector<std::byte>& sample) {
  ConversionScratch scratch;
  const auto payload = joined(*plan.cdr_to_someip(sample, scratch));
  run(state, payload, [&](const auto& input, auto& out) { return plan.someip_to_cdr(input, out); });
}

/// Conversion and the one copy into the buffer of the DDS writer or the socket.
void to_cdr_and_copy(benchmark::State& state, const ConversionPlan& plan,
                     const std::vector<std::byte>& sample) {
  ConversionScratch scratch;
  const auto payload = joined(*plan.cdr_to_someip(sample, scratch));
  std::vector<std::byte> buffer(sample.size());
  run(state, payload, [&](const auto& input, auto& out) {
    auto result = plan.someip_to_cdr(input, out);
    if (result) {
      copy_to(*result, buffer.data());
    }
    return result;
  });
}

std::size_t points(const benchmark::State& state) {
  return static_cast<std::size_t>(state.range(0));
}

void sizes(benchmark::internal::Benchmark* bench) {
  bench->ArgName("points");
  for (const int count : {1'000, 5'000, 10'000, 50'000, 100'000, 200'000, 500'000}) {
    bench->Arg(count);
  }
}

void point_cloud_memcpy(benchmark::State& state) {
  copy(state, cloud(points(state)));
}
void point_cloud_to_someip(benchmark::State& state) {
  to_someip(state, plan_of("sensor_msgs/PointCloud2"), cloud(points(state)));
}
void point_cloud_to_cdr(benchmark::State& state) {
  to_cdr(state, plan_of("sensor_msgs/PointCloud2"), cloud(points(state)));
}
void point_cloud_to_someip_copying(benchmark::State& state) {
  to_someip(state, plan_of("sensor_msgs/PointCloud2", SIZE_MAX), cloud(points(state)));
}
void point_cloud_to_cdr_and_copied_once(benchmark::State& state) {
  to_cdr_and_copy(state, plan_of("sensor_msgs/PointCloud2"), cloud(points(state)));
}
BENCHMARK(point_cloud_memcpy)->Apply(sizes);
BENCHMARK(point_cloud_to_someip)->Apply(sizes);
BENCHMARK(point_cloud_to_cdr)->Apply(sizes);
BENCHMARK(point_cloud_to_someip_copying)->Apply(sizes);
BENCHMARK(point_cloud_to_cdr_and_copied_once)->Apply(sizes);

void float_array_memcpy(benchmark::State& state) {
  copy(state, floats(points(state)));
}
void float_array_swapped_to_someip(benchmark::State& state) {
  to_someip(state, plan_of("std_msgs/Float32MultiArray"), floats(points(state)));
}
void float_array_swapped_to_cdr(benchmark::State& state) {
  to_cdr(state, plan_of("std_msgs/Float32MultiArray"), floats(points(state)));
}
BENCHMARK(float_array_memcpy)->ArgName("floats")->Arg(4'000)->Arg(100'000)->Arg(2'000'000);
BENCHMARK(float_array_swapped_to_someip)->ArgName("floats")->Arg(4'000)->Arg(100'000)->Arg(2'000'000);
BENCHMARK(float_array_swapped_to_cdr)->ArgName("floats")->Arg(4'000)->Arg(100'000)->Arg(2'000'000);

void transforms_memcpy(benchmark::State& state) {
  copy(state, transforms(1000));
}
void transforms_to_someip(benchmark::State& state) {
  to_someip(state, plan_of("tf2_msgs/TFMessage"), transforms(1000));
}
void transforms_to_cdr(benchmark::State& state) {
  to_cdr(state, plan_of("tf2_msgs/TFMessage"), transforms(1000));
}
BENCHMARK(transforms_memcpy);
BENCHMARK(transforms_to_someip);
BENCHMARK(transforms_to_cdr);

void path_memcpy(benchmark::State& state) {
  copy(state, path(1000));
}
void path_to_someip(benchmark::State& state) {
  to_someip(state, plan_of("nav_msgs/Path"), path(1000));
}
void path_to_cdr(benchmark::State& state) {
  to_cdr(state, plan_of("nav_msgs/Path"), path(1000));
}
BENCHMARK(path_memcpy);
BENCHMARK(path_to_someip);
BENCHMARK(path_to_cdr);

void markers_memcpy(benchmark::State& state) {
  copy(state, markers(100));
}
void markers_to_someip(benchmark::State& state) {
  to_someip(state, plan_of("visualization_msgs/MarkerArray"), markers(100));
}
void markers_to_cdr(benchmark::State& state) {
  to_cdr(state, plan_of("visualization_msgs/MarkerArray"), markers(100));
}
BENCHMARK(markers_memcpy);
BENCHMARK(markers_to_someip);
BENCHMARK(markers_to_cdr);

}  // namespace
}  // namespace trestle::bridge
