#pragma once
#include <string>

#include "someip/wire/endpoint.hpp"

namespace trestle::interop {

/// Two network namespaces with a cable between them, made for one test program: the program itself moves into
/// the one, peers are started in the other.
class Namespaces {
 public:
  /// @throws std::runtime_error when they cannot be made; above all when we are not root.
  Namespaces();
  /// Moves back and removes them.
  ~Namespaces();
  Namespaces(const Namespaces&) = delete;
  Namespaces& operator=(const Namespaces&) = delete;

  static constexpr IpAddress own = IpAddress::v4(10, 77, 0, 2);
  static constexpr IpAddress peer = IpAddress::v4(10, 77, 0, 1);
  /// The name of the peers' namespace, for "ip netns exec".
  [[nodiscard]] const std::string& peer_name() const noexcept { return peer_name_; }

 private:
  void remove() noexcept;

  std::string own_name_;
  std::string peer_name_;
  int original_ = -1;
};

}  // namespace trestle::interop
