#pragma once
#include <optional>
#include <string>

#include "bridge/describe/model.hpp"

namespace trestle::conform {

struct ProfileWishes {
  std::string name{};                 ///< of the device; empty: of its machine, or "Device"
  std::optional<IpAddress> device{};  ///< which one; nothing: the one with most services
  std::optional<IpAddress> tester{};
  /// Group and port of service discovery, where it was listened to; else as the machine has it.
  std::optional<Endpoint> discovery{};
};

struct WrittenProfile {
  std::string text{};    ///< YAML, with comments on what is left to say; empty: there is nothing to write of
  std::string others{};  ///< devices that it is not about, "192.0.2.7, 192.0.2.9"
};

/// A first profile of a device, from what is known of its services. What the model does not tell is a guess,
/// and has a comment that says so.
/// @param model  with an id for everything.
[[nodiscard]] WrittenProfile write_profile(const describe::Model& model, const ProfileWishes& wishes);

}  // namespace trestle::conform
