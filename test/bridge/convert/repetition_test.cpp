#include "bridge/convert/repetition.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "test/bridge/convert/support.hpp"

namespace trestle::bridge::repetition_test {
namespace {

using namespace trestle::test;
using someip::PayloadRules;

const Repetition::Conversion somewhere{.program = 1, .to_cdr = true, .position = 12};

TEST(Repetition, KnowsTheSameArrayInTheSamePlace) {
  Repetition repetition;
  EXPECT_FALSE(repetition.is(somewhere, hex("0102")));
  repetition.note(somewhere, hex("0102"), hex("aabbcc"));
  EXPECT_TRUE(repetition.is(somewhere, hex("0102")));
  EXPECT_TRUE(repetition.is(somewhere, hex("0102 03")));  // something follows it
  EXPECT_EQ(repetition.reads(), 2U);
  EXPECT_EQ(to_hex(repetition.written()), "aabbcc");
  EXPECT_FALSE(repetition.is(somewhere, hex("0103")));
  EXPECT_FALSE(repetition.is(somewhere, hex("01")));
}

TEST(Repetition, DistinguishesProgramsDirectionsOrdersAndAlignments) {
  Repetition repetition;
  repetition.note(somewhere, hex("0102"), hex("aa"));
  auto other = somewhere;
  other.program = 2;
  EXPECT_FALSE(repetition.is(other, hex("0102")));
  other = somewhere;
  other.to_cdr = false;
  EXPECT_FALSE(repetition.is(other, hex("0102")));
  other = somewhere;
  other.order = other.order == std::endian::big ? std::endian::little : std::endian::big;
  EXPECT_FALSE(repetition.is(other, hex("0102")));
  other = somewhere;
  other.position = 16;
  EXPECT_FALSE(repetition.is(other, hex("0102")));
  other.position = 20;
  EXPECT_TRUE(repetition.is(other, hex("0102")));
}

TEST(Repetition, KeepsNothingLongAndNothingInPieces) {
  Repetition repetition;
  const std::vector<std::byte> longest(1024);
  const std::vector<std::byte> too_long(1025);
  repetition.note(somewhere, too_long, longest);
  EXPECT_FALSE(repetition.is(somewhere, too_long));
  repetition.note(somewhere, longest, too_long);
  EXPECT_FALSE(repetition.is(somewhere, longest));
  repetition.note(somewhere, longest, {});
  EXPECT_FALSE(repetition.is(somewhere, longest));
  repetition.note(somewhere, longest, longest);
  EXPECT_TRUE(repetition.is(somewhere, longest));
}

TEST(Repetition, GivesUpWhereArraysAreNeverTheSame) {
  Repetition repetition;
  const auto array = [](unsigned number) { return std::vector<std::byte>{static_cast<std::byte>(number)}; };
  for (unsigned i = 1; i <= 20; ++i) {
    EXPECT_FALSE(repetition.is(somewhere, array(i)));
    repetition.note(somewhere, array(i), array(i));
  }
  EXPECT_FALSE(repetition.is(somewhere, array(20)));
  EXPECT_TRUE(repetition.is(somewhere, array(8)));  // the last one that it took, and it comes again:
  repetition.note(somewhere, array(30), array(30));
  EXPECT_TRUE(repetition.is(somewhere, array(30)));
}

// One scratch for all messages, whose arrays are sometimes those of the message before, and sometimes bad.
TEST(Conversion, DoesNotDependOnTheMessageBefore) {
  const auto tree = tree_of("uint8[] front\nstring<=4[<=3] names\nuint64[] back");
  PayloadRules without_bom;
  without_bom.string_bom = false;
  const std::array plans{plan_of(tree), plan_of(tree, without_bom),
                         plan_of(tree, {.byte_order = std::endian::little})};
  for (const ConversionPlan& plan : plans) {
    ASSERT_NE(plan.program().repetitive, Program::none);
    ASSERT_EQ(plan.program().ops[plan.program().repetitive].kind, Op::Kind::sequence);
  }
  const std::vector<std::string> fronts{"00000000", "01000000 aa", "05000000 aabbccddee",
                                        "08000000 aabbccddeeff0011"};
  // Aligned to 4 behind each front: the padding is made below. The last ones are bad.
  const std::vector<std::string> names{"00000000",
                                       "01000000 02000000 6100",
                                       "02000000 02000000 6100 0000 03000000 626200",
                                       "01000000 02000000 6200",
                                       "02000000 02000000 6100 0000 03000000 626263",
                                       "01000000 06000000 616263646500"};
  const std::string back = "01000000 0102030405060708";
  ConversionScratch scratch;
  std::size_t good = 0;
  std::size_t bad = 0;
  for (unsigned turn = 0; turn < 2000; ++turn) {
    const auto pick = [random = turn * 2654435761U](const auto& from, unsigned bit) {
      return from[(random >> bit) % from.size()];
    };
    std::vector<std::byte> body;
    const auto append = [&](const std::string& digits, std::size_t alignment) {
      body.resize((body.size() + alignment - 1) / alignment * alignment);
      const auto bytes = hex(digits);
      body.insert(body.end(), bytes.begin(), bytes.end());
    };
    append(pick(fronts, 9), 4);
    append(pick(names, 13), 4);
    append(back.substr(0, 8), 4);
    append(back.substr(9), 8);
    std::vector<std::byte> sample = hex("00010000");
    sample.insert(sample.end(), body.begin(), body.end());
    const ConversionPlan& plan = plans[turn / 7 % plans.size()];
    ASSERT_EQ(shown(plan.cdr_to_someip(sample, scratch)), to_someip(plan, sample));
    const auto cut = [turn](const std::vector<std::byte>& bytes) {
      const std::size_t less = turn % std::min<std::size_t>(16, bytes.size());
      return std::vector<std::byte>(bytes.begin(), bytes.end() - static_cast<std::ptrdiff_t>(less));
    };
    const auto cut_sample = cut(sample);
    ASSERT_EQ(shown(plan.cdr_to_someip(cut_sample, scratch)), to_someip(plan, cut_sample));
    const auto converted = plan.cdr_to_someip(sample, scratch);
    if (!converted) {
      ++bad;
      continue;
    }
    ++good;
    const auto payload = joined(*converted);
    ASSERT_EQ(shown(plan.someip_to_cdr(payload, scratch)), to_cdr(plan, payload));
    const auto cut_payload = cut(payload);
    ASSERT_EQ(shown(plan.someip_to_cdr(cut_payload, scratch)), to_cdr(plan, cut_payload));
  }
  EXPECT_GT(good, 500U);
  EXPECT_GT(bad, 100U);
}

// Its bytes would be those of the message before.
TEST(Conversion, LooksForRepetitionOnlyWhereBytesAloneDecide) {
  const auto repetitive = [](const TypeTree& tree, const PayloadRules& rules = {}) {
    return plan_of(tree, rules).program().repetitive;
  };
  EXPECT_NE(repetitive(builtin("sensor_msgs/PointCloud2")), Program::none);
  EXPECT_NE(repetitive(builtin("sensor_msgs/JointState")), Program::none);
  PayloadRules padded;
  padded.alignment = 4;  // padding depends on where the array stands in SOME/IP
  EXPECT_EQ(repetitive(builtin("sensor_msgs/PointCloud2"), padded), Program::none);
  EXPECT_EQ(repetitive(builtin("sensor_msgs/Image")), Program::none);
  EXPECT_EQ(repetitive(tree_of("uint32[] numbers")), Program::none);
}

}  // namespace
}  // namespace trestle::bridge::repetition_test
