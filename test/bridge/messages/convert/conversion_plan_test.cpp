// What is refused and how it is named, what is referenced, and that nothing is allocated.
#include <gmock/gmock.h>

#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>

#include "bridge/messages/convert/check_type.hpp"
#include "test/allocations.hpp"
#include "test/bridge/messages/convert/support.hpp"
#include "test/covers.hpp"
#include "test/source_dir.hpp"

namespace trestle::messages::conversion_plan_test {
namespace {

using namespace trestle::test;
using someip::FieldWidth;
using someip::PayloadRules;
using someip::StringEncoding;
using testing::HasSubstr;

std::string compile_error(const TypeTree& tree, const PayloadRules& rules = {}) {
  const auto plan = ConversionPlan::compile(tree, rules);
  return plan ? "no error" : plan.error();
}

// Errors of the sample

TEST(CdrToSomeip, RefusesOtherEncapsulations) {
  const auto plan = plan_of(tree_of("uint8 x"));
  EXPECT_EQ(to_someip(plan, "00010000 05"), "05");
  EXPECT_EQ(to_someip(plan, "00000000 05"), "05");
  EXPECT_EQ(to_someip(plan, "00010003 05000000"),
            "05");  // Cyclone says in the options how much padding there is
  for (const char* kind : {"0002", "0003", "0006", "0007", "000a", "0100", "ffff"}) {
    EXPECT_EQ(to_someip(plan, std::string{kind} + "0000 05"), "bad_encapsulation at byte 0") << kind;
  }
  EXPECT_EQ(to_someip(plan, ""), "truncated at byte 0");
  EXPECT_EQ(to_someip(plan, "000100"), "truncated at byte 0");
  EXPECT_EQ(to_someip(plan, "00010000"), "truncated at byte 4 in x");
}

TEST(CdrToSomeip, AcceptsPaddingAtTheEndButNotAWholeWord) {
  const auto plan = plan_of(tree_of("uint8 x"));
  EXPECT_EQ(to_someip(plan, "00010000 05 0000ff"), "05");
  EXPECT_EQ(to_someip(plan, "00010000 05 00000000"), "trailing_bytes at byte 5");
}

TEST(CdrToSomeip, AcceptsTheEstimatedSizesOfRos) {
  // rclpy.serialization.serialize_message() of a sensor_msgs/JointState: name "c", position [1.0, 2.0],
  // velocity and effort empty. The message ends 4 bytes before the sample does.
  const auto plan = plan_of(builtin("sensor_msgs/JointState"), someip::commonapi_rules);
  EXPECT_EQ(to_someip(plan,
                      "00010000 00000000 00000000 01000000 00000000 01000000 02000000 63000000 02000000"
                      "000000000000f03f 0000000000000040 00000000 00000000 00000000"),
            compact("00000000 00000000 00000004 efbbbf00 00000009 00000005 efbbbf6300"
                    "00000010 3ff0000000000000 4000000000000000 00000000 00000000"));
  // A std_msgs/String with a wstring in its place: "a", and room for a terminator.
  EXPECT_EQ(to_someip(plan_of(tree_of("wstring a"), someip::commonapi_rules),
                      "00010000 01000000 61000000 00000000"),
            compact("00000006 feff 0061 0000"));
  // Without such a member the size is exact.
  EXPECT_EQ(to_someip(plan_of(tree_of("int64 a\nfloat32[] b\nint64[2] c")),
                      "00010000 0000000000000000 00000000 00000000"
                      "0000000000000000 0000000000000000 00000000"),
            "trailing_bytes at byte 36");
}

TEST(CdrToSomeip, RefusesBoolsThatAreNeither) {
  covers({"feat_req_someip_817"});
  EXPECT_EQ(to_someip(plan_of(tree_of("bool a\nbool b")), "00010000 01 02"), "bad_bool at byte 5 in b");
  EXPECT_EQ(to_someip(plan_of(tree_of("bool[] a")), "00010000 03000000 0100ff"),
            "bad_bool at byte 10 in a[2]");
  EXPECT_EQ(to_someip(plan_of(tree_of("bool[3] a\nbool[2] b")), "00010000 010001 00 07"),
            "bad_bool at byte 8 in b[1]");
}

TEST(CdrToSomeip, RefusesStringsWithoutTerminator) {
  const auto plan = plan_of(tree_of("uint8 a\nstring s"));
  EXPECT_EQ(to_someip(plan, "00010000 01 000000 02000000 6869"), "bad_string at byte 5 in s");
  EXPECT_EQ(to_someip(plan, "00010000 01 000000 00000000"),
            compact("01 00000004 efbbbf 00"));  // empty, without
}

TEST(CdrToSomeip, RefusesZerosWithinStringsThatAZeroEnds) {
  EXPECT_EQ(to_someip(plan_of(tree_of("string s")), "00010000 04000000 61006200"),
            "bad_string at byte 4 in s");
  EXPECT_EQ(to_someip(plan_of(tree_of("wstring s")), "00010000 02000000 41000000 00000000"),
            "bad_string at byte 12 in s");
  PayloadRules rules;
  rules.string_terminator = false;
  const auto plan = plan_of(tree_of("string s"), rules);
  EXPECT_EQ(to_someip(plan, "00010000 04000000 61006200"), compact("00000006 efbbbf 610062"));
  EXPECT_EQ(to_cdr(plan, "00000006 efbbbf 610062"), compact("00010000 04000000 61006200"));
}

TEST(CdrToSomeip, EnforcesBounds) {
  const auto string = plan_of(tree_of("string<=2 s"));
  EXPECT_EQ(to_someip(string, "00010000 03000000 686900"), compact("00000006 efbbbf686900"));
  EXPECT_EQ(to_someip(string, "00010000 04000000 68696a00"), "bound_exceeded at byte 4 in s");
  const auto wide = plan_of(tree_of("wstring<=1 s"));
  EXPECT_EQ(to_someip(wide, "00010000 01000000 41000000"), compact("00000006 feff 0041 0000"));
  EXPECT_EQ(to_someip(wide, "00010000 02000000 41000000 41000000"), "bound_exceeded at byte 4 in s");
  const auto numbers = plan_of(tree_of("uint16[<=2] n"));
  EXPECT_EQ(to_someip(numbers, "00010000 02000000 01000200"), compact("00000004 00010002"));
  EXPECT_EQ(to_someip(numbers, "00010000 03000000 010002000300"), "bound_exceeded at byte 4 in n");
  const auto strings = plan_of(tree_of("string[<=1] n"));
  EXPECT_EQ(to_someip(strings, "00010000 02000000 01000000 00000000 01000000 00"),
            "bound_exceeded at byte 4 in n");
}

TEST(CdrToSomeip, RefusesHugeCountsBeforeAnyWork) {
  for (const char* msg : {"uint8[] x", "bool[] x", "float64[] x", "string[] x", "wstring x", "string x"}) {
    for (const char* count : {"ffffffff", "00000080", "01000000"}) {
      SCOPED_TRACE(std::string{msg} + " " + count);
      ConversionScratch scratch;
      const auto plan = plan_of(tree_of(msg));
      const auto sample = hex(std::string{"00010000"} + count);
      const auto result = plan.cdr_to_someip(sample, scratch);
      ASSERT_FALSE(result);
      EXPECT_EQ(place_of(result.error()), "truncated at byte 4 in x");
    }
  }
  EXPECT_EQ(to_someip(plan_of(tree_of("float64[100000000] x")), "00010000"), "truncated at byte 4 in x[0]");
  EXPECT_EQ(to_someip(plan_of(tree_of("string[100000000] x")), "00010000 01000000"),
            "truncated at byte 4 in x");
}

TEST(CdrToSomeip, RefusesWhatALengthFieldCannotSay) {
  PayloadRules rules;
  rules.array_length = rules.string_length = rules.struct_length = FieldWidth::bits8;
  rules.fixed_array_length = FieldWidth::bits8;
  const std::string bytes256(512, '0');
  const std::string bytes255(510, '0');
  EXPECT_EQ(to_someip(plan_of(tree_of("uint8[] x"), rules), "00010000 00010000" + bytes256),
            "length_overflow at byte 4 in x");
  rules.struct_length = FieldWidth::none;
  EXPECT_EQ(to_someip(plan_of(tree_of("uint8[] x"), rules), "00010000 ff000000" + bytes255), "ff" + bytes255);
  EXPECT_EQ(to_someip(plan_of(tree_of("uint8[256] x"), rules), "00010000" + bytes256),
            "length_overflow at byte 4 in x");
  EXPECT_EQ(to_someip(plan_of(tree_of("uint8[255] x"), rules), "00010000" + bytes255), "ff" + bytes255);
  // 251 characters, 3 of BOM and 1 of terminator are 255.
  std::string text;
  for (int i = 0; i < 251; ++i) {
    text += "61";
  }
  EXPECT_EQ(to_someip(plan_of(tree_of("string x"), rules), "00010000 fc000000" + text + "00"),
            "ffefbbbf" + text + "00");
  EXPECT_EQ(to_someip(plan_of(tree_of("string x"), rules), "00010000 fd000000" + text + "6100"),
            "length_overflow at byte 4 in x");
  std::string wide_text;  // 128 units of 2 bytes
  for (int i = 0; i < 128; ++i) {
    wide_text += "61000000";
  }
  EXPECT_EQ(to_someip(plan_of(tree_of("wstring x"), rules), "00010000 80000000" + wide_text),
            "length_overflow at byte 4 in x");
  rules.string_encoding = StringEncoding::utf16be;
  EXPECT_EQ(to_someip(plan_of(tree_of("string x"), rules), "00010000 fd000000" + text + "6100"),
            "length_overflow at byte 4 in x");
  // A struct's own field can be too narrow for what its members may say.
  rules.struct_length = FieldWidth::bits8;
  rules.array_length = FieldWidth::bits32;
  EXPECT_EQ(to_someip(plan_of(tree_of("uint8[] x"), rules), "00010000 00010000" + bytes256),
            "length_overflow at byte 4");
}

TEST(CdrToSomeip, ConvertsOnlyValidUtf8ToUtf16) {
  PayloadRules rules;
  rules.string_encoding = StringEncoding::utf16be;
  const auto plan = plan_of(tree_of("string x"), rules);
  // U+1F600 is a pair of surrogates, and the first and last characters of each length survive.
  EXPECT_EQ(to_someip(plan, "00010000 05000000 f09f9880 00"), compact("00000008 feff d83dde00 0000"));
  EXPECT_EQ(
      to_someip(plan, "00010000 1b000000 01 7f c280 dfbf e0a080 ed9fbf ee8080 efbfbf f0908080 f48fbfbf 00"),
      compact("0000001c feff 0001 007f 0080 07ff 0800 d7ff e000 ffff d800dc00 dbffdfff 0000"));
  for (const char* bad : {"80", "c2", "c0af", "e08080", "eda080", "edbfbf", "f08080af", "f4908080",
                          "f8888080", "ff", "e282", "c241"}) {
    const std::size_t size = std::string_view{bad}.size() / 2 + 1;
    EXPECT_EQ(to_someip(plan, "00010000 0" + std::to_string(size) + "000000" + bad + "00"),
              "bad_encoding at byte 4 in x")
        << bad;
  }
  // Where UTF-8 stays UTF-8 nothing is judged: DDS carries any bytes, and so does the SOME/IP side.
  EXPECT_EQ(to_someip(plan_of(tree_of("string x")), "00010000 02000000 ff00"),
            compact("00000005 efbbbf ff 00"));
}

// Receivers would end the text there.
TEST(Conversion, RefusesAZeroAnywhereInAString) {
  const auto plan = plan_of(tree_of("string s"));
  PayloadRules without_terminator;
  without_terminator.string_terminator = false;
  const auto lenient = plan_of(tree_of("string s"), without_terminator);
  for (std::size_t size = 1; size < 80; ++size) {
    const auto bytes = [size](std::string_view front, std::string_view back, std::size_t zero_at) {
      auto all = hex(front);
      all.resize(all.size() + size, std::byte{'x'});
      all[all.size() - size + zero_at] = std::byte{0};
      const auto end = hex(back);
      all.insert(all.end(), end.begin(), end.end());
      return all;
    };
    const auto little = [](std::size_t number) {
      return to_hex(std::array{static_cast<std::byte>(number)}) + "000000";
    };
    const auto big = [](std::size_t number) {
      return "000000" + to_hex(std::array{static_cast<std::byte>(number)});
    };
    for (std::size_t at = 0; at < size; ++at) {
      const auto sample = bytes("00010000" + little(size + 1), "00", at);
      EXPECT_EQ(to_someip(plan, sample), "bad_string at byte 4 in s") << size << ' ' << at;
      EXPECT_EQ(to_someip(lenient, sample), to_hex(bytes(big(size + 3) + "efbbbf", "", at)));
      EXPECT_EQ(to_cdr(lenient, bytes(big(size + 3) + "efbbbf", "", at)), to_hex(sample));
      if (at + 1 < size) {  // behind it only zeros may follow
        EXPECT_EQ(to_cdr(plan, bytes(big(size + 4) + "efbbbf", "00", at)), "bad_string at byte 0 in s");
      }
    }
  }
}

TEST(CdrToSomeip, RefusesWideCharactersBeyondUtf16) {
  EXPECT_EQ(to_someip(plan_of(tree_of("wstring x")), "00010000 02000000 41000000 00000100"),
            "bad_encoding at byte 12 in x");
}

TEST(CdrToSomeip, RefusesInputsBeyondTheLimit) {
  ConversionScratch scratch;
  const std::byte one{};
  const auto result = plan_of(tree_of("uint8 x")).cdr_to_someip({&one, max_converted_bytes + 1}, scratch);
  ASSERT_FALSE(result);
  EXPECT_EQ(place_of(result.error()), "too_large at byte 0");
  const auto back = plan_of(tree_of("uint8 x")).someip_to_cdr({&one, max_converted_bytes + 1}, scratch);
  ASSERT_FALSE(back);
  EXPECT_EQ(place_of(back.error()), "too_large at byte 0");
}

// Errors of the payload

TEST(SomeipToCdr, IgnoresWhatFollowsTheLastField) {
  covers({"feat_req_someip_168"});
  EXPECT_EQ(to_cdr(plan_of(tree_of("uint8 x")), "05 ffffffffff"), compact("00010000 05"));
}

TEST(SomeipToCdr, EnforcesBounds) {
  const auto string = plan_of(tree_of("string<=2 s"));
  EXPECT_EQ(to_cdr(string, "00000006 efbbbf686900"), compact("00010000 03000000 686900"));
  EXPECT_EQ(to_cdr(string, "00000007 efbbbf68696a00"), "bound_exceeded at byte 0 in s");
  EXPECT_EQ(to_cdr(plan_of(tree_of("wstring<=1 s")), "00000008 feff 0041 0041 0000"),
            "bound_exceeded at byte 0 in s");
  PayloadRules rules;
  rules.cut_longer_arrays = false;
  EXPECT_EQ(to_cdr(plan_of(tree_of("uint16[<=2] n"), rules), "00000006 000100020003"),
            "bound_exceeded at byte 0 in n");
  EXPECT_EQ(to_cdr(plan_of(tree_of("string[<=1] n"), rules), "00000010 00000004efbbbf00 00000004efbbbf00"),
            "bound_exceeded at byte 0 in n");
  rules = {};
  rules.string_encoding = StringEncoding::utf16be;  // the bound counts what a string has in DDS: bytes
  EXPECT_EQ(to_cdr(plan_of(tree_of("string<=2 s"), rules), "00000006 feff 20ac 0000"),
            "bound_exceeded at byte 0 in s");
}

TEST(SomeipToCdr, CutsLongerArrays) {
  covers({"feat_req_someipcompat_1199"});
  const auto numbers = plan_of(tree_of("uint16[<=2] n\nuint8 after"));
  EXPECT_EQ(to_cdr(numbers, "00000006 000100020003 09"), compact("00010000 02000000 01000200 09"));
  EXPECT_EQ(to_cdr(numbers, "00000005 0001000200 09"), compact("00010000 02000000 01000200 09"));
  EXPECT_EQ(to_cdr(numbers, "00000003 000100 09"), "bad_length at byte 0 in n") << "not too long";
  EXPECT_EQ(to_cdr(plan_of(tree_of("bool[<=1] n\nuint8 after")), "00000003 010000 09"),
            compact("00010000 01000000 01 09"));
  // What is cut off is not looked at: the second string has no BOM.
  EXPECT_EQ(
      to_cdr(plan_of(tree_of("string[<=1] n\nuint8 after")), "0000000f 00000004efbbbf00 00000003616263 09"),
      compact("00010000 01000000 01000000 00 09"));
  PayloadRules rules;
  rules.fixed_array_length = FieldWidth::bits8;
  EXPECT_EQ(to_cdr(plan_of(tree_of("uint16[2] n\nuint8 after"), rules), "06 000100020003 09"),
            compact("00010000 01000200 09"));
}

TEST(SomeipToCdr, RefusesLengthsThatContradictTheirContents) {
  PayloadRules rules;
  rules.cut_longer_arrays = false;
  rules.fixed_array_length = FieldWidth::bits8;
  const auto fixed = plan_of(tree_of("uint16[2] n"), rules);
  EXPECT_EQ(to_cdr(fixed, "04 0001 0002"), compact("00010000 01000200"));
  EXPECT_EQ(to_cdr(fixed, "03 0001 0002"), "truncated at byte 3 in n[1]");
  EXPECT_EQ(to_cdr(fixed, "05 0001 0002 00"), "bad_length at byte 0 in n");
  EXPECT_EQ(to_cdr(fixed, "06 0001 0002 00"), "truncated at byte 0 in n");
  const auto strings = plan_of(tree_of("string[] n"));
  EXPECT_EQ(to_cdr(strings, "00000009 00000004efbbbf00 00"), "truncated at byte 12 in n[1]");
  EXPECT_EQ(to_cdr(strings, "00000007 00000004efbbbf00"), "truncated at byte 4 in n[0]");
  EXPECT_EQ(to_cdr(strings, "ffffffff 00000004efbbbf00"), "truncated at byte 0 in n");
  EXPECT_EQ(to_cdr(plan_of(tree_of("float64[100000000] x")), ""), "truncated at byte 0 in x[0]");
  EXPECT_EQ(to_cdr(plan_of(tree_of("string[100000000] x")), "00000004"), "truncated at byte 0 in x");
}

TEST(SomeipToCdr, AcceptsZerosBehindTheTerminator) {
  covers({"feat_req_someip_639", "feat_req_someip_239"});
  const auto plan = plan_of(tree_of("string s\nuint8 x"));
  EXPECT_EQ(to_cdr(plan, "00000008 efbbbf 6869 000000 05"), compact("00010000 03000000 686900 05"));
  EXPECT_EQ(to_cdr(plan, "00000008 efbbbf 6869 006a00 05"), "bad_string at byte 0 in s");
  const auto wide = plan_of(tree_of("wstring s\nuint8 x"));
  EXPECT_EQ(to_cdr(wide, "00000008 feff 0041 00000000 05"), compact("00010000 01000000 41000000 05"));
  EXPECT_EQ(to_cdr(wide, "00000008 feff 0041 00000042 05"), "bad_string at byte 0 in s");
}

TEST(SomeipToCdr, KnowsStringsByTheirBom) {
  covers({"feat_req_someip_666", "feat_req_someip_641"});
  PayloadRules rules;
  rules.string_encoding = StringEncoding::utf16be;
  const auto plan = plan_of(tree_of("string s"), rules);
  EXPECT_EQ(to_cdr(plan, "00000006 feff 0041 0000"), compact("00010000 02000000 4100"));
  EXPECT_EQ(to_cdr(plan, "00000006 fffe 4100 0000"), "bad_string at byte 0 in s");  // the other byte order
  EXPECT_EQ(to_cdr(plan, "00000007 feff 0041 0000 ff"),
            compact("00010000 02000000 4100"));  // odd: last ignored
  EXPECT_EQ(to_cdr(plan, "00000007 feff 0041 0042 00"), "bad_string at byte 0 in s");
  EXPECT_EQ(to_cdr(plan, "00000006 feff d800 0000"), "bad_encoding at byte 0 in s");
  EXPECT_EQ(to_cdr(plan, "00000006 feff dc00 0000"), "bad_encoding at byte 0 in s");
  EXPECT_EQ(to_cdr(plan, "00000008 feff d800 0041 0000"), "bad_encoding at byte 0 in s");
}

// Field names

TEST(Conversion, NamesTheFieldAtFault) {
  const auto plan = plan_of(builtin("sensor_msgs/PointCloud2"));
  // A header with an empty frame, height, width, two fields: the second's name is too long for what is there.
  EXPECT_EQ(
      to_cdr(plan,
             "00000001 00000002 00000004efbbbf00 00000001 00000001"
             "00000024 00000005efbbbf7800 00000000 07 00000001 00000044efbbbf7900 00000000 07 00000001"),
      "truncated at byte 46 in fields[1].name");
  EXPECT_EQ(to_cdr(plan, "00000001 000000"), "truncated at byte 4 in header.stamp.nanosec");
  EXPECT_EQ(to_cdr(plan_of(builtin("geometry_msgs/PoseWithCovariance")), std::string(16 * 10, '0')),
            "truncated at byte 80 in covariance[3]");
  // Points are a block of numbers, and still known by name.
  EXPECT_EQ(to_cdr(plan_of(builtin("geometry_msgs/Polygon")), "00000009 000000000000000000"),
            "bad_length at byte 0 in points");
}

TEST(Conversion, NamesFieldsInLoopsWithinLoops) {
  TypeTree tree = tree_of("Inner[2] inner");
  MessageDefinition inner = tree_of("string[] names\nuint16 last").messages[0];
  tree.messages[0].fields[0].type.message_index = 0;
  tree.messages.insert(tree.messages.begin(), inner);
  const auto plan = plan_of(tree);
  const std::string element = "00000010 00000004efbbbf00 00000004efbbbf00";
  EXPECT_EQ(to_cdr(plan, element + "0001" + "00000010 00000004efbbbf00 00000003efbbbf00 0001"),
            "bad_string at byte 34 in inner[1].names[1]");
  EXPECT_EQ(to_cdr(plan, element + "0001" + element + "00"), "truncated at byte 42 in inner[1].last");
}

// Types that cannot be carried

TEST(Compile, SaysWhyATypeCannotBeCarried) {
  PayloadRules rules;
  rules.string_length = FieldWidth::none;
  EXPECT_EQ(compile_error(builtin("std_msgs/Header"), rules),
            "std_msgs/msg/Header cannot be carried: frame_id is a string: without a string length field it "
            "needs a fixed size (fixed_strings)");
  EXPECT_EQ(compile_error(builtin("geometry_msgs/Point"), rules), "no error");
  rules = {};
  rules.array_length = FieldWidth::none;
  EXPECT_EQ(
      compile_error(tree_of("uint8[] x"), rules),
      "test_msgs/msg/Test cannot be carried: x is an array of no fixed size: it needs an array length field");
  EXPECT_EQ(compile_error(tree_of("uint8[3] x"), rules), "no error");
  rules = {};
  rules.alignment = 3;
  EXPECT_THAT(compile_error(tree_of("uint8 x"), rules),
              HasSubstr("an alignment of 3 bytes: expected a power of two"));
  rules.alignment = 0;
  EXPECT_THAT(compile_error(tree_of("uint8 x"), rules), HasSubstr("an alignment of 0 bytes"));
  EXPECT_THAT(compile_error(tree_of("float64[268435456] x")),
              HasSubstr("x has at least 2147483648 bytes, more than"));
  EXPECT_THAT(compile_error(tree_of("string[4294967295] x")), HasSubstr("more than can be carried"));
}

TEST(Compile, RefusesTypesThatGrowWithoutEnd) {
  // Each message has two of the one before: 2^20 fields in 20 short files.
  TypeTree tree = tree_of("uint8 a\nuint16 b");
  for (std::size_t i = 0; i < 20; ++i) {
    MessageDefinition twice = tree_of("Other a\nOther b").messages[0];
    twice.fields[0].type.message_index = twice.fields[1].type.message_index = i;
    tree.messages.push_back(std::move(twice));
  }
  EXPECT_EQ(compile_error(tree), "test_msgs/msg/Test cannot be carried: more than 65536 fields");
}

TEST(Compile, FusesNeighboursOfOneWidth) {
  // 3 + 4 doubles and two arrays of them: one operation.
  const auto pose = plan_of(builtin("geometry_msgs/PoseWithCovariance"));
  ASSERT_EQ(pose.program().ops.size(), 1U);
  EXPECT_EQ(pose.program().ops[0].count, 43U);
  const auto poses = plan_of(builtin("geometry_msgs/PoseArray"));
  ASSERT_EQ(poses.program().ops.size(), 3U);  // stamp, frame_id, poses
  EXPECT_EQ(poses.program().ops[2].kind, Op::Kind::number_sequence);
  EXPECT_EQ(poses.program().ops[2].count, 7U);
}

TEST(CheckType, AnswersForAConfiguration) {
  EXPECT_EQ(check_type("sensor_msgs/msg/PointCloud2", {}), "");
  EXPECT_EQ(check_type("sensor_msgs/msg/PointCloud3", {}),
            "unknown type sensor_msgs/msg/PointCloud3: not among the built-in ones");
  EXPECT_EQ(check_type("oracle_msgs/Nested", {.folders = {test::source_dir() + "/test/bridge/oracle/msgs"}}),
            "");
}

TEST(CheckLengths, NamesTheArraysThatTheirLengthFieldMayNotCount) {
  using enum someip::FieldWidth;
  const auto lengths = [](const char* type, someip::FieldWidth width) {
    return check_lengths(type, {}, someip::PayloadRules{.array_length = width});
  };
  EXPECT_EQ(lengths("sensor_msgs/msg/PointCloud2", bits8),
            "with array_length: 8, messages are dropped in which one of these has more than 255 bytes: "
            "fields, data");
  EXPECT_EQ(
      lengths("sensor_msgs/msg/PointCloud2", bits16),
      "with array_length: 16, messages are dropped in which one of these has more than 65535 bytes: fields, "
      "data");
  EXPECT_EQ(lengths("std_msgs/msg/UInt8MultiArray", bits8),
            "with array_length: 8, messages are dropped in which one of these has more than 255 bytes: "
            "std_msgs/msg/MultiArrayLayout.dim, data");
  EXPECT_EQ(lengths("sensor_msgs/msg/PointCloud2", bits32), "");
  EXPECT_EQ(lengths("geometry_msgs/msg/Point", bits8), "");
  EXPECT_EQ(lengths("sensor_msgs/msg/Imu", bits8), "");  // arrays of fixed size are another matter
  EXPECT_EQ(lengths("sensor_msgs/msg/PointCloud3", bits8), "");
}

TEST(CheckLengths, KnowsWhichBoundsFit) {
  const std::string folder = testing::TempDir() + "trestle-lengths-" + std::to_string(getpid());
  std::filesystem::create_directories(folder + "/bound_msgs/msg");
  const auto says = [&](const char* text, const someip::PayloadRules& rules) {
    std::ofstream{folder + "/bound_msgs/msg/Test.msg"} << text << "\n";
    return check_lengths("bound_msgs/msg/Test", {.folders = {folder}}, rules).empty();
  };
  const someip::PayloadRules narrow{.array_length = someip::FieldWidth::bits8};
  EXPECT_TRUE(says("uint8[<=255] a", narrow));
  EXPECT_FALSE(says("uint8[<=256] a", narrow));
  EXPECT_TRUE(says("float64[<=31] a", narrow));  // 248 bytes
  EXPECT_FALSE(says("float64[<=32] a", narrow));
  // 3 points of 24 bytes, and strings of 4 + 4 * (5 + 2) bytes at most: 8 of them have 256.
  EXPECT_TRUE(says("geometry_msgs/Point[<=10] a", narrow));
  EXPECT_FALSE(says("geometry_msgs/Point[<=11] a", narrow));
  EXPECT_TRUE(says("string<=5[<=7] a", narrow));
  EXPECT_FALSE(says("string<=5[<=8] a", narrow));
  EXPECT_FALSE(says("string[<=1] a", narrow));
  const someip::PayloadRules wider{.array_length = someip::FieldWidth::bits16};
  EXPECT_TRUE(says("uint8[<=65535] a", wider));
  EXPECT_FALSE(says("uint8[<=65536] a", wider));
  EXPECT_FALSE(says("float64[<=4294967295] a", wider));
  std::filesystem::remove_all(folder);
}

// Memory

std::vector<std::byte> cloud_sample(std::size_t points) {
  // One point field, then the points' bytes.
  auto sample =
      hex("00010000 01000000 02000000 04000000 6d617000 01000000 01000000 01000000 02000000 7800 0000 "
          "00000000 07 000000 "
          "01000000 00 000000 18000000 00000000");
  const auto bytes = static_cast<std::uint32_t>(points * 24);
  for (unsigned shift = 0; shift < 32; shift += 8) {
    sample.push_back(static_cast<std::byte>(bytes >> shift));
  }
  for (std::size_t i = 0; i < bytes; ++i) {
    sample.push_back(static_cast<std::byte>(i * 31 >> 3U));
  }
  sample.push_back(std::byte{1});
  return sample;
}

bool lies_in(ByteView slice, ByteView within) {
  return slice.data() >= within.data() && slice.data() + slice.size() <= within.data() + within.size();
}

TEST(Conversion, ReferencesLargeArraysWhoseBytesStay) {
  const auto plan = plan_of(builtin("sensor_msgs/PointCloud2"));
  const auto sample = cloud_sample(1000);
  ConversionScratch scratch;
  const auto payload = plan.cdr_to_someip(sample, scratch);
  ASSERT_TRUE(payload);
  ASSERT_EQ(payload->slices.size(), 3U);
  EXPECT_TRUE(lies_in(payload->slices[1], sample));
  EXPECT_EQ(payload->slices[1].size(), 24000U);
  EXPECT_EQ(payload->slices[2].size(), 1U);
  const auto bytes = joined(*payload);
  const auto back = plan.someip_to_cdr(bytes, scratch);
  ASSERT_TRUE(back);
  ASSERT_EQ(back->slices.size(), 3U);
  EXPECT_TRUE(lies_in(back->slices[1], bytes));
  EXPECT_EQ(joined(*back), sample);
}

TEST(Conversion, ReferencesNumbersOnlyWhenByteOrdersAgree) {
  PayloadRules little;
  little.byte_order = std::endian::little;
  std::vector<std::byte> sample = hex("00010000 00100000");
  sample.resize(sample.size() + 4096 * 4, std::byte{0x5a});
  ConversionScratch scratch;
  EXPECT_EQ(plan_of(tree_of("float32[] x"), little).cdr_to_someip(sample, scratch)->slices.size(), 2U);
  EXPECT_EQ(plan_of(tree_of("float32[] x")).cdr_to_someip(sample, scratch)->slices.size(), 1U);
  auto big = hex("00000000 00001000");
  big.resize(sample.size(), std::byte{0x5a});
  EXPECT_EQ(plan_of(tree_of("float32[] x")).cdr_to_someip(big, scratch)->slices.size(), 2U);
  EXPECT_EQ(plan_of(tree_of("float32[] x"), little).cdr_to_someip(big, scratch)->slices.size(), 1U);
  // Copies are forced by a threshold that nothing reaches.
  EXPECT_EQ(plan_of(tree_of("float32[] x"), little, SIZE_MAX).cdr_to_someip(sample, scratch)->slices.size(),
            1U);
}

TEST(Conversion, AllocatesNothingInSteadyState) {
  const auto clouds = plan_of(builtin("sensor_msgs/PointCloud2"));
  const auto copied_clouds = plan_of(builtin("sensor_msgs/PointCloud2"), {}, SIZE_MAX);
  const auto sample = cloud_sample(5000);
  ConversionScratch out;
  ConversionScratch back;
  const auto payload = joined(*clouds.cdr_to_someip(sample, out));
  const auto round = [&] {
    return clouds.cdr_to_someip(sample, out) && clouds.someip_to_cdr(payload, back) &&
           copied_clouds.cdr_to_someip(sample, out) && copied_clouds.someip_to_cdr(payload, back);
  };
  ASSERT_TRUE(round());
  const std::size_t before = allocations();
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(round());
  }
  EXPECT_EQ(allocations(), before);
}

TEST(Conversion, AllocatesNothingForTagsInSteadyState) {
  MessageRules rules;
  rules.payload.smallest_tagged_length = true;
  rules.default_missing = true;
  rules.types["test_msgs/msg/Test"].tags = {
      {"a", someip::DataId{1}}, {"b", someip::DataId{2}}, {"c", someip::DataId{3}}};
  const auto tree = tree_of("uint8[] a\nstring b \"default\"\nuint16[<=1] c");
  const auto plan = ConversionPlan::compile(tree, rules);
  ASSERT_TRUE(plan);
  const auto payload = hex("5001 03 010203 1003 0102");  // b is missing
  ConversionScratch out;
  ConversionScratch back;
  const auto sample = joined(*plan->someip_to_cdr(payload, out));
  const auto round = [&] {
    return plan->someip_to_cdr(payload, out).has_value() && plan->cdr_to_someip(sample, back).has_value();
  };
  ASSERT_TRUE(round());
  const std::size_t before = allocations();
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(round());
  }
  EXPECT_EQ(allocations(), before);
}

TEST(Conversion, AllocatesNothingWhenReservedBefore) {
  const auto plan = plan_of(builtin("std_msgs/String"));
  const auto sample = hex("00010000 03000000 686900");
  ConversionScratch scratch;
  scratch.reserve(64);
  ASSERT_TRUE(plan.cdr_to_someip(sample, scratch));  // its list of slices
  const std::size_t before = allocations();
  EXPECT_TRUE(plan.cdr_to_someip(sample, scratch));
  EXPECT_EQ(allocations(), before);
}

TEST(Conversion, ALaterResultDoesNotDependOnAnEarlierOne) {
  const auto plan = plan_of(builtin("std_msgs/String"));
  ConversionScratch scratch;
  const auto bad = hex("00010000 03000000 6869");
  ASSERT_FALSE(plan.cdr_to_someip(bad, scratch));
  const auto good = hex("00010000 03000000 686900");
  EXPECT_EQ(shown(plan.cdr_to_someip(good, scratch)), compact("00000006 efbbbf686900"));
}

}  // namespace
}  // namespace trestle::messages::conversion_plan_test
