#include "bridge/carry/runtime/spare_memory.hpp"

#include <gtest/gtest.h>

namespace trestle::test::spare_memory_test {
namespace {

using carry::SpareMemoryRule;

constexpr std::size_t little = SpareMemoryRule::worth_it / 2;
constexpr std::size_t much = 3 * SpareMemoryRule::worth_it;

TEST(SpareMemory, GoesBackWhenThereIsMuch) {
  SpareMemoryRule rule;
  EXPECT_FALSE(rule.is_due(little));
  EXPECT_TRUE(rule.is_due(much));
  rule.given_back(little);
  EXPECT_FALSE(rule.is_due(little));
}

TEST(SpareMemory, IsNotAskedForAgainAsLongAsItCannotGoBack) {
  SpareMemoryRule rule;
  EXPECT_TRUE(rule.is_due(much));
  rule.given_back(much);
  EXPECT_FALSE(rule.is_due(much));
  EXPECT_FALSE(rule.is_due(much + little));
  EXPECT_TRUE(rule.is_due(2 * much));
}

TEST(SpareMemory, GoesBackMoreSeldomWhereItIsNeededAgainAndAgain) {
  SpareMemoryRule rule;
  int given_back = 0;
  for (int look = 0; look < 100; ++look) {
    if (rule.is_due(much)) {
      ++given_back;
      rule.given_back(little);
    }
  }
  EXPECT_GT(given_back, 100 / SpareMemoryRule::longest_wait - 2);
  EXPECT_LT(given_back, 100 / SpareMemoryRule::longest_wait + 4);
}

}  // namespace
}  // namespace trestle::test::spare_memory_test
