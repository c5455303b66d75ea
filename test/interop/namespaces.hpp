#pragma once
#include <string>
#include <vector>

#include "someip/wire/endpoint.hpp"

namespace trestle::interop {

/// Moves this process into a network namespace of its own that has a cable, an Ethernet device named eth0 at
/// either end, to another one for peers; and gives it a /dev/shm of its own, for files. All of it has no name
/// outside and ends with the last process that is in it, however that ends.
///
/// There can be one in a process, before it has threads.
class Namespaces {
 public:
  /// @throws std::runtime_error when they cannot be made: the system permits it to root, and maybe to others.
  Namespaces();

  static constexpr IpAddress own = IpAddress::v4(10, 77, 0, 2);
  static constexpr IpAddress peer = IpAddress::v4(10, 77, 0, 1);
  static constexpr const char* own_v6 = "fd77::2";
  static constexpr const char* peer_v6 = "fd77::1";
  static constexpr const char* folder = "/dev/shm";

  /// Whether the environment, by TRESTLE_REQUIRE_PEERS, makes it a failure that a test cannot run.
  [[nodiscard]] static bool required();
  /// The peers' namespace as a file, for setns().
  [[nodiscard]] const std::string& peer_file() const noexcept { return peer_file_; }
  /// The command that runs this one in the peers' namespace; it is killed when we end.
  [[nodiscard]] std::vector<std::string> at_peer(const std::vector<std::string>& command) const;

 private:
  std::string peer_file_;
};

}  // namespace trestle::interop
