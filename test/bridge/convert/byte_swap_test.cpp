#include "bridge/convert/byte_swap.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace trestle::bridge {
namespace {

TEST(ByteSwap, ReversesEachNumberAtAnyPlaceAndSize) {
  std::vector<std::byte> from(1024);
  for (std::size_t i = 0; i < from.size(); ++i) {
    from[i] = static_cast<std::byte>(i * 7 + (i >> 8U));
  }
  for (const std::size_t width : {2U, 4U, 8U}) {
    for (std::size_t count = 0; count < 80; ++count) {
      for (const std::size_t shift : {0U, 1U, 3U}) {
        std::vector<std::byte> expected(from.begin() + static_cast<std::ptrdiff_t>(shift),
                                        from.begin() + static_cast<std::ptrdiff_t>(shift + count * width));
        for (std::size_t i = 0; i < count; ++i) {
          const auto number = expected.begin() + static_cast<std::ptrdiff_t>(i * width);
          std::reverse(number, number + static_cast<std::ptrdiff_t>(width));
        }
        std::vector<std::byte> to(count * width + 2, std::byte{0xee});  // a byte before and one behind
        copy_swapped(to.data() + 1, from.data() + shift, count, width);
        EXPECT_EQ(to.front(), std::byte{0xee});
        EXPECT_EQ(to.back(), std::byte{0xee});
        EXPECT_TRUE(std::equal(expected.begin(), expected.end(), to.begin() + 1))
            << count << " numbers of " << width << " bytes at " << shift;
      }
    }
  }
}

}  // namespace
}  // namespace trestle::bridge
