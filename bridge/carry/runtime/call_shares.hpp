#pragma once
#include <chrono>
#include <cstddef>
#include <variant>
#include <vector>

#include "dds_adapter/participant.hpp"
#include "someip/wire/endpoint.hpp"

namespace trestle::carry {

/// Who has a share of the calls: a SOME/IP client by its address, and a ROS client by its participant. A
/// process of ROS 2 has one participant for all its nodes, and costs more to make than a client: with shares
/// for single clients, one process could take the most by having many of them.
using CallerKey = std::variant<IpAddress, dds::GuidPrefix>;

/// Whose calls wait for an answer. While fewer than half of all places are taken anybody may call; beyond
/// that, nobody may have more places than would be left if all who have called lately had the same. So one
/// caller that asks without end keeps no other out, and has all places while it is alone.
class CallShares {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  /// How long a caller counts after its last call, refused ones included.
  static constexpr std::chrono::seconds lately{60};
  static constexpr std::size_t most_callers = 64;  ///< of whom more is known than that they call

  /// @param places  how many calls may wait at once, which somebody else sees to
  explicit CallShares(std::size_t places) : places_{places} {}

  /// Whether another call of this caller may wait; it does, then.
  [[nodiscard]] bool take(const CallerKey& caller, TimePoint now);
  /// Another call of this caller follows on one that has ended just now, and has its place.
  void take_over(const CallerKey& caller);
  /// A call that waited has ended.
  void give_back(const CallerKey& caller);

 private:
  struct Caller {
    CallerKey key;
    std::size_t waiting = 0;
    TimePoint last{};
  };
  [[nodiscard]] Caller* find(const CallerKey& caller);
  [[nodiscard]] Caller* add(const CallerKey& caller);

  std::size_t places_;
  std::size_t waiting_ = 0;
  std::vector<Caller> callers_;
};

}  // namespace trestle::carry
