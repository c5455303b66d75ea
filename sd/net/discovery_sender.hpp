#pragma once
#include <algorithm>
#include <functional>
#include <list>
#include <optional>
#include <utility>
#include <vector>

#include "sd/net/node_config.hpp"
#include "someip/net/udp_socket.hpp"

namespace trestle::sd {

/// Datagrams of discovery that the system did not take, in their order, until it does. What is for one
/// receiver leaves in this order, as their sessions tell.  [feat_req_someipsd_41]
class WaitingDatagrams {
 public:
  /// When there is no room for all, datagrams to the group and to known hosts go before all others.
  enum class Rank : std::uint8_t { first, others };
  struct Drops {
    std::uint64_t no_room = 0;  ///< more waited than may
    std::uint64_t too_old = 0;  ///< it waited too long, and may tell what is no more
  };

  /// @param most     datagrams that may wait.
  /// @param max_age  for which each may.
  WaitingDatagrams(std::size_t most, Duration max_age) noexcept : most_{most}, max_age_{max_age} {}

  [[nodiscard]] bool empty() const noexcept { return waiting_.empty(); }
  [[nodiscard]] std::size_t size() const noexcept { return waiting_.size(); }
  /// Whether something waits that a datagram for this receiver must not overtake.
  [[nodiscard]] bool any_for(const Endpoint& to) const noexcept;

  /// If there is no room, the oldest datagram of Rank::others is dropped; if there is none, this one.
  /// @param heard_here  see retry().
  void add(const Endpoint& to, ByteView bytes, Rank rank, bool heard_here, TimePoint now);
  [[nodiscard]] bool any_first() const noexcept;

  /// Tries each once, but for those whose receiver has just not been sent an earlier one.
  /// @param attempt  (const Endpoint& to, ByteView bytes, bool& heard_here) -> SendStatus; must not call us.
  ///                 `heard_here`: a multicast that did not leave, but has reached the members of its group
  ///                 on this host. What it is set to is kept for the next try.
  /// @return how many wait no more, as they were sent or refused.
  template <typename Attempt>
  std::size_t retry(TimePoint now, Attempt attempt) {
    drop_old(now);
    blocked_.clear();
    return waiting_.remove_if([&](Waiting& one) {
      if (std::ranges::find(blocked_, one.to) != blocked_.end()) {
        return false;
      }
      const bool done =
          attempt(one.to, ByteView{one.bytes}, one.heard_here) != someip::SendStatus::would_block;
      if (!done) {
        blocked_.push_back(one.to);
      }
      return done;
    });
  }

  /// @return how many are dropped so.
  std::size_t clear() noexcept;
  /// What was dropped since the last call.
  [[nodiscard]] Drops take_drops() noexcept { return std::exchange(drops_, {}); }

 private:
  struct Waiting {
    Endpoint to;
    std::vector<std::byte> bytes;
    Rank rank;
    bool heard_here;
    TimePoint since;
  };
  void drop_old(TimePoint now);

  std::size_t most_;
  Duration max_age_;
  std::list<Waiting> waiting_;
  std::vector<Endpoint> blocked_;  ///< of one retry(); kept to reuse its memory
  Drops drops_;
};

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
  /// How long a datagram may wait: as long as the system looks for a neighbour. Discovery repeats itself.
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
