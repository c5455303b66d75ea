#include "bridge/inspect/decode/left_over.hpp"

#include <gtest/gtest.h>

#include "test/bytes.hpp"
#include "test/covers.hpp"

namespace trestle::inspect::left_over_test {
namespace {

using describe::Kind;
using describe::Payload;
using describe::Type;
using describe::TypeIndex;
using describe::Value;
using test::covers;
using test::hex;

constexpr TypeIndex number{0};
constexpr TypeIndex text{1};
constexpr TypeIndex list{2};
constexpr TypeIndex tagged{3};

Value value(const char* name, TypeIndex type, const Type& what) {
  return {.name = name, .type = type, .wire = what.wire};
}

Value with_tag(Value value, std::uint16_t tag, bool optional = false) {
  value.tag = someip::DataId{tag};
  value.optional = optional;
  return value;
}

/// A service with one event.
describe::Interfaces with(Payload payload, describe::Protection e2e = {}) {
  describe::Reading reading;
  const auto length = [](Kind kind) { return describe::default_wire(kind); };
  std::vector<Type>& types = reading.model.types;
  types = {{.kind = Kind::primitive},
           {.kind = Kind::string, .wire = length(Kind::string)},
           {.kind = Kind::array, .wire = length(Kind::array), .element = value("", number, {})},
           {.kind = Kind::structure, .name = "Tagged", .scope = "car"}};
  types[3].wire.length = someip::FieldWidth::bits32;
  types[3].members = {with_tag(value("a", number, types[0]), 1),
                      with_tag(value("list", list, types[2]), 2, true)};
  for (Value& one : payload.values) {
    one.wire = types[static_cast<std::size_t>(one.type)].wire;
  }
  reading.model.services = {{.name = "Door", .scope = "car", .id = someip::ServiceId{0x1234}}};
  reading.model.services[0].events = {{.name = "moved",
                                       .id = someip::MethodId{0x8001},
                                       .payload = std::move(payload),
                                       .eventgroups = {someip::EventgroupId{1}},
                                       .e2e = std::move(e2e)},
                                      {.name = "other",
                                       .id = someip::MethodId{0x8002},
                                       .payload = {.values = {value("a", number, types[0])}}}};
  describe::IdLock lock;
  describe::System system = describe::make_system(std::move(reading), lock);
  EXPECT_TRUE(system.good) << (system.problems.empty() ? "" : system.problems.front().text);
  return describe::Interfaces{std::move(system)};
}

std::string behind(const describe::Interfaces& interfaces, const std::string& payload,
                   bool has_header = true) {
  const describe::ServiceElement* const moved =
      interfaces.element(someip::ServiceId{0x1234}, 1, someip::MethodId{0x8001});
  const describe::Content& content = interfaces.content(*moved);
  EXPECT_EQ(content.unknown, "");
  const auto found = left_over(interfaces, *moved, content, hex(payload), has_header);
  return found ? to_string(*found) : "";
}

TEST(LeftOver, IsWhatStandsBehindTheLastValue) {
  covers({"feat_req_someip_168"});
  const describe::Interfaces door =
      with({.values = {{.name = "a", .type = number}, {.name = "b", .type = text}}});
  const std::string whole = "07 00000006 efbbbf 6162 00";
  EXPECT_EQ(behind(door, whole), "");
  EXPECT_EQ(behind(door, whole + "00"), "1 byte left over at offset 11");
  EXPECT_EQ(behind(door, whole + "0102030405060708090a"), "10 bytes left over at offset 11");
  EXPECT_EQ(behind(door, "07 00000006 efbbbf"), "") << "what is too short has another fault";
  EXPECT_EQ(behind(door, ""), "");
}

TEST(LeftOver, IsAllWhereThereAreNoValues) {
  EXPECT_EQ(behind(with({}), ""), "");
  EXPECT_EQ(behind(with({}), "0102"), "2 bytes left over at offset 0");
}

TEST(LeftOver, CountsFromTheStartOfThePayloadWithItsE2eHeader) {
  const describe::Interfaces door = with({.values = {{.name = "a", .type = number}}},
                                         {.profile = "5", .numbers = {{"data_id", 1}, {"data_bits", 160}}});
  EXPECT_EQ(behind(door, "aabbcc 07"), "");
  EXPECT_EQ(behind(door, "aabbcc 07 0102"), "2 bytes left over at offset 4");
  EXPECT_EQ(behind(door, "07 0102", false), "2 bytes left over at offset 1") << "where it was taken off";
}

TEST(LeftOver, IsNotAValueThatMightBeMissing) {
  // By an optional array, the rules let fields be missing at the end. A zero is what such a field would be.
  const describe::Interfaces door =
      with({.values = {{.name = "it", .type = tagged}, {.name = "end", .type = number}}});
  const std::string without_list = "00000003 0001 07";
  EXPECT_EQ(behind(door, without_list + "00"), "");
  EXPECT_EQ(behind(door, without_list + "00 ff"), "1 byte left over at offset 8");
  EXPECT_EQ(behind(door, "0000000c 0001 07 7002 00000003 010203 00"), "");
  EXPECT_EQ(behind(door, "0000000c 0001 07 7002 00000003 010203 00 00"), "1 byte left over at offset 17");
}

TEST(LeftOver, IsNotPadding) {
  const describe::Interfaces door = with({.values = {{.name = "b", .type = text}}, .alignment = 4});
  const std::string whole = "00000006 efbbbf 6162 00";
  EXPECT_EQ(behind(door, whole), "") << "not all senders pad the last value";
  EXPECT_EQ(behind(door, whole + "0000"), "");
  EXPECT_EQ(behind(door, whole + "0000 01"), "1 byte left over at offset 12");
}

}  // namespace
}  // namespace trestle::inspect::left_over_test
