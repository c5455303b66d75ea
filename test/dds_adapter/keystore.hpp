#pragma once
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "test/source_dir.hpp"

namespace trestle::test {

/// To be called in SetUp(): makes a keystore with the enclaves /vehicle/trestle and /lidar in `folder`
/// (make_keystore.sh). Skips the test where openssl is not installed.
inline void make_keystore(const std::string& folder) {
  // NOLINTBEGIN(*-env33-c): of our own text only
  if (system("command -v openssl >/dev/null") != 0) {
    GTEST_SKIP() << "openssl is not installed";
  }
  const std::string command = test::source_dir() + "/test/dds_adapter/make_keystore.sh " + folder +
                              " /vehicle/trestle /lidar >" + folder + ".log 2>&1";
  ASSERT_EQ(system(command.c_str()), 0) << command;
  // NOLINTEND(*-env33-c)
}

}  // namespace trestle::test
