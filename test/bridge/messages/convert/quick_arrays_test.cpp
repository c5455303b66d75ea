// Arrays of numbers among few other fields: messages that are converted in one go, from their first field on.
#include <gmock/gmock.h>

#include "test/bridge/messages/convert/cdr_walk.hpp"
#include "test/bridge/messages/convert/profiles.hpp"
#include "test/bridge/messages/convert/random_message.hpp"
#include "test/bridge/messages/convert/type_rules.hpp"

namespace trestle::messages::quick_arrays_test {
namespace {

using namespace trestle::test;
using someip::FieldWidth;
using someip::PayloadRules;

/// With room in the scratch, as there is from the second message on, and without: the same in the end.
std::string someip_of(const ConversionPlan& plan, ByteView cdr) {
  const std::vector<std::byte> exact{cdr.begin(), cdr.end()};
  ConversionScratch scratch;
  scratch.reserve(4096);
  std::string result = shown(plan.cdr_to_someip(exact, scratch));
  EXPECT_EQ(to_someip(plan, cdr), result);
  return result;
}
std::string cdr_of(const ConversionPlan& plan, ByteView payload) {
  const std::vector<std::byte> exact{payload.begin(), payload.end()};
  ConversionScratch scratch;
  scratch.reserve(4096);
  std::string result = shown(plan.someip_to_cdr(exact, scratch));
  EXPECT_EQ(to_cdr(plan, payload), result);
  return result;
}

/// @param big_cdr  with the numbers of `cdr` in reverse order.
void expect_all_ways(const ConversionPlan& plan, std::string_view cdr, std::string_view big_cdr,
                     std::string_view payload) {
  EXPECT_EQ(someip_of(plan, hex(cdr)), compact(payload));
  EXPECT_EQ(someip_of(plan, hex(big_cdr)), compact(payload));
  EXPECT_EQ(cdr_of(plan, hex(payload)), compact(cdr));
}

constexpr const char* all_fields =
    "uint8 a\nstring b\nfloat32[] c\nuint16 d\nint64[] e\nuint16[<=3] f\nbool g";
constexpr std::string_view little_cdr =
    "00010000 01 000000 03000000 686900 00 03000000 0000803f 00000040 00004040 0302 0000"
    "01000000 00000000 0807060504030201 03000000 0201 0403 0605 01";
constexpr std::string_view big_cdr =
    "00000000 01 000000 00000003 686900 00 00000003 3f800000 40000000 40400000 0203 0000"
    "00000001 00000000 0102030405060708 00000003 0102 0304 0506 01";
constexpr std::string_view usual_payload =
    "01 00000006 efbbbf686900 0000000c 3f800000 40000000 40400000 0203 00000008 0102030405060708"
    "00000006 0102 0304 0506 01";

TEST(QuickArrays, AreConvertedUnderAnyRules) {
  const TypeTree tree = tree_of(all_fields);
  expect_all_ways(plan_of(tree), little_cdr, big_cdr, usual_payload);
  PayloadRules rules;
  rules.byte_order = std::endian::little;
  expect_all_ways(plan_of(tree, rules), little_cdr, big_cdr,
                  "01 00000006 efbbbf686900 0000000c 0000803f 00000040 00004040 0302 00000008"
                  "0807060504030201 00000006 0201 0403 0605 01");
  rules.length_fields_always_big = false;
  rules.string_bom = rules.string_terminator = false;
  expect_all_ways(plan_of(tree, rules), little_cdr, big_cdr,
                  "01 02000000 6869 0c000000 0000803f 00000040 00004040 0302 08000000 0807060504030201"
                  "06000000 0201 0403 0605 01");
  rules = {};
  rules.array_length = FieldWidth::bits8;
  expect_all_ways(plan_of(tree, rules), little_cdr, big_cdr,
                  "01 00000006 efbbbf686900 0c 3f800000 40000000 40400000 0203 08 0102030405060708"
                  "06 0102 0304 0506 01");
  rules.string_length = FieldWidth::bits8;
  rules.array_length = FieldWidth::bits16;
  rules.string_bom = false;
  expect_all_ways(plan_of(tree, rules), little_cdr, big_cdr,
                  "01 03 686900 000c 3f800000 40000000 40400000 0203 0008 0102030405060708"
                  "0006 0102 0304 0506 01");
  MessageRules orders;
  orders.types["test_msgs/msg/Test"].byte_orders = {{"c", std::endian::little}};
  expect_all_ways(plan(tree, orders), little_cdr, big_cdr,
                  "01 00000006 efbbbf686900 0000000c 0000803f 00000040 00004040 0203 00000008"
                  "0102030405060708 00000006 0102 0304 0506 01");
}

TEST(QuickArrays, MayBeEmpty) {
  expect_all_ways(plan_of(tree_of(all_fields)),
                  "00010000 01 000000 01000000 00 000000 00000000 0302 0000 00000000 00000000 01",
                  "00000000 01 000000 00000001 00 000000 00000000 0203 0000 00000000 00000000 01",
                  "01 00000004 efbbbf00 00000000 0203 00000000 00000000 01");
  // Behind the count of an empty one nothing is aligned to 8 bytes.
  expect_all_ways(plan_of(tree_of("int64[] a\nint64[] b\nuint8 c")), "00010000 00000000 00000000 01",
                  "00000000 00000000 00000000 01", "00000000 00000000 01");
  expect_all_ways(
      plan_of(tree_of("uint8 a\nint64[] b\nint64[] c\nint64[] d\nfloat64 e")),
      "00010000 01 000000 00000000 01000000 00000000 0807060504030201 00000000 00000000 000000000000f83f",
      "00000000 01 000000 00000000 00000001 00000000 0102030405060708 00000000 00000000 3ff8000000000000",
      "01 00000000 00000008 0102030405060708 00000000 3ff8000000000000");
  const TypeTree structs =
      trees({{"Part", "string a\nuint64 b"}, {"All", "uint8 a\nPart[] b\nuint8[] c\nuint16[] d"}});
  expect_all_ways(plan_of(structs), "00010000 01 000000 00000000 00000000 00000000",
                  "00000000 01 000000 00000000 00000000 00000000", "01 00000000 00000000 00000000");
}

TEST(QuickArrays, HaveElementsOfSeveralNumbers) {
  const TypeTree tree =
      trees({{"Point", "int16 x\nint16 y\nint16 z"}, {"All", "uint8 a\nPoint[] b\nuint8 c"}});
  expect_all_ways(plan_of(tree), "00010000 01 000000 02000000 0100 0200 0300 0400 0500 0600 07",
                  "00000000 01 000000 00000002 0001 0002 0003 0004 0005 0006 07",
                  "01 0000000c 0001 0002 0003 0004 0005 0006 07");
  EXPECT_EQ(cdr_of(plan_of(tree), hex("01 00000008 0001 0002 0003 0004 07")), "bad_length at byte 1 in b");
}

/// The fields whose bytes a message of `all_fields` may end in: where they end, and what is told of it then.
struct Cut {
  std::size_t end;
  std::string told;
};

TEST(QuickArrays, AreRefusedWhereverTheMessageEnds) {
  const auto plan = plan_of(tree_of(all_fields));
  const auto told = [](const std::vector<Cut>& cuts, std::size_t size) {
    return std::ranges::upper_bound(cuts, size, {}, &Cut::end)->told;
  };
  const std::vector<Cut> cdr_cuts{{4, "truncated at byte 0"},        {5, "truncated at byte 4 in a"},
                                  {15, "truncated at byte 5 in b"},  {32, "truncated at byte 15 in c"},
                                  {34, "truncated at byte 32 in d"}, {52, "truncated at byte 34 in e"},
                                  {62, "truncated at byte 52 in f"}, {63, "truncated at byte 62 in g"}};
  for (const std::string_view whole : {little_cdr, big_cdr}) {
    const auto cdr = hex(whole);
    ASSERT_EQ(cdr.size(), cdr_cuts.back().end);
    for (std::size_t size = 0; size < cdr.size(); ++size) {
      EXPECT_EQ(someip_of(plan, ByteView{cdr}.first(size)), told(cdr_cuts, size)) << size;
    }
  }
  const std::vector<Cut> cuts{{1, "truncated at byte 0 in a"},   {11, "truncated at byte 1 in b"},
                              {27, "truncated at byte 11 in c"}, {29, "truncated at byte 27 in d"},
                              {41, "truncated at byte 29 in e"}, {51, "truncated at byte 41 in f"},
                              {52, "truncated at byte 51 in g"}};
  const auto payload = hex(usual_payload);
  ASSERT_EQ(payload.size(), cuts.back().end);
  for (std::size_t size = 0; size < payload.size(); ++size) {
    EXPECT_EQ(cdr_of(plan, ByteView{payload}.first(size)), told(cuts, size)) << size;
  }
}

TEST(QuickArrays, AreRefusedWithMoreThanTheyMayHave) {
  const TypeTree tree = tree_of("uint8 a\nuint16[<=3] b\nfloat32[] c");
  PayloadRules strict;
  strict.cut_longer_arrays = false;
  const auto cdr = hex("00010000 01 000000 04000000 0100 0200 0300 0400 00000000");
  const auto payload = hex("01 00000008 0001 0002 0003 0004 00000000");
  EXPECT_EQ(someip_of(plan_of(tree), cdr), "bound_exceeded at byte 5 in b");
  EXPECT_EQ(cdr_of(plan_of(tree, strict), payload), "bound_exceeded at byte 1 in b");
  EXPECT_EQ(cdr_of(plan_of(tree), payload),
            compact("00010000 01 000000 03000000 0100 0200 0300 0000 00000000"));
  EXPECT_EQ(cdr_of(plan_of(tree), hex("01 00000005 0001 0002 00 00000000")), "bad_length at byte 1 in b");
  // As many as there are, or a few less than that, but for what a count of 32 bits can say.
  for (const char* const count : {"05000000", "ffffffff", "00000040", "00000080"}) {
    EXPECT_EQ(someip_of(plan_of(tree), hex("00010000 01 000000 00000000" + std::string{count} + "00000000")),
              "truncated at byte 12 in c");
  }
  for (const char* const length : {"00000005", "ffffffff", "80000000", "fffffffc"}) {
    EXPECT_EQ(cdr_of(plan_of(tree), hex("01 00000000" + std::string{length} + "00000000")),
              "truncated at byte 5 in c");
  }
}

TEST(QuickArrays, AreRefusedWhereTheirLengthFieldIsTooShort) {
  for (const auto& [width, most] :
       {std::pair{FieldWidth::bits8, 63U}, std::pair{FieldWidth::bits16, 16383U}}) {
    PayloadRules rules;
    rules.array_length = width;
    const auto plan = plan_of(tree_of("uint8 a\nfloat32[] b"), rules);
    ConversionScratch scratch;
    scratch.reserve(1U << 17U);
    for (const std::size_t count : {most, most + 1}) {
      auto cdr = hex("00010000 01 000000");
      for (unsigned shift = 0; shift < 32; shift += 8) {
        cdr.push_back(static_cast<std::byte>(count >> shift));
      }
      cdr.resize(cdr.size() + 4 * count, std::byte{0x5a});
      const auto result = plan.cdr_to_someip(cdr, scratch);
      if (count == most) {
        ASSERT_TRUE(result);
        EXPECT_EQ(result->bytes, 1 + bytes(width) + 4 * count);
        const auto payload = joined(*result);
        EXPECT_EQ(shown(plan.someip_to_cdr(payload, scratch)), to_hex(cdr));
      } else {
        ASSERT_FALSE(result);
        EXPECT_EQ(place_of(result.error()), "length_overflow at byte 5 in b");
      }
    }
  }
}

TEST(QuickArrays, MayBeFollowedByPadding) {
  const auto plan = plan_of(tree_of("float32[] a\nuint8 b"));
  const std::string cdr = "00010000 01000000 0000803f 05";
  const std::string payload = compact("00000004 3f800000 05");
  EXPECT_EQ(someip_of(plan, hex(cdr + "0000ff")), payload);
  EXPECT_EQ(someip_of(plan, hex(cdr + "00000000")), "trailing_bytes at byte 13");
  EXPECT_EQ(cdr_of(plan, hex(payload + "ffffffffff")), compact(cdr));
  // Of these an estimate of the size may be too long.
  EXPECT_EQ(someip_of(plan_of(tree_of("float64[] a\nuint8 b")), hex("00010000 00000000 05 000000 00000000")),
            compact("00000000 05"));
}

// Texts and elements that are not quick, in front of arrays and behind them.
TEST(QuickArrays, GoOnWhereSomethingElseStandsBetweenThem) {
  const TypeTree tree = trees({{"Part", "uint8 a\nuint8[] b"},
                               {"All", "uint16 a\nfloat32[] b\nPart[] c\nuint16[] d\nuint8 e\nuint8 f"}});
  const auto plan = plan_of(tree);
  constexpr std::string_view cdr =
      "00010000 0100 0000 01000000 0000803f 02000000 07 000000 02000000 0809 0a 00 00000000"
      "02000000 0300 0400 05 06";
  constexpr std::string_view big_cdr =
      "00000000 0001 0000 00000001 3f800000 00000002 07 000000 00000002 0809 0a 00 00000000"
      "00000002 0003 0004 05 06";
  expect_all_ways(plan, cdr, big_cdr,
                  "0001 00000004 3f800000 0000000c 07 00000002 0809 0a 00000000 00000004 0003 0004 05 06");
  EXPECT_EQ(cdr_of(plan, hex("0001 00000004 3f800000 0000000c 07 00000002 0809 0a 00000001 00000000")),
            "truncated at byte 22 in c[1].b");
  auto bad = hex(cdr);
  bad.resize(bad.size() - 3);
  EXPECT_EQ(someip_of(plan, bad), "truncated at byte 36 in d");
  const auto text = plan_of(tree_of("string a\nuint16[] b\nuint8[] c"));
  const std::string letters(140, '6');  // 70 characters
  expect_all_ways(text, "00010000 47000000" + letters + "00 00 01000000 0201 0000 02000000 0304",
                  "00000000 00000047" + letters + "00 00 00000001 0102 0000 00000002 0304",
                  "0000004a efbbbf" + letters + "00 00000002 0102 00000002 0304");
}

TEST(QuickArrays, NeedNoRoomInAdvance) {
  const auto plan = plan_of(tree_of(all_fields));
  const auto cdr = hex(little_cdr);
  const auto payload = hex(usual_payload);
  for (std::size_t room = 0; room < 2 * cdr.size(); ++room) {
    ConversionScratch out;
    out.reserve(room);
    EXPECT_EQ(shown(plan.cdr_to_someip(cdr, out)), to_hex(payload)) << room;
    ConversionScratch back;
    back.reserve(room);
    EXPECT_EQ(shown(plan.someip_to_cdr(payload, back)), to_hex(cdr)) << room;
  }
}

TEST(QuickArrays, AreReferencedIfTheirBytesStayAndAreMany) {
  constexpr std::size_t least = 64;
  PayloadRules little;
  little.byte_order = std::endian::little;
  const TypeTree tree = tree_of("uint8 a\nfloat32[] b\nuint16 c\nuint32[] d");
  for (const std::uint8_t count : {std::uint8_t{15}, std::uint8_t{16}}) {
    auto cdr = hex("00010000 01 000000");
    for (const char* const next : {"", "0100 0000"}) {
      const auto between = hex(next);
      cdr.insert(cdr.end(), between.begin(), between.end());
      cdr.insert(cdr.end(), {std::byte{count}, std::byte{0}, std::byte{0}, std::byte{0}});
      cdr.resize(cdr.size() + std::size_t{4} * count, std::byte{0x5a});
    }
    for (const bool stay : {true, false}) {
      const auto plan = plan_of(tree, stay ? little : PayloadRules{}, least);
      ConversionScratch scratch;
      scratch.reserve(4096);
      const auto payload = plan.cdr_to_someip(cdr, scratch);
      ASSERT_TRUE(payload);
      const std::size_t slices = stay && std::size_t{4} * count >= least ? 4 : 1;
      EXPECT_EQ(payload->slices.size(), slices);
      const auto bytes = joined(*payload);
      EXPECT_EQ(to_hex(bytes), to_hex(written_by_payload_writer(tree, cdr, plan.program().rules)));
      const auto back = plan.someip_to_cdr(bytes, scratch);
      ASSERT_TRUE(back);
      EXPECT_EQ(back->slices.size(), slices);
      EXPECT_EQ(joined(*back), cdr);
    }
  }
}

// One after another with the same scratch, whatever came before.
TEST(QuickArrays, AreConvertedAsBothLibrariesDo) {
  std::minstd_rand random{7};
  std::vector<TypeTree> types{
      tree_of(all_fields), tree_of("float32[] a\nstring b\nfloat64[] c"),
      trees({{"Part", "float64[] a\nuint8 b\nint16[] c"}, {"All", "uint8 a\nPart[] b\nuint64[] c\nPart d"}})};
  for (const char* const type :
       {"sensor_msgs/LaserScan", "std_msgs/Float32MultiArray", "std_msgs/Int64MultiArray",
        "std_msgs/UInt8MultiArray", "sensor_msgs/JointState", "sensor_msgs/BatteryState", "sensor_msgs/Joy",
        "sensor_msgs/MultiEchoLaserScan", "geometry_msgs/Polygon", "geometry_msgs/PoseArray",
        "sensor_msgs/CameraInfo", "trajectory_msgs/JointTrajectory"}) {
    types.push_back(builtin(type));
  }
  for (const TypeTree& tree : types) {
    SCOPED_TRACE(tree.root().name);
    for (const char* const name :
         {"", "autosar", "little", "commonapi_little", "legacy_strings", "aligned4", "utf16le"}) {
      SCOPED_TRACE(name);
      const PayloadRules rules = *name == '\0' ? PayloadRules{} : profile(name);
      const auto plan = plan_of(tree, rules, 256);
      ConversionScratch out;
      ConversionScratch back;
      for (unsigned turn = 0; turn < 30; ++turn) {
        const auto order = turn % 4 == 0 ? std::endian::big : std::endian::little;
        const RandomSizes sizes{.elements = turn % 5 == 0 ? 60U : 4U, .text = turn % 7 == 0 ? 100U : 20U};
        const auto form = static_cast<unsigned>(turn % 3 == 0 ? random() : 1);
        const auto sample =
            RandomMessage{tree, order, form, static_cast<unsigned>(random()), rules, sizes}.bytes();
        const auto payload = plan.cdr_to_someip(sample, out);
        ASSERT_TRUE(payload) << to_string(payload.error());
        auto bytes = joined(*payload);
        ASSERT_EQ(to_hex(bytes), to_hex(written_by_payload_writer(tree, sample, rules)));
        ASSERT_EQ(shown(plan.someip_to_cdr(bytes, back)),
                  to_hex(rewritten_by_fastcdr(tree, sample, std::endian::native)));
        // The rest of it, or something else.
        bytes.resize(random() % (bytes.size() + 1));
        if (!bytes.empty()) {
          bytes[random() % bytes.size()] ^= static_cast<std::byte>(1U << random() % 8);
        }
        ASSERT_EQ(shown(plan.someip_to_cdr(bytes, back)), to_cdr(plan, bytes));
        auto spoilt = sample;
        spoilt[4 + random() % (spoilt.size() - 4)] ^= static_cast<std::byte>(1U << random() % 8);
        spoilt.resize(spoilt.size() - random() % 9);
        ASSERT_EQ(shown(plan.cdr_to_someip(spoilt, out)), to_someip(plan, spoilt));
      }
    }
  }
}

// Others are quicker compared with the message before, as most of what they have is the same.
TEST(QuickArrays, BeginTheMessageWhereItHasLittleElse) {
  const auto begins_with_loop = [](const TypeTree& tree, const PayloadRules& rules = {}) {
    const Program program = plan_of(tree, rules).program();
    return program.ops[0].loop != Op::Loop::no && program.quick.arrays && !program.quick.front;
  };
  EXPECT_TRUE(begins_with_loop(builtin("sensor_msgs/LaserScan")));
  EXPECT_TRUE(begins_with_loop(builtin("sensor_msgs/LaserScan"), profile("legacy_strings")));
  EXPECT_TRUE(begins_with_loop(builtin("std_msgs/Float32MultiArray")));
  EXPECT_TRUE(begins_with_loop(builtin("geometry_msgs/Polygon")));
  for (const char* const other : {"autosar", "aligned4", "utf16le"}) {
    EXPECT_FALSE(begins_with_loop(builtin("sensor_msgs/LaserScan"), profile(other))) << other;
  }
  for (const char* const other : {"sensor_msgs/JointState", "sensor_msgs/BatteryState", "sensor_msgs/Image",
                                  "tf2_msgs/TFMessage", "sensor_msgs/CameraInfo"}) {
    EXPECT_FALSE(begins_with_loop(builtin(other))) << other;
  }
}

}  // namespace
}  // namespace trestle::messages::quick_arrays_test
