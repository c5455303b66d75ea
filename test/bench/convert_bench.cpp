// Conversion between CDR and SOME/IP payloads, each beside memcpy of the same bytes. As from a sensor, each
// message differs from the one before in its stamp, and each element of an array in its numbers.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <vector>

#include "bridge/messages/convert/conversion_plan.hpp"
#include "bridge/messages/types/type_library.hpp"

namespace trestle::messages {
namespace {

ConversionPlan plan_of(std::string_view type,
                       std::size_t reference_from = ConversionPlan::default_reference_from) {
  const auto tree = TypeLibrary{{TRESTLE_BENCH_TYPES}}.resolve(type);  // beside the built-in ones
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
  template <typename Number>
  Sample& numbers(std::size_t count, Number value) {
    for (std::size_t i = 0; i < count; ++i) {
      number(value);
    }
    return *this;
  }
  Sample& text(std::string_view text) {
    number(static_cast<std::uint32_t>(text.size() + 1));
    for (const char c : text) {
      number(c);
    }
    return number('\0');
  }
  Sample& noise(std::uint32_t size) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + size);
    for (std::uint32_t i = 0; i < size; ++i) {
      bytes_[at + i] = static_cast<std::byte>(i * 2654435761U >> 24U);
    }
    return *this;
  }
  /// Different numbers for each `of`.
  Sample& pose(std::size_t count, std::size_t of) {
    for (std::size_t i = 0; i < count; ++i) {
      number(0.25 * static_cast<double>(i + 1) + 0.001 * static_cast<double>(of));
    }
    return *this;
  }
  Sample& stamp(std::size_t of) { return number(1700000000).number(static_cast<std::uint32_t>(1000 * of)); }
  Sample& header(std::size_t of = 0) { return stamp(of).text("velodyne"); }
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
  return sample.noise(size).number(std::uint8_t{1}).bytes();
}

std::vector<std::byte> transforms(std::size_t count) {
  Sample sample;
  sample.number(static_cast<std::uint32_t>(count));
  for (std::size_t i = 0; i < count; ++i) {
    sample.stamp(i).text("map").text("base_link_" + std::to_string(i)).pose(7, i);
  }
  return sample.bytes();
}

std::vector<std::byte> path(std::size_t count) {
  Sample sample;
  sample.header().number(static_cast<std::uint32_t>(count));
  for (std::size_t i = 0; i < count; ++i) {
    sample.stamp(i).text("map").pose(7, i);
  }
  return sample.bytes();
}

/// Lines of so many points with a colour each.
/// @param space  the namespace of each; nothing: the same for all.
std::vector<std::byte> markers(std::size_t count, std::uint32_t points,
                               std::string (*space)(std::size_t) = nullptr) {
  Sample sample;
  sample.number(static_cast<std::uint32_t>(count));
  for (std::size_t i = 0; i < count; ++i) {
    sample.header(i).text(space != nullptr ? space(i) : "objects");
    sample.number(static_cast<std::uint32_t>(i)).number(4).number(0);
    sample.pose(7, i).numbers(3, 0.25);                                          // scale
    sample.number(0.01F * static_cast<float>(i)).numbers(2, 0.5F).number(1.0F);  // colour
    sample.number(0).number(0U).number(std::uint8_t{0});
    sample.number(points).numbers(3 * points, 0.5).number(points).numbers(4 * points, 0.25F);
    sample.text("").number(0).number(0U).text("").text("").number(0U);  // texture
    sample.number(0U).text("").text("");                                // its coordinates, text, mesh
    sample.text("").number(0U).number(std::uint8_t{0});
  }
  return sample.bytes();
}

/// As a computer tells of its parts.
std::vector<std::byte> diagnostics(std::size_t count) {
  constexpr std::uint32_t values = 10;
  Sample sample;
  sample.header().number(static_cast<std::uint32_t>(count));
  for (std::size_t i = 0; i < count; ++i) {
    sample.number(std::uint8_t{0})
        .text("sensing/lidar/node_" + std::to_string(i))
        .text("OK")
        .text("lidar-0042");
    sample.number(values);
    for (std::uint32_t k = 0; k < values; ++k) {
      sample.text("temperature " + std::to_string(k)).text(std::to_string(20 + (7 * i + k) % 90) + ".25");
    }
  }
  return sample.bytes();
}

