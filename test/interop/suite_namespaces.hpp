#pragma once
#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <string>

#include "test/interop/namespaces.hpp"

namespace trestle::interop {

/// The namespaces of a program's test suites: made by the first of them, or not at all where the machine has
/// none.
class SuiteNamespaces {
 public:
  /// In SetUpTestSuite().
  void make() {
    if (made_ || !why_not_.empty()) {
      return;  // another suite of this process has tried
    }
    try {
      made_ = std::make_unique<Namespaces>();
    } catch (const std::runtime_error& error) {
      why_not_ =
          std::string{
              "this needs network namespaces, which the system lets root make, and perhaps others: "} +
          error.what();
    }
  }
  /// In SetUp(): without namespaces the test is skipped, or fails where it is not to be skipped.
  void expect() const {
    if (why_not_.empty()) {
      return;
    }
    if (Namespaces::required()) {
      FAIL() << why_not_;
    }
    GTEST_SKIP() << why_not_;
  }

  [[nodiscard]] explicit operator bool() const noexcept { return made_ != nullptr; }
  const Namespaces* operator->() const noexcept { return made_.get(); }

 private:
  std::unique_ptr<Namespaces> made_;
  std::string why_not_;
};

}  // namespace trestle::interop
