#include "dds_adapter/copy_bytes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace trestle::copy_bytes_test {
namespace {

class CopyBytes : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(InBlocks, CopyBytes, testing::Bool());

// Wherever both stand within a block, and whatever is left behind the last whole one.
TEST_P(CopyBytes, CopiesAllAndNothingElse) {
  constexpr std::size_t most_shift = 32;
  const std::byte untouched{0xee};
  std::vector<std::byte> from(5000 + most_shift);
  for (std::size_t i = 0; i < from.size(); ++i) {
    from[i] = static_cast<std::byte>(i * 2654435761U >> 13U);
  }
  for (const std::size_t from_at : {0U, 1U, 15U, 16U, 31U, 32U}) {
    for (const std::size_t to_at : {1U, 2U, 8U, 15U, 16U, 31U, 32U}) {
      for (const std::size_t size : {0U, 1U, 2048U, 2049U, 2063U, 2064U, 2065U, 2079U, 2080U, 2111U, 2112U,
                                     2175U, 2176U, 3000U, 5000U}) {
        std::vector<std::byte> to(to_at + size + 1, untouched);
        copy_bytes(to.data() + to_at, from.data() + from_at, size, GetParam());
        ASSERT_TRUE(std::equal(to.begin() + static_cast<std::ptrdiff_t>(to_at), to.end() - 1,
                               from.begin() + static_cast<std::ptrdiff_t>(from_at)))
            << size << " bytes from " << from_at << " to " << to_at;
        ASSERT_EQ(std::count(to.begin(), to.begin() + static_cast<std::ptrdiff_t>(to_at), untouched),
                  static_cast<std::ptrdiff_t>(to_at));
        ASSERT_EQ(to.back(), untouched);
      }
    }
  }
}

TEST_P(CopyBytes, CopiesLargeOnes) {
  std::vector<std::byte> from(3'000'000);
  for (std::size_t i = 0; i < from.size(); ++i) {
    from[i] = static_cast<std::byte>(i * 2654435761U >> 13U);
  }
  for (const std::size_t size : {1'048'576U, 1'048'577U, 3'000'000U}) {
    std::vector<std::byte> to(size);
    copy_bytes(to.data(), from.data(), size, GetParam());
    EXPECT_TRUE(std::equal(to.begin(), to.end(), from.begin())) << size;
  }
}

}  // namespace
}  // namespace trestle::copy_bytes_test