/// Cars, each with what it may do next.
std::vector<std::byte> objects(std::size_t count) {
  constexpr std::uint32_t paths = 5;
  constexpr std::uint32_t poses = 10;
  Sample sample;
  sample.header().number(static_cast<std::uint32_t>(count));
  for (std::size_t i = 0; i < count; ++i) {
    for (std::uint8_t k = 0; k < 16; ++k) {  // its id
      sample.number(k);
    }
    sample.number(0.9F).number(1U).number(std::uint8_t{1}).number(0.8F);
    // Pose, twist and acceleration, with covariances.
    sample.pose(7, i).numbers(36, 0.25).pose(6, i).numbers(36, 0.25).pose(6, i).numbers(36, 0.25);
    sample.number(paths);
    for (std::uint32_t k = 0; k < paths; ++k) {
      sample.number(poses).pose(std::size_t{7} * poses, i + k).number(0).number(500'000'000U).number(0.2F);
    }
    sample.number(std::uint8_t{0}).number(4U).numbers(3 * 4, 1.5F).numbers(3, 2.0);  // shape
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

/// As a scanner of 270 degrees with a quarter of a degree between two rays sends it.
std::vector<std::byte> laser_scan() {
  constexpr std::uint32_t rays = 1081;
  Sample sample;
  sample.header().numbers(7, 0.25F);
  for (const float step : {0.01F, 1.0F}) {  // ranges and intensities
    sample.number(rays);
    for (std::uint32_t i = 0; i < rays; ++i) {
      sample.number(step * static_cast<float>(i));
    }
  }
  return sample.bytes();
}

std::vector<std::byte> image() {
  constexpr std::uint32_t height = 1080;
  constexpr std::uint32_t step = 1920 * 3;
  Sample sample;
  sample.header().number(height).number(step / 3).text("bgr8").number(std::uint8_t{0});
  return sample.number(step).number(height * step).noise(height * step).bytes();
}

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Memory that the same bytes lie in at several places, one after the other: how source and destination stand
/// to each other within a page, and in a cache line, makes some copies half as fast again, and differs from
/// process to process.
class Placements {
 public:
  static constexpr std::size_t count = 8;

  explicit Placements(ByteView bytes)
      : bytes_{bytes},
        memory_{static_cast<std::byte*>(std::aligned_alloc(page, (bytes.size() / page + 2) * page)),
                &std::free} {}

  [[nodiscard]] std::span<std::byte> at(std::size_t placement) {
    std::byte* const to = memory_.get() + placement * step;
    std::memcpy(to, bytes_.data(), bytes_.size());
    return {to, bytes_.size()};
  }

 private:
  static constexpr std::size_t page = 4096;
  static constexpr std::size_t step = page / count + 16;  // which is what allocations are aligned to
  static_assert((count - 1) * step < page);

  ByteView bytes_;
  std::unique_ptr<std::byte, decltype(&std::free)> memory_;
};

/// The mean of each placement's median.
class Times {
 public:
  void add(std::size_t placement, double time_ns) { times_[placement].push_back(time_ns); }
  [[nodiscard]] double mean() {
    double sum = 0;
    unsigned measured = 0;
    for (std::vector<double>& times : times_) {
      if (!times.empty()) {
        sum += median(times);
        ++measured;
      }
    }
    return sum / measured;
  }

 private:
  std::array<std::vector<double>, Placements::count> times_;
};

/// What differs from message to message.
class Changes {
 public:
  /// The fraction of a second of the stamp `at` there.
  static Changes of_stamp(std::size_t at) { return {at + 4, false}; }
  /// The first letter of a text `at` there.
  static Changes of_text(std::size_t at) { return {at, true}; }

  void apply(std::span<std::byte> message) {
    ++turn_;
    if (is_letter_) {
      message[at_] = static_cast<std::byte>('a' + turn_ % 16);
    } else {
      std::memcpy(&message[at_], &turn_, sizeof turn_);
    }
  }

 private:
  Changes(std::size_t at, bool is_letter) : at_{at}, is_letter_{is_letter} {}

  std::size_t at_;
  bool is_letter_;
  std::uint32_t turn_ = 0;
};

/// Ours and memcpy of the input in turn, on the same memory: what disturbs one disturbs the other.
void beside_memcpy(benchmark::State& state, ByteView bytes, Changes changes, auto&& ours) {
  using Clock = std::chrono::steady_clock;
  constexpr std::size_t bytes_at_once = 256 * 1024;  // beside which reading the clock costs nothing
  const std::size_t times = std::max<std::size_t>(1, bytes_at_once / bytes.size());
  const auto time = [&](auto&& work, std::span<std::byte> input) {
    const auto begin = Clock::now();
    for (std::size_t i = 0; i < times; ++i) {
      changes.apply(input);
      work(ByteView{input});
      benchmark::ClobberMemory();
    }
    return std::chrono::duration<double, std::nano>{Clock::now() - begin}.count() /
           static_cast<double>(times);
  };
  std::vector<std::byte> to(bytes.size());
  const auto copy = [&](ByteView input) {
    std::memcpy(to.data(), input.data(), input.size());
    benchmark::DoNotOptimize(to.data());
  };
  Placements placements{bytes};
  Times floor_ns;
  Times ours_ns;
  const std::int64_t at_each =
      std::max<std::int64_t>(1, state.max_iterations / std::int64_t{Placements::count});
  std::int64_t iteration = 0;
  std::size_t placement = 0;
  std::span<std::byte> input;
  for (auto _ : state) {
    if (iteration % at_each == 0) {
      placement = static_cast<std::size_t>(iteration / at_each) % Placements::count;
      input = placements.at(placement);
      time(copy, input);
      time(ours, input);  // memory grows with the first message
    }
    double floor = 0;
    double own = 0;
    if (++iteration % 2 == 0) {
      own = time(ours, input);
      floor = time(copy, input);
    } else {
      floor = time(copy, input);
      own = time(ours, input);
    }
    floor_ns.add(placement, floor);
    ours_ns.add(placement, own);
    // Of both, as it decides how long all of this takes.
    state.SetIterationTime((floor + own) * static_cast<double>(times) * 1e-9);
  }
  state.counters["floor_ns"] = floor_ns.mean();
  state.counters["ours_ns"] = ours_ns.mean();
  state.counters["bytes"] = static_cast<double>(bytes.size());
}

Gathered taken(const tl::expected<Gathered, ConversionError>& result) {
  if (!result) {
    throw std::runtime_error{to_string(result.error())};
  }
  return *result;
}

/// A message, and where its first stamp stands in CDR; in SOME/IP that is so much before as there is
/// encapsulation.
struct Stamped {
  std::vector<std::byte> sample;
  std::size_t at;
};
constexpr std::size_t encapsulation = 4;
constexpr std::size_t count_bytes = 4;
Stamped at_front(std::vector<std::byte> sample) {
  return {std::move(sample), encapsulation};
}
Stamped in_first_element(std::vector<std::byte> sample) {
  return {std::move(sample), encapsulation + count_bytes};
}

void to_someip(benchmark::State& state, const ConversionPlan& plan, ByteView sample, Changes changes) {
  ConversionScratch scratch;
  beside_memcpy(state, sample, changes, [&](ByteView from) {
    benchmark::DoNotOptimize(taken(plan.cdr_to_someip(from, scratch)).bytes);
  });
}
void to_someip(benchmark::State& state, const ConversionPlan& plan, const Stamped& message) {
  to_someip(state, plan, message.sample, Changes::of_stamp(message.at));
}

std::vector<std::byte> payload_of(const ConversionPlan& plan, ByteView sample) {
  ConversionScratch scratch;
  return joined(taken(plan.cdr_to_someip(sample, scratch)));
}

void to_cdr(benchmark::State& state, const ConversionPlan& plan, ByteView payload, Changes changes) {
  ConversionScratch scratch;
  beside_memcpy(state, payload, changes, [&](ByteView from) {
    benchmark::DoNotOptimize(taken(plan.someip_to_cdr(from, scratch)).bytes);
  });
}
void to_cdr(benchmark::State& state, const ConversionPlan& plan, const Stamped& message) {
  to_cdr(state, plan, payload_of(plan, message.sample), Changes::of_stamp(message.at - encapsulation));
}

/// Conversion and the one copy into the buffer of the DDS writer or the socket.
void to_cdr_and_copy(benchmark::State& state, const ConversionPlan& plan, const Stamped& message) {
  const auto payload = payload_of(plan, message.sample);
  std::vector<std::byte> buffer(message.sample.size());
  ConversionScratch scratch;
  beside_memcpy(state, payload, Changes::of_stamp(message.at - encapsulation), [&](ByteView from) {
    copy_to(taken(plan.someip_to_cdr(from, scratch)), buffer.data());
    benchmark::DoNotOptimize(buffer.data());
  });
}

std::size_t points(const benchmark::State& state) {
  return static_cast<std::size_t>(state.range(0));
}

void sizes(benchmark::internal::Benchmark* bench) {
  bench->ArgName("points");
  bench->UseManualTime();
  for (const int count : {1'000, 5'000, 10'000, 50'000, 100'000, 200'000, 500'000}) {
    bench->Arg(count);
  }
}

void point_cloud_to_someip(benchmark::State& state) {
  to_someip(state, plan_of("sensor_msgs/PointCloud2"), at_front(cloud(points(state))));
}
void point_cloud_to_cdr(benchmark::State& state) {
  to_cdr(state, plan_of("sensor_msgs/PointCloud2"), at_front(cloud(points(state))));
}
void point_cloud_to_someip_copying(benchmark::State& state) {
  to_someip(state, plan_of("sensor_msgs/PointCloud2", SIZE_MAX), at_front(cloud(points(state))));
}
void point_cloud_to_cdr_and_copied_once(benchmark::State& state) {
  to_cdr_and_copy(state, plan_of("sensor_msgs/PointCloud2"), at_front(cloud(points(state))));
}
BENCHMARK(point_cloud_to_someip)->Apply(sizes);
BENCHMARK(point_cloud_to_cdr)->Apply(sizes);
BENCHMARK(point_cloud_to_someip_copying)->Apply(sizes);
BENCHMARK(point_cloud_to_cdr_and_copied_once)->Apply(sizes);

void float_array_swapped_to_someip(benchmark::State& state) {
  to_someip(state, plan_of("std_msgs/Float32MultiArray"), at_front(floats(points(state))));
}
void float_array_swapped_to_cdr(benchmark::State& state) {
  to_cdr(state, plan_of("std_msgs/Float32MultiArray"), at_front(floats(points(state))));
}
void lengths(benchmark::internal::Benchmark* bench) {
  bench->ArgName("floats");
  bench->UseManualTime();
  for (const int count : {1'000, 4'000, 100'000, 2'000'000}) {
    bench->Arg(count);
  }
}
BENCHMARK(float_array_swapped_to_someip)->Apply(lengths);
BENCHMARK(float_array_swapped_to_cdr)->Apply(lengths);

void laser_scan_to_someip(benchmark::State& state) {
  to_someip(state, plan_of("sensor_msgs/LaserScan"), at_front(laser_scan()));
}
void laser_scan_to_cdr(benchmark::State& state) {
  to_cdr(state, plan_of("sensor_msgs/LaserScan"), at_front(laser_scan()));
}
BENCHMARK(laser_scan_to_someip)->UseManualTime();
BENCHMARK(laser_scan_to_cdr)->UseManualTime();

void image_to_someip(benchmark::State& state) {
  to_someip(state, plan_of("sensor_msgs/Image"), at_front(image()));
}
void image_to_cdr(benchmark::State& state) {
  to_cdr(state, plan_of("sensor_msgs/Image"), at_front(image()));
}
BENCHMARK(image_to_someip)->UseManualTime();
BENCHMARK(image_to_cdr)->UseManualTime();

void transforms_to_someip(benchmark::State& state) {
  to_someip(state, plan_of("tf2_msgs/TFMessage"), in_first_element(transforms(1000)));
}
void transforms_to_cdr(benchmark::State& state) {
  to_cdr(state, plan_of("tf2_msgs/TFMessage"), in_first_element(transforms(1000)));
}
BENCHMARK(transforms_to_someip)->UseManualTime();
BENCHMARK(transforms_to_cdr)->UseManualTime();

void path_to_someip(benchmark::State& state) {
  to_someip(state, plan_of("nav_msgs/Path"), at_front(path(1000)));
}
void path_to_cdr(benchmark::State& state) {
  to_cdr(state, plan_of("nav_msgs/Path"), at_front(path(1000)));
}
BENCHMARK(path_to_someip)->UseManualTime();
BENCHMARK(path_to_cdr)->UseManualTime();

void markers_to_someip(benchmark::State& state) {
  to_someip(state, plan_of("visualization_msgs/MarkerArray"),
            in_first_element(markers(100, static_cast<std::uint32_t>(points(state)))));
}
void markers_to_cdr(benchmark::State& state) {
  to_cdr(state, plan_of("visualization_msgs/MarkerArray"),
         in_first_element(markers(100, static_cast<std::uint32_t>(points(state)))));
}
BENCHMARK(markers_to_someip)->UseManualTime()->ArgName("points")->Arg(0)->Arg(100);
BENCHMARK(markers_to_cdr)->UseManualTime()->ArgName("points")->Arg(0)->Arg(100);

void diagnostics_to_someip(benchmark::State& state) {
  to_someip(state, plan_of("diagnostic_msgs/DiagnosticArray"), at_front(diagnostics(100)));
}
void diagnostics_to_cdr(benchmark::State& state) {
  to_cdr(state, plan_of("diagnostic_msgs/DiagnosticArray"), at_front(diagnostics(100)));
}
BENCHMARK(diagnostics_to_someip)->UseManualTime();
BENCHMARK(diagnostics_to_cdr)->UseManualTime();

void objects_to_someip(benchmark::State& state) {
  to_someip(state, plan_of("autoware_perception_msgs/PredictedObjects"), at_front(objects(100)));
}
void objects_to_cdr(benchmark::State& state) {
  to_cdr(state, plan_of("autoware_perception_msgs/PredictedObjects"), at_front(objects(100)));
}
BENCHMARK(objects_to_someip)->UseManualTime();
BENCHMARK(objects_to_cdr)->UseManualTime();

// Looking for what repeats where nothing does. The letter is that of the frame's name; in SOME/IP its BOM
// stands before it.
constexpr std::size_t cloud_frame_at = 8 + 4;
void point_cloud_of_changing_frame_to_someip(benchmark::State& state) {
  to_someip(state, plan_of("sensor_msgs/PointCloud2"), cloud(points(state)),
            Changes::of_text(encapsulation + cloud_frame_at));
}
void point_cloud_of_changing_frame_to_cdr(benchmark::State& state) {
  const auto plan = plan_of("sensor_msgs/PointCloud2");
  to_cdr(state, plan, payload_of(plan, cloud(points(state))), Changes::of_text(cloud_frame_at + 3));
}
BENCHMARK(point_cloud_of_changing_frame_to_someip)->Apply(sizes);
BENCHMARK(point_cloud_of_changing_frame_to_cdr)->Apply(sizes);

std::string own_space(std::size_t of) {
  return "objects_" + std::to_string(of);
}
void markers_of_many_namespaces_to_someip(benchmark::State& state) {
  to_someip(state, plan_of("visualization_msgs/MarkerArray"), in_first_element(markers(100, 0, own_space)));
}
void markers_of_many_namespaces_to_cdr(benchmark::State& state) {
  to_cdr(state, plan_of("visualization_msgs/MarkerArray"), in_first_element(markers(100, 0, own_space)));
}
BENCHMARK(markers_of_many_namespaces_to_someip)->UseManualTime();
BENCHMARK(markers_of_many_namespaces_to_cdr)->UseManualTime();

/// What the report has not: with caches that other work has filled meanwhile, as in a running bridge.
void cold(benchmark::State& state, ByteView bytes, Changes changes, auto&& ours) {
  using Clock = std::chrono::steady_clock;
  std::vector<std::byte> message{bytes.begin(), bytes.end()};
  const std::vector<std::byte> from(static_cast<std::size_t>(state.range(1)) << 20U, std::byte{1});
  std::vector<std::byte> to(from.size());
  std::vector<double> times;
  for (auto _ : state) {
    changes.apply(message);
    std::memcpy(to.data(), from.data(), from.size());
    benchmark::DoNotOptimize(to.data());
    benchmark::ClobberMemory();
    const auto begin = Clock::now();
    ours(ByteView{message});
    times.push_back(std::chrono::duration<double, std::nano>{Clock::now() - begin}.count());
  }
  state.counters["ours_ns"] = median(times);
}
void cold_cloud_to_someip(benchmark::State& state) {
  const auto plan = plan_of("sensor_msgs/PointCloud2");
  ConversionScratch scratch;
  cold(state, cloud(points(state)), Changes::of_stamp(encapsulation),
       [&](ByteView from) { benchmark::DoNotOptimize(taken(plan.cdr_to_someip(from, scratch)).bytes); });
}
void cold_cloud_to_cdr(benchmark::State& state) {
  const auto plan = plan_of("sensor_msgs/PointCloud2");
  ConversionScratch scratch;
  cold(state, payload_of(plan, cloud(points(state))), Changes::of_stamp(0),
       [&](ByteView from) { benchmark::DoNotOptimize(taken(plan.someip_to_cdr(from, scratch)).bytes); });
}
BENCHMARK(cold_cloud_to_someip)->ArgNames({"points", "megabytes"})->Args({1'000, 1})->Args({1'000, 16});
BENCHMARK(cold_cloud_to_cdr)->ArgNames({"points", "megabytes"})->Args({1'000, 1})->Args({1'000, 16});

}  // namespace
}  // namespace trestle::messages
