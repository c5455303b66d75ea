#pragma once
#include <map>
#include <optional>

#include "bridge/conform/fuzz/sequence.hpp"
#include "bridge/conform/profile.hpp"
#include "bridge/conform/tester.hpp"
#include "bridge/conform/trial.hpp"

namespace trestle::conform {

/// Sends sequences. Its UDP port is the same for all, also in another run: sequences name it.
class Player {
 public:
  static constexpr std::uint16_t own_port = 40'490;

  /// @throws TesterError when the port is not free.
  Player(const Profile& profile, Tester& tester, SdSessions& sessions);

  /// Sends all steps, and takes what comes meanwhile.
  void play(const Sequence& sequence);
  /// Ends all connections.
  void close_connections();
  /// The tester seems to have been restarted.
  void reboot() { sessions_.reboot(); }

  [[nodiscard]] Endpoint own() const { return tester_.local(udp_); }

 private:
  void send_sd(const Step& step, const Endpoint& to);
  void send_tcp(const Step& step);

  const Profile& profile_;
  Tester& tester_;
  SdSessions& sessions_;
  PortId udp_;
  std::map<std::uint16_t, PortId> connections_;  ///< by the device's port
};

/// The steps of a capture that `trestle fuzz` has written, or of any other one: what the tester's address
/// sends to the device's. Of pauses of more than ten seconds ten are kept.
/// @throws std::runtime_error when the file is no capture, or has no such step.
[[nodiscard]] Sequence sequence_of_capture(const std::string& path, const Profile& profile);

}  // namespace trestle::conform
