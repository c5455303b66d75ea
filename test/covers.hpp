#pragma once
#include <gtest/gtest.h>

#include <initializer_list>
#include <string>

namespace trestle::test {

/// Records in the XML report which requirements of the Open SOME/IP Specification the running test covers.
inline void covers(std::initializer_list<const char*> requirement_ids) {
  std::string joined;
  for (const char* id : requirement_ids) {
    joined += joined.empty() ? "" : " ";
    joined += id;
  }
  testing::Test::RecordProperty("covers", joined);
}

}  // namespace trestle::test
