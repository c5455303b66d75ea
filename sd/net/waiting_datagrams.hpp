#pragma once
#include <algorithm>
#include <cstdint>
#include <list>
#include <utility>
#include <vector>

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
  /// Whether one of the first rank waits.
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

}  // namespace trestle::sd
