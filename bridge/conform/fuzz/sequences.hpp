#pragma once
#include <optional>
#include <string>
#include <vector>

#include "bridge/conform/fuzz/sequence.hpp"
#include "bridge/conform/profile.hpp"
#include "fuzz/mutate/generate.hpp"

namespace trestle::conform {

/// A service of the device, and where it is reached.
struct Target {
  fuzz::KnownService service{};
  std::uint16_t udp_port = 0;            ///< 0: not over UDP
  std::uint16_t tcp_port = 0;            ///< 0: not over TCP
  std::optional<std::uint16_t> never{};  ///< a method that makes the device silent, as it should
};

/// The services of the profile, with every method and eventgroup that it names.
[[nodiscard]] std::vector<Target> targets_of(const Profile& profile);
/// Services that the device looks for: it is sent offers of them.
[[nodiscard]] std::vector<fuzz::KnownService> wanted_services(const Profile& profile);

/// Makes sequences: first what leads the device into a state, then messages that are changed a little.
class Sequences {
 public:
  /// @param own  the tester's UDP endpoint.
  Sequences(std::vector<Target> targets, std::vector<fuzz::KnownService> wanted, const Endpoint& own);

  void add(Target target) { targets_.push_back(std::move(target)); }
  [[nodiscard]] const std::vector<Target>& targets() const noexcept { return targets_; }

  /// A new one.
  [[nodiscard]] Sequence make(fuzz::Random& random) const;
  /// One with one or a few things changed: a step's bytes, its way, a step less, twice, or of `other`.
  [[nodiscard]] Sequence changed(Sequence sequence, const Sequence& other, fuzz::Random& random) const;

  static constexpr const char* after_reboot = "tester rebooted";

 private:
  void lead_into_state(Sequence& sequence, const Target& target, fuzz::Random& random) const;
  void keep_harmless(Sequence& sequence) const;
  void append_step(Sequence& sequence, const Target& target, fuzz::Random& random) const;

  std::vector<Target> targets_;
  std::vector<fuzz::KnownService> wanted_;
  Endpoint own_;
};

}  // namespace trestle::conform
