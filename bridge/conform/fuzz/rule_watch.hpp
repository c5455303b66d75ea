#pragma once
#include <deque>
#include <string>
#include <vector>

#include "bridge/conform/packet.hpp"
#include "someip/wire/endpoint.hpp"

namespace trestle::conform {

/// A rule of `trestle conform replay` that a device broke.
struct BrokenRule {
  std::string id{};
  std::string what{};  ///< "Session ID is 0, expected not 0"
};

/// The rule that a request is answered once. A late answer to an earlier sequence may break it, so that it
/// counts only when a second run shows the same.
inline constexpr const char* answered_once = "rpc.answered-once";

/// Judges what the device sent, by the rules that hold whatever it was sent. Rules of answers to requests are
/// not among them: what is sent here is no proper request in the first place.
[[nodiscard]] std::vector<BrokenRule> broken_rules(const std::deque<Packet>& packets,
                                                   const IpAddress& device);

}  // namespace trestle::conform
