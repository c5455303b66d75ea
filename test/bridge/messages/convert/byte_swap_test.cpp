#include "bridge/messages/convert/program/byte_swap.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace trestle::messages::byte_swap_test {
namespace {

std::vector<Shuffle> all_shuffles() {
  std::vector<Shuffle> all{Shuffle::none};
  for (const Shuffle shuffle : {Shuffle::avx2, Shuffle::avx512}) {
    if (shuffle <= best_shuffle) {
      all.push_back(shuffle);
    }
  }
  return all;
}

// With all instructions that this processor has.
class ByteSwap : public testing::TestWithParam<Shuffle> {};
INSTANTIATE_TEST_SUITE_P(All, ByteSwap, testing::ValuesIn(all_shuffles()));

TEST_P(ByteSwap, ReversesEachNumberAtAnyPlaceAndSize) {
  std::vector<std::byte> from(2048);
  for (std::size_t i = 0; i < from.size(); ++i) {
    from[i] = static_cast<std::byte>(i * 7 + (i >> 8U));
  }
  for (const std::size_t width : {2U, 4U, 8U}) {
    for (std::size_t count = 0; count < 150; ++count) {
      for (const std::size_t shift : {0U, 1U, 3U}) {
        std::vector<std::byte> expected(from.begin() + static_cast<std::ptrdiff_t>(shift),
                                        from.begin() + static_cast<std::ptrdiff_t>(shift + count * width));
        for (std::size_t i = 0; i < count; ++i) {
          const auto number = expected.begin() + static_cast<std::ptrdiff_t>(i * width);
          std::reverse(number, number + static_cast<std::ptrdiff_t>(width));
        }
        std::vector<std::byte> to(count * width + 2, std::byte{0xee});  // a byte before and one behind
        copy_swapped(to.data() + 1, from.data() + shift, count, width, GetParam());
        EXPECT_EQ(to.front(), std::byte{0xee});
        EXPECT_EQ(to.back(), std::byte{0xee});
        EXPECT_TRUE(std::equal(expected.begin(), expected.end(), to.begin() + 1))
            << count << " numbers of " << width << " bytes at " << shift;
      }
    }
  }
}

TEST_P(ByteSwap, ReversesEachNumberOfLargeArrays) {
  std::vector<std::byte> from(100'003);
  for (std::size_t i = 0; i < from.size(); ++i) {
    from[i] = static_cast<std::byte>(i * 2654435761U >> 13U);
  }
  for (const std::size_t width : {2U, 4U, 8U}) {
    const std::size_t count = from.size() / width;
    std::vector<std::byte> to(count * width);
    copy_swapped(to.data(), from.data(), count, width, GetParam());
    for (std::size_t i = 0; i < to.size(); ++i) {
      ASSERT_EQ(to[i], from[i / width * width + (width - 1 - i % width)]) << "byte " << i << " of " << width;
    }
  }
}

}  // namespace
}  // namespace trestle::messages::byte_swap_test
