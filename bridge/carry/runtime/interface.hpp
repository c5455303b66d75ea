#pragma once

namespace trestle::carry {

/// The base of an interface: it is there once, and ends by a pointer to it.
class Interface {
 public:
  Interface() = default;
  virtual ~Interface() = default;
  Interface(const Interface&) = delete;
  Interface& operator=(const Interface&) = delete;
};

}  // namespace trestle::carry
