#include "bridge/carry/runtime/spare_memory.hpp"

#include <gtest/gtest.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <sys/resource.h>

#include <boost/asio/io_context.hpp>
#include <cstdio>
#include <cstdlib>
#include <latch>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "test/sanitized.hpp"

namespace trestle::test::spare_memory_test {
namespace {

using carry::SpareMemory;
using carry::SpareMemoryRule;

#ifdef __GLIBC__
int arenas() {
  char* text = nullptr;
  std::size_t size = 0;
  std::FILE* const file = open_memstream(&text, &size);
  malloc_info(0, file);
  std::fclose(file);
  const std::string info{text, size};
  std::free(text);  // NOLINT(*-no-malloc)
  int count = 0;
  for (std::size_t at = 0; (at = info.find("<heap nr=", at)) != std::string::npos; ++at) {
    ++count;
  }
  return count;
}

// As many threads as DDS has, which allocate all at once.
TEST(SpareMemory, IsSharedByAllThreads) {
  if (sanitized) {
    GTEST_SKIP() << "a sanitizer allocates in its own way";
  }
  boost::asio::io_context io;
  const SpareMemory spare_memory{io};
  constexpr int count = 8;
  std::latch all{count};
  std::vector<std::jthread> threads;
  for (int i = 0; i < count; ++i) {
    threads.emplace_back([&] {
      const std::vector<char> mine(1000);
      all.arrive_and_wait();
    });
  }
  threads.clear();
  EXPECT_LE(arenas(), SpareMemory::most_arenas);
}

long page_faults() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt;
}

TEST(SpareMemory, IsNotMadeAnewForEachSample) {
  if (sanitized) {
    GTEST_SKIP() << "a sanitizer allocates in its own way";
  }
  boost::asio::io_context io;
  const SpareMemory spare_memory{io};
  constexpr std::size_t bytes = 6 << 20;
  const auto sample = [] { return std::vector<char>(bytes, 1); };
  const auto carry = [&] {
    return sample().back() + sample().back() + std::pair{sample(), sample()}.first.back();
  };
  std::ignore = carry();
  const long before = page_faults();
  constexpr int count = 10;
  for (int i = 0; i < count; ++i) {
    std::ignore = carry();
  }
  EXPECT_LT(page_faults() - before, 100) << "a sample has 1536 pages";
}
#endif

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
