#pragma once

namespace trestle::carry {

/// Base of interfaces: objects are not copied, and may be deleted through a pointer to it.
class Interface {
 public:
  Interface() = default;
  virtual ~Interface() = default;
  Interface(const Interface&) = delete;
  Interface& operator=(const Interface&) = delete;
};

}  // namespace trestle::carry
