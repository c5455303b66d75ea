// Messages that rosbags and Python's struct have written: map_oracle.py.
#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <limits>
#include <map>
#include <random>
#include <sstream>

#include "bridge/messages/map/mapped_plan.hpp"
#include "test/allocations.hpp"
#include "test/bridge/messages/map/mappings.hpp"
#include "test/source_dir.hpp"

namespace trestle::messages::map_vectors_test {
namespace {

using namespace trestle::test;

constexpr const char* status_msg = R"(
uint16 speed_raw
int16 yaw_raw
uint8 gear_raw
bool moving
uint32 time_ms
uint16[4] wheels
string text
uint8[] blob
float64[] samples
geometry_msgs/Point position
uint8 counter
uint16 checksum
)";
constexpr const char* state_msg = R"(
std_msgs/Header header
geometry_msgs/Twist twist
uint8 gear
int32 moving
float32[4] wheels
float64 front_left
string label
uint8[] data
float32[] samples
geometry_msgs/Point where
)";
constexpr std::chrono::nanoseconds received_at{1'700'000'123'456'789'012};

FieldMapping state_mapping() {
  FieldMapping mapping;
  mapping.rules = {
      from("header.stamp", "time_ms", {.unit = TimeUnit::ms}),
      fixed("header.frame_id", "base_link"),
      from("twist.linear.x", "speed_raw", {.scale = 0.01}),
      from("twist.angular.z", "yaw_raw", {.scale = -0.001, .offset = 0.5}),
      from("gear", "gear_raw",
           {.table = table({{"0", "1"}, {"1", "22"}, {"2", "20"}, {"7", "2"}}),
            .otherwise = Otherwise::value,
            .otherwise_value = {"99", {}}}),
      from("moving", "moving"),
      from("wheels", "wheels", {.scale = 0.05, .offset = -10}),
      from("front_left", "wheels[2]", {.only = MapDirection::to_ros}),
      from("label", "text"),
      from("data", "blob"),
      from("samples", "samples"),
      from("where", "position"),
  };
  mapping.dropped = {{"counter", {}}};
  mapping.constants = {{{"checksum", {}}, {"0xabcd", {}}}};
  mapping.others_default = true;
  return mapping;
}

FieldMapping imu_mapping() {
  FieldMapping mapping;
  mapping.rules = {received("header.stamp"), fixed("orientation_covariance[0]", "-1"),
                   fixed("orientation.w", "1")};
  for (const auto& [axis, index] : {std::pair{"x", "[0]"}, {"y", "[1]"}, {"z", "[2]"}}) {
    mapping.rules.push_back(from(std::string{"angular_velocity."} + axis, std::string{"rate"} + index));
  }
  for (const char* index : {"[0]", "[4]", "[8]"}) {
    mapping.rules.push_back(from(std::string{"angular_velocity_covariance"} + index, "variance"));
  }
  mapping.dropped = {{"quality", {}}};
  mapping.others_default = true;
  return mapping;
}

struct Known {
  TypeTree payload;
  TypeTree ros;
  FieldMapping mapping;
};

const Known& known(const std::string& name) {
  static const std::map<std::string, Known> all = [] {
    const MapTypes state{status_msg, state_msg};
    const MapTypes imu{"float32[3] rate\nfloat32 variance\nuint8 quality", "uint8 unused"};
    TypeLibrary library;
    return std::map<std::string, Known>{
        {"state", {state.payload, state.ros, state_mapping()}},
        {"imu", {imu.payload, library.resolve("sensor_msgs/msg/Imu").value(), imu_mapping()}}};
  }();
  return all.at(name);
}

MappedPlan plan_of(const Known& known, MapDirection direction) {
  auto wire =
      ConversionPlan::compile(known.payload, {},
                              direction == MapDirection::to_ros ? std::numeric_limits<std::size_t>::max()
                                                                : ConversionPlan::default_reference_from);
  CompiledMap map = compile_map(known.payload, known.ros, known.mapping, direction);
  for (const MapProblem& problem : map.problems) {
    ADD_FAILURE() << problem.text;
  }
  return {std::move(wire.value()), std::move(map.map.value())};
}

struct Vector {
  std::string mapping;
  std::string direction;
  std::vector<std::byte> payload;
  std::array<std::vector<std::byte>, 2> cdr;  ///< little and big endian
  MapCounters lost;
};

