#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bridge/conform/fuzz/sequence.hpp"
#include "bridge/conform/profile.hpp"
#include "bridge/describe/model.hpp"
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
  /// @param own    the tester's UDP endpoint.
  /// @param model  what an interface description says of the services; null: there is none. It outlives this.
  Sequences(std::vector<Target> targets, std::vector<fuzz::KnownService> wanted, const Endpoint& own,
            const describe::Model* model = nullptr);

  void add(Target target);
  void add_wanted(fuzz::KnownService service);
  /// The device takes the events of a service that it uses at this port.
  void subscribed(std::uint16_t service, std::uint16_t port) { subscribers_[service] = port; }
  [[nodiscard]] const std::vector<Target>& targets() const noexcept { return targets_; }
  [[nodiscard]] const std::vector<fuzz::KnownService>& wanted() const noexcept { return wanted_; }

  /// A new one.
  [[nodiscard]] Sequence make(fuzz::Random& random) const;
  /// What is tried first: requests with one thing wrong in a payload whose type is known, each once.
  [[nodiscard]] std::vector<Sequence> make_spoilt(fuzz::Random& random) const;
  /// One with one or a few things changed: a step's bytes, its way, a step less, twice, or of `other`.
  [[nodiscard]] Sequence changed(Sequence sequence, const Sequence& other, fuzz::Random& random) const;

  static constexpr const char* after_reboot = "tester rebooted";

 private:
  void lead_into_state(Sequence& sequence, const Target& target, fuzz::Random& random) const;
  void keep_harmless(Sequence& sequence) const;
  [[nodiscard]] const Target& any_target(fuzz::Random& random) const;
  void append_event(Sequence& sequence, fuzz::Random& random) const;
  void append_discovery(Sequence& sequence, const Target& target, fuzz::Random& random) const;
  void change_message(fuzz::Bytes& bytes, std::size_t max_size, fuzz::Random& random) const;
  void change_some(fuzz::Bytes& bytes, std::size_t max_size, fuzz::Random& random) const;
  void append_step(Sequence& sequence, const Target& target, fuzz::Random& random) const;

  std::vector<Target> targets_;
  std::vector<fuzz::KnownService> wanted_;
  std::vector<Target> unreachable_;                     ///< the same, of a device that offers nothing
  std::map<std::uint16_t, std::uint16_t> subscribers_;  ///< ports of the device by service
  Endpoint own_;
  const describe::Model* model_;
};

}  // namespace trestle::conform
