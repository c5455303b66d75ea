#pragma once
#include <functional>
#include <optional>

#include "sd/net/node_config.hpp"
#include "sd/net/waiting_datagrams.hpp"

namespace trestle::sd {

/// Sends the datagrams of discovery. What the system does not take now waits and is tried again: its buffer
/// or its table of neighbours is full, which says nothing about the receiver.
///
/// A datagram to a host that does not answer to its address stays in the send buffer for seconds. So there
/// are two buffers: that of the group's socket, and that of the socket for single receivers. When the latter
/// is full, hosts that are known to be there get their datagrams by the group's socket.
class DiscoverySender {
 public:
  /// How the two buffers are reached; each leaves errno when it does not send.
  struct Ways {
    std::function<someip::SendStatus(const Endpoint& to, ByteView bytes)> single;
    /// @param heard_here  a multicast has reached this host's members of the group, and is not to again.
    std::function<someip::SendStatus(const Endpoint& to, ByteView bytes, bool heard_here)> group;
    std::function<bool(const IpAddress& host)> known;
  };
  static constexpr Duration retry_min = std::chrono::milliseconds{2};
  static constexpr Duration retry_max = std::chrono::milliseconds{32};
  /// The least where only unknown hosts are waited for: they must not take each place that becomes free in
  /// the table of neighbours before hosts that send messages can.
  static constexpr Duration retry_unknown = std::chrono::milliseconds{16};
  /// How long a datagram may wait: as long as the system looks for a neighbour. Discovery repeats what
  /// matters.
  static constexpr Duration max_age = std::chrono::seconds{3};

  /// @param counters  those of discovery's datagrams are kept there.
  DiscoverySender(Ways ways, std::size_t max_waiting, NodeCounters& counters)
      : ways_{std::move(ways)}, waiting_{max_waiting, max_age}, counters_{counters} {}

  /// Sends it now, or later.
  /// @return 0, or the error for which the system refused it: it is lost.
  int send(const Endpoint& to, ByteView bytes, TimePoint now);
  /// Tries again what waits, if it is time.
  void on_time(TimePoint now);
  /// When to call on_time(); nothing: nothing waits.
  [[nodiscard]] std::optional<TimePoint> deadline() const noexcept;
  /// Tries once more what waits, and drops the rest.
  void finish(TimePoint now);
  /// Drops what waits: it would be outdated.
  void forget() noexcept;

 private:
  someip::SendStatus attempt(const Endpoint& to, ByteView bytes, bool& heard_here);
  [[nodiscard]] Duration least_pause() const noexcept {
    return waiting_.any_first() ? retry_min : retry_unknown;
  }
  std::size_t retry(TimePoint now);
  void take_drops() noexcept;

  Ways ways_;
  WaitingDatagrams waiting_;
  NodeCounters& counters_;
  // In this round of tries.
  bool single_full_ = false;
  bool no_neighbours_ = false;  ///< there is no place for another one
  Duration pause_ = retry_min;
  TimePoint next_try_{};
};

}  // namespace trestle::sd
