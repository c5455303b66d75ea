#pragma once
#include <chrono>
#include <functional>
#include <optional>
#include <vector>

#include "someip/wire/endpoint.hpp"

namespace trestle::someip {

/// A client's connection, as it counts when one has to give way to a new one.
struct TcpPlace {
  Endpoint own;  ///< that the client is connected to
  Endpoint client;
  bool spoke = false;   ///< a message has gone over it, either way
  bool silent = false;  ///< nothing has gone over it lately, and no request waits for its answer
  bool unread = false;  ///< something waits for the client, and it has taken nothing of that lately
  std::chrono::steady_clock::time_point last;  ///< when something was last seen to go over it, or its begin
};

/// Which connection gives way to one of an address that has `own` others: all addresses get an equal share.
/// Where they have, one whose client does not read. If all read, one that has been silent for a while, rather
/// one that has never spoken, then the one that spoke the longest ago. Nobody takes it from an address that
/// has less: each could lose all that it seldom uses. One that is in use and read only gives way where its
/// address has more than others, and if all of that are.
[[nodiscard]] std::optional<TcpPlace> who_gives_way(const std::vector<TcpPlace>& places, std::size_t own,
                                                    const std::function<bool(const TcpPlace&)>& in_use);

}  // namespace trestle::someip
