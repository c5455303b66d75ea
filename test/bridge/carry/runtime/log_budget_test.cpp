#include "bridge/carry/runtime/log_budget.hpp"

#include <gmock/gmock.h>

namespace trestle::test::log_budget_test {
namespace {

using carry::LogBudget;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using namespace std::chrono_literals;

constexpr TimePoint start{1000s};

std::string line_of(int number) {
  return "SD 10.0." + std::to_string(number / 256) + "." + std::to_string(number % 256) + " was started anew";
}

TEST(LogBudget, LeavesOutWhatIsTooMuchOfOneKindAndSaysSo) {
  LogBudget budget;
  std::size_t bytes = 0;
  int left_out = 0;
  for (int i = 0; i < 10'000; ++i) {
    EXPECT_THAT(budget.left_out(start), IsEmpty());
    const bool taken = budget.take(line_of(i), start);
    bytes += taken ? line_of(i).size() : 0;
    left_out += taken ? 0 : 1;
  }
  EXPECT_LE(bytes, LogBudget::most_of_a_kind);
  EXPECT_GT(bytes, LogBudget::most_of_a_kind / 3);
  EXPECT_TRUE(budget.take("carrying 3 routes", start)) << "another kind";
  EXPECT_THAT(budget.left_out(start + 10s), ElementsAre(HasSubstr("left out " + std::to_string(left_out) +
                                                                  " more lines of this kind: SD 10.0.")));
  EXPECT_TRUE(budget.take(line_of(1), start + 10s));
  EXPECT_THAT(budget.left_out(start + 20s), IsEmpty());
}

TEST(LogBudget, IsBoundedHoweverManyKindsThereAre) {
  LogBudget budget;
  std::size_t bytes = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string line(100, 'x');
    for (int bit = 0; bit < 16; ++bit) {  // letters that no number has
      line[static_cast<std::size_t>(bit)] = (i >> bit & 1) != 0 ? 'y' : 'z';
    }
    bytes += budget.take(line, start + std::chrono::milliseconds{i / 2 % 10'000}) ? line.size() + 24 : 0;
  }
  for (const std::string& line : budget.left_out(start + 10s)) {
    bytes += line.size() + 24;
  }
  EXPECT_LE(bytes, 64'000U);
}

TEST(LogBudget, IsBoundedInAnyTenSeconds) {
  LogBudget budget;
  EXPECT_TRUE(budget.take("begins the window", start));
  std::size_t bytes = 0;
  for (int i = 0; i < 10'000; ++i) {
    const TimePoint now = start + 5s + std::chrono::milliseconds{i};
    for (const std::string& line : budget.left_out(now)) {
      bytes += line.size() + 24;
    }
    const std::string line(100, static_cast<char>('p' + i % 10));
    bytes += budget.take(line, now) ? line.size() + 24 : 0;
  }
  EXPECT_LE(bytes, 64'000U);
  EXPECT_GT(bytes, 32'000U);
}

TEST(LogBudget, KeepsSomeForErrorsHoweverManyKindsOfWarningsThereAre) {
  LogBudget budget;
  std::size_t bytes = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string line(100, 'x');
    for (int bit = 0; bit < 16; ++bit) {
      line[static_cast<std::size_t>(bit)] = (i >> bit & 1) != 0 ? 'y' : 'z';
    }
    bytes += budget.take(line, start) ? line.size() + 24 : 0;
  }
  EXPECT_FALSE(budget.take(std::string(100, 'w'), start)) << "another kind of warning";
  EXPECT_TRUE(budget.take("this route seems to loop", start, true));
  for (int i = 0; i < 1000; ++i) {
    const std::string line = line_of(i);
    bytes += budget.take(line, start, true) ? line.size() + 24 : 0;
  }
  EXPECT_LE(bytes, LogBudget::most);
  EXPECT_THAT(budget.left_out(start + 10s).front(), HasSubstr("more lines of this kind: SD 10.0."))
      << "errors first";
}

TEST(LogBudget, KeepsSomeForWhatIsSaidSeldom) {
  LogBudget budget;
  for (int i = 0; i < 4; ++i) {
    for (int line = 0; line < 1000; ++line) {
      static_cast<void>(budget.take(std::string(100, static_cast<char>('p' + i)), start));
    }
  }
  EXPECT_TRUE(budget.take("stopping: withdrawing offers and subscriptions", start));
}

}  // namespace
}  // namespace trestle::test::log_budget_test
