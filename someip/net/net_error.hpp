#pragma once
#include <stdexcept>

namespace trestle::someip {

/// A socket that could not be opened or set up. what() names address and port, the cause, and what to do.
class NetError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace trestle::someip
