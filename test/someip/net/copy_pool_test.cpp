#include "someip/net/copy_pool.hpp"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <utility>

namespace trestle::someip::copy_pool_test {
namespace {

TEST(CopyPool, GivesOutAgainWhatWasGivenBack) {
  CopyPool pool{1'000'000};
  std::vector<std::byte> memory = pool.take(200'000);
  EXPECT_GE(memory.capacity(), 200'000U);
  memory.resize(200'000);
  const std::byte* const place = memory.data();
  pool.give_back(std::move(memory));
  EXPECT_GE(pool.kept_bytes(), 200'000U);
  memory = pool.take(150'000);
  EXPECT_TRUE(memory.empty());
  EXPECT_EQ(memory.data(), place);
  EXPECT_EQ(pool.kept_bytes(), 0U);
  EXPECT_NE(pool.take(150'000).data(), place) << "somebody has it";
}

TEST(CopyPool, GivesWhatIsTooSmallToNobody) {
  CopyPool pool{1'000'000};
  pool.give_back(pool.take(1000));
  EXPECT_GE(pool.take(1001).capacity(), 1001U);
  EXPECT_EQ(pool.kept_bytes(), 1000U);
}

// Many of them may wait for long, and all count for little.
TEST(CopyPool, GivesLargeMemoryToNoSmallMessage) {
  CopyPool pool{1'000'000};
  pool.give_back(pool.take(1000));
  EXPECT_LT(pool.take(499).capacity(), 1000U);
  EXPECT_EQ(pool.take(0).capacity(), 0U);
  EXPECT_EQ(pool.kept_bytes(), 1000U);
  EXPECT_EQ(pool.take(500).capacity(), 1000U);
  EXPECT_EQ(pool.kept_bytes(), 0U);
}

TEST(CopyPool, KeepsWhatWasUsedLast) {
  CopyPool pool{1000};
  std::vector<std::byte> first = pool.take(300);
  std::vector<std::byte> second = pool.take(400);
  std::vector<std::byte> third = pool.take(600);
  pool.give_back(std::move(first));
  pool.give_back(std::move(second));
  EXPECT_EQ(pool.kept_bytes(), 700U);
  pool.give_back(std::move(third));
  EXPECT_EQ(pool.kept_bytes(), 1000U) << "the second and the third";
  pool.give_back(std::vector<std::byte>(1001));
  EXPECT_EQ(pool.kept_bytes(), 0U);
}

TEST(CopyPool, KeepsNoMoreThanCanBeLookedAt) {
  CopyPool pool{1'000'000};
  std::vector<std::vector<std::byte>> used;
  for (int i = 0; i < 100; ++i) {
    used.push_back(pool.take(10));
  }
  for (std::vector<std::byte>& memory : used) {
    pool.give_back(std::move(memory));
  }
  EXPECT_EQ(pool.kept_bytes(), 640U);
}

// Of a burst nothing is left when it has been quiet; what is used again and again stays.
TEST(CopyPool, DropsWhatWasNotUsedSinceItWasAskedToBefore) {
  CopyPool pool{1'000'000};
  std::vector<std::byte> first = pool.take(1000);
  pool.give_back(pool.take(3000));
  pool.give_back(std::move(first));
  pool.drop_unused();
  EXPECT_EQ(pool.kept_bytes(), 4000U) << "it was used just before";
  pool.give_back(pool.take(1000));
  pool.drop_unused();
  EXPECT_EQ(pool.kept_bytes(), 1000U);
  pool.drop_unused();
  EXPECT_EQ(pool.kept_bytes(), 0U);
}

TEST(CopyPool, GivesAllBackWhenItIsQuiet) {
  boost::asio::io_context io;
  CopyPool pool{1'000'000, io, std::chrono::milliseconds{1}};
  pool.give_back(pool.take(3000));
  io.run();  // until there is nothing to be waited for
  EXPECT_EQ(pool.kept_bytes(), 0U);
  pool.give_back(pool.take(3000));
  io.restart();
  io.run();
  EXPECT_EQ(pool.kept_bytes(), 0U);
}

TEST(CopyPool, EndsBeforeItIsQuiet) {
  boost::asio::io_context io;
  {
    CopyPool pool{1'000'000, io};
    pool.give_back(pool.take(3000));
  }
  io.run();
}

}  // namespace
}  // namespace trestle::someip::copy_pool_test
