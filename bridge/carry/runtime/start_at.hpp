#pragma once
#include <fmt/format.h>

#include <stdexcept>

#include "bridge/carry/config/bridge_config.hpp"

namespace trestle::carry {

/// What keeps a part of the configuration from being carried out is said with its place in the file.
template <typename Start>
auto start_at(const BridgeConfig& config, documents::Mark mark, const Start& start) {
  try {
    return start();
  } catch (const std::exception& error) {
    throw std::runtime_error{
        mark.line == 0 ? fmt::format("{}: {}", config.file, error.what())
                       : fmt::format("{}:{}:{}: {}", config.file, mark.line, mark.column, error.what())};
  }
}

}  // namespace trestle::carry
