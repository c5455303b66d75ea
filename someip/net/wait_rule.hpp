#pragma once
#include <cstddef>

namespace trestle::someip {

/// How many messages with one Message ID may wait for one receiver that takes them more slowly than they
/// come, and which of them gives way to a newer one. What has begun to leave does not count. So a slow
/// receiver costs the others nothing: no memory, and no message.
struct WaitRule {
  std::size_t most = 0;      ///< 0: no limit but that of the bytes
  bool keep_oldest = false;  ///< it is the newest that is dropped; else the oldest
};

/// What was done so that a message can be sent by this rule.
struct Room {
  bool granted = true;      ///< false: the new message is the one to be dropped
  std::size_t dropped = 0;  ///< messages that gave way, with the new one if that did
};

/// Where more messages than this wait for a receiver, nobody looks through them: new ones give way.
inline constexpr std::size_t max_looked_through = 1024;

}  // namespace trestle::someip
