// Quick and plain execution make the same of every message: of each built-in type under each set of rules,
// good or spoilt, alone and after others. Types with rules of their own are in shape_test.cpp, the oracle's
// vectors in vectors_test.cpp.
#include <gtest/gtest.h>

#include <random>

#include "test/bridge/messages/convert/profiles.hpp"
#include "test/bridge/messages/convert/random_message.hpp"
#include "test/bridge/messages/convert/support.hpp"

namespace trestle::messages::execution_test {
namespace {

using namespace trestle::test;
using Execution = ConversionPlan::Execution;

/// Bytes, or an error in words.
std::string outcome(const Converted& converted) {
  return converted ? to_hex(joined(*converted)) : to_string(converted.error());
}

/// Quick and plain, with a scratch each that goes from message to message.
class Twins {
 public:
  Twins(const TypeTree& tree, const MessageRules& rules, std::size_t reference_from)
      : quick_{plan_with(tree, rules, reference_from)},
        plain_{plan_with(tree, rules, reference_from, Execution::plain)} {}

  std::vector<std::byte> to_someip(ByteView sample) {
    const auto payload = quick_.cdr_to_someip(sample, there_);
    EXPECT_EQ(outcome(payload), outcome(plain_.cdr_to_someip(sample, plain_there_)));
    return payload ? joined(*payload) : std::vector<std::byte>{};
  }
  void to_cdr(ByteView payload) {
    const auto sample = quick_.someip_to_cdr(payload, back_);
    EXPECT_EQ(outcome(sample), outcome(plain_.someip_to_cdr(payload, plain_back_)));
  }

 private:
  ConversionPlan quick_;
  ConversionPlan plain_;
  ConversionScratch there_;
  ConversionScratch back_;
  ConversionScratch plain_there_;
  ConversionScratch plain_back_;
};

/// A byte more or less, or another bit somewhere.
std::vector<std::byte> spoilt(std::vector<std::byte> bytes, std::minstd_rand& random) {
  if (bytes.empty() || random() % 4 == 0) {
    bytes.resize(bytes.size() + 1 - random() % 2 * std::min<std::size_t>(2, bytes.size()));
  } else {
    bytes[random() % bytes.size()] ^= static_cast<std::byte>(1U << random() % 8U);
  }
  return bytes;
}

void compare(Twins& twins, const TypeTree& tree, std::minstd_rand& random) {
  for (const auto order : {std::endian::little, std::endian::big}) {
    for (unsigned turn = 0; turn < 6; ++turn) {
      const auto sample = RandomMessage{tree, order, 1 + turn / 5, static_cast<unsigned>(random())}.bytes();
      const auto payload = twins.to_someip(sample);
      twins.to_cdr(payload);
      twins.to_someip(spoilt(sample, random));
      twins.to_cdr(spoilt(payload, random));
    }
  }
}

class Executions : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Rules, Executions,
                         testing::Values("commonapi", "autosar", "commonapi_little", "little", "short",
                                         "legacy_strings", "utf16le", "utf16be_plain", "aligned4",
                                         "aligned32", "by_field"),
                         [](const auto& rules) { return std::string{rules.param}; });

TEST_P(Executions, MakeTheSameOfEveryBuiltInType) {
  std::minstd_rand random{5};
  TypeLibrary library;
  for (const auto& name : TypeLibrary::builtin_names()) {
    if (name.find("/msg/") == std::string::npos) {
      continue;
    }
    SCOPED_TRACE(name);
    const auto tree = library.resolve(name);
    ASSERT_TRUE(tree);
    for (const std::size_t reference_from : {std::size_t{32}, SIZE_MAX}) {
      Twins twins{*tree, message_rules(GetParam(), *tree), reference_from};
      compare(twins, *tree, random);
      ASSERT_FALSE(HasFailure());
    }
  }
}

TEST(Execution, IsPlainWithoutAnyQuickWay) {
  const auto tree = builtin("sensor_msgs/PointCloud2");
  EXPECT_TRUE(plan_of(tree).program().quick.loop);
  const ConversionPlan plain = plan_of(tree, {}, SIZE_MAX, Execution::plain);
  EXPECT_FALSE(plain.program().quick.loop);
  EXPECT_FALSE(plain.program().quick.front);
  EXPECT_EQ(plain.program().quick.array_at, 0U);
  for (const Op& op : plain.program().ops) {
    EXPECT_EQ(op.loop, Op::Loop::no);
    EXPECT_EQ(op.slot, 0U);
    EXPECT_FALSE(op.all_in_loop);
  }
}

}  // namespace
}  // namespace trestle::messages::execution_test
