#pragma once
#include <gmock/gmock.h>

#include <algorithm>
#include <string>
#include <vector>

#include "bridge/carry/config/load.hpp"
#include "test/bridge/carry/config/good_config.hpp"

namespace trestle::test {

inline std::vector<std::string> lines(const std::vector<documents::Problem>& problems) {
  std::vector<std::string> result(problems.size());
  std::ranges::transform(problems, result.begin(),
                         [](const documents::Problem& problem) { return to_string(problem); });
  return result;
}

/// What a text says that is a good configuration, of which nothing is warned.
inline carry::BridgeConfig config_of(const std::string& text) {
  const auto loaded = carry::parse_config(text, "b.yaml");
  if (!loaded) {
    ADD_FAILURE() << to_string(loaded.error().front());
    return {};
  }
  EXPECT_THAT(loaded->warnings, testing::SizeIs(0));
  return loaded->config;
}

/// What is said about a text that is not a good configuration.
inline std::vector<std::string> problems_of(const std::string& text, const carry::TypeCheck& check = {}) {
  const auto loaded = carry::parse_config(text, "b.yaml", check);
  return loaded ? std::vector<std::string>{"no errors"} : lines(loaded.error());
}

}  // namespace trestle::test
