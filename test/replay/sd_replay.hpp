// test/replay: our core in the place of one host of a recorded conversation.
//
//   recording.hpp      the datagrams and connections of a capture
//   recorded_life.hpp  what the application of a recorded host wanted, read off what it sent
//   sd_replay.hpp      runs our service discovery in its place, and compares
//   sd_replay_test.cpp, messages_test.cpp  the captures of pcaps/vsomeip
#pragma once
#include <string>
#include <vector>

#include "sd/core/service_discovery.hpp"
#include "test/replay/recording.hpp"

namespace trestle::test {

/// An SD entry that a side sent, in words: its kind, every field, and its options in alphabetical order.
struct Said {
  Duration time{};
  Endpoint to;
  sd::EntryKind kind{};
  std::string text;
};

/// What the recorded side was told by its configuration.
struct ReplayTiming {
  Duration repetitions_base_delay{};
  Duration cyclic_offer_delay{};
};

/// Something received or decided, for judging differences.
struct ReplayContext {
  std::vector<Duration> finds_received;
  std::vector<Duration> offers_received;
  std::vector<Duration> offered;  ///< first multicast Offer of each life of an offer
};

/// How a recorded side and our machine in its place compare.
struct ReplayResult {
  std::size_t same = 0;           ///< entries that both sent to the same place, at the same time within 10 ms
  std::vector<Said> only_theirs;  ///< what remains
  std::vector<Said> only_ours;
  std::vector<std::string> broken;  ///< rules that our own datagrams break: sessions, flags, format
  std::size_t new_ports = 0;        ///< how often the recorded client changed a port; ours keeps the first
  ReplayContext context;
};

inline constexpr Duration replay_tolerance = std::chrono::milliseconds{10};

/// Puts our service discovery into the place of `who` in a recorded conversation. What the application of
/// that side wanted, and when, is read off what it sent: services offered and withdrawn, services sought,
/// eventgroups subscribed to and left, with their endpoints. All else is our machine's doing: it is given, at
/// their times, the datagrams that the others sent, and the TCP connections that were made to it.
ReplayResult replay(const Recording& recording, const IpAddress& who, const ReplayTiming& timing);

}  // namespace trestle::test
