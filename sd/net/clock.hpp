#pragma once
#include <chrono>

#include "someip/wire/types.hpp"

namespace trestle::sd {

/// The time as the state machines are told it. Nothing below `net/` asks a clock.
inline TimePoint now() {
  return std::chrono::steady_clock::now();
}

}  // namespace trestle::sd