std::vector<Vector> vectors() {
  std::ifstream file{source_dir() + "/test/bridge/messages/map/vectors.txt"};
  std::vector<Vector> all;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words{line};
    Vector one;
    std::string payload;
    std::string little;
    std::string big;
    words >> one.mapping >> one.direction >> payload >> little >> big >> one.lost.saturated >>
        one.lost.rounded >> one.lost.not_a_number;
    one.payload = hex(payload);
    one.cdr = {hex(little), hex(big)};
    all.push_back(std::move(one));
  }
  return all;
}

std::string lost_text(const MapCounters& lost) {
  return std::to_string(lost.saturated) + " saturated, " + std::to_string(lost.rounded) + " rounded, " +
         std::to_string(lost.not_a_number) + " not a number";
}

TEST(MapVectors, AreMadeInBothDirections) {
  const std::vector<Vector> all = vectors();
  ASSERT_EQ(all.size(), 45U);
  MappedScratch scratch;
  for (const Vector& one : all) {
    SCOPED_TRACE(one.mapping + " " + one.direction + " " + to_hex(one.payload));
    if (one.direction == "to_ros") {
      MappedPlan plan = plan_of(known(one.mapping), MapDirection::to_ros);
      const auto made = plan.someip_to_cdr(one.payload, received_at, scratch);
      ASSERT_TRUE(made) << to_string(made.error());
      EXPECT_EQ(to_hex(joined(*made)), to_hex(one.cdr[std::endian::native == std::endian::big]));
      EXPECT_EQ(lost_text(plan.counters()), lost_text(one.lost));
      continue;
    }
    for (const std::vector<std::byte>& cdr : one.cdr) {
      MappedPlan plan = plan_of(known(one.mapping), MapDirection::to_payload);
      const auto made = plan.cdr_to_someip(cdr, scratch);
      ASSERT_TRUE(made) << to_string(made.error());
      EXPECT_EQ(to_hex(joined(*made)), to_hex(one.payload));
      EXPECT_EQ(lost_text(plan.counters()), lost_text(one.lost));
    }
  }
}

// What came by a mapping goes back as it was: but for a field that is dropped and one that is constant.
TEST(MapVectors, ComeBackAsTheyWere) {
  MappedPlan there = plan_of(known("state"), MapDirection::to_ros);
  MappedPlan back = plan_of(known("state"), MapDirection::to_payload);
  MappedScratch scratch;
  MappedScratch other;
  for (const Vector& one : vectors()) {
    // The other ones have values beyond what a float32 can say.
    const std::string payload = to_hex(one.payload);
    if (one.direction != "to_payload" || one.mapping != "state") {
      continue;
    }
    SCOPED_TRACE(payload);
    const auto sample = there.someip_to_cdr(one.payload, received_at, scratch);
    ASSERT_TRUE(sample);
    const auto again = back.cdr_to_someip(joined(*sample), other);
    ASSERT_TRUE(again) << to_string(again.error());
    EXPECT_EQ(to_hex(joined(*again)), payload);
  }
}

TEST(MapVectors, AllocateNothingAfterTheFirstMessage) {
  MappedPlan there = plan_of(known("state"), MapDirection::to_ros);
  MappedPlan back = plan_of(known("state"), MapDirection::to_payload);
  MappedScratch scratch;
  MappedScratch other;
  const std::vector<Vector> all = vectors();
  const Vector& one = all[1];
  const auto convert = [&] {
    return there.someip_to_cdr(one.payload, received_at, scratch).has_value() &&
           back.cdr_to_someip(one.cdr[0], other).has_value();
  };
  for (int i = 0; i < 10; ++i) {  // until all is remembered that can be
    ASSERT_TRUE(convert());
  }
  const std::uint64_t before = allocations();
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(convert());
  }
  EXPECT_EQ(allocations(), before);
}

// Damaged messages are refused or become something; they are never read beyond their end, which the address
// sanitizer sees.
TEST(MapVectors, StandDamage) {
  MappedPlan plan = plan_of(known("state"), MapDirection::to_payload);
  MappedScratch scratch;
  std::minstd_rand random{29};
  std::size_t refused = 0;
  for (const Vector& one : vectors()) {
    if (one.mapping != "state") {
      continue;
    }
    for (int i = 0; i < 50; ++i) {
      std::vector<std::byte> cdr = one.cdr[static_cast<std::size_t>(i % 2)];
      cdr[random() % cdr.size()] = static_cast<std::byte>(random());
      if (i % 5 == 0) {
        cdr.resize(random() % cdr.size());
      }
      const std::vector<std::byte> exact{cdr.begin(), cdr.end()};
      refused += plan.cdr_to_someip(exact, scratch) ? 0 : 1;
    }
  }
  EXPECT_GT(refused, 100U);
}

}  // namespace
}  // namespace trestle::messages::map_vectors_test
