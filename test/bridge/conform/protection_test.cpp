#include "bridge/conform/protection.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trestle::conform::protection_test {
namespace {

/// A message of zeros, as in the examples of AUTOSAR's specification, which have no SOME/IP header.
Bytes zeros(const E2eProtection& how, std::size_t size, std::uint32_t counter = 0) {
  return protect(how, {}, Bytes(size - e2e_header_bytes(how.profile)), counter, false);
}

TEST(Protection, GivesTheExamplesOfTheSpecification) {
  EXPECT_EQ(zeros({.profile = E2eProfile::p4, .data_id = 0x0a0b'0c0d}, 16),
            bytes({0, 0x10, 0, 0, 0x0a, 0x0b, 0x0c, 0x0d, 0x86, 0x2b, 0x05, 0x56, 0, 0, 0, 0}));
  EXPECT_EQ(zeros({.profile = E2eProfile::p5, .data_id = 0x1234}, 8), bytes({0x1c, 0xca, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(zeros({.profile = E2eProfile::p6, .data_id = 0x1234}, 8), bytes({0xb1, 0x55, 0, 8, 0, 0, 0, 0}));
  EXPECT_EQ(zeros({.profile = E2eProfile::p7, .data_id = 0x0a0b'0c0d}, 24),
            bytes({0x1f, 0xb2, 0xe7, 0x37, 0xfc, 0xed, 0xbc, 0xd9, 0, 0, 0, 0x18,
                   0,    0,    0,    0,    0x0a, 0x0b, 0x0c, 0x0d, 0, 0, 0, 0}));
  EXPECT_EQ(zeros({.profile = E2eProfile::p8, .data_id = 0x0a0b'0c0d}, 20),
            bytes({0x41, 0x49, 0x4e, 0x52, 0, 0, 0, 0x14, 0, 0, 0, 0, 0x0a, 0x0b, 0x0c, 0x0d, 0, 0, 0, 0}));
  EXPECT_EQ(zeros({.profile = E2eProfile::p11, .data_id = 0x123}, 8), bytes({0xcc, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(zeros({.profile = E2eProfile::p11, .data_id = 0x123, .nibble = true}, 8),
            bytes({0x2a, 0x10, 0, 0, 0, 0, 0, 0}));
}

TEST(Protection, HasACounterThatCanBeRead) {
  for (const E2eProfile profile :
       {E2eProfile::p1, E2eProfile::p2, E2eProfile::p4, E2eProfile::p4m, E2eProfile::p5, E2eProfile::p6,
        E2eProfile::p7, E2eProfile::p7m, E2eProfile::p8, E2eProfile::p8m, E2eProfile::p11, E2eProfile::p22,
        E2eProfile::p44}) {
    const E2eProtection how{.profile = profile, .data_id = 0x123, .data_ids = Bytes(16, std::byte{7})};
    EXPECT_EQ(e2e_counter_of(profile, zeros(how, 32, 11)), 11U) << to_string(profile);
  }
}

}  // namespace
}  // namespace trestle::conform::protection_test
