#pragma once
#include <bitset>
#include <map>
#include <tuple>
#include <vector>

#include "pcaps/network.hpp"

namespace trestle::pcaps {

/// Puts the fragments of IPv4 and IPv6 packets together again, in whatever order they come. Bytes that come
/// twice keep their first value.
class IpFragments {
 public:
  struct Limits {
    std::size_t max_packets = 64;  ///< incomplete at a time; one more drops the oldest
    std::chrono::nanoseconds max_age = std::chrono::seconds{30};
  };

  explicit IpFragments(const Limits& limits) : limits_{limits} {}

  /// Takes a packet that is a fragment.
  /// @return the packet that it completes, valid until the next call; nothing while some are missing; or
  ///         FrameFault::fragment for one that cannot be, with its packet dropped.
  [[nodiscard]] FrameResult<std::optional<IpPacket>> add(const IpPacket& packet, Timestamp now);

  /// Packets given up: too old, too many at a time, or with a broken or cut fragment.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }
  /// Packets that still miss fragments.
  [[nodiscard]] std::size_t incomplete() const noexcept { return partials_.size(); }

 private:
  using Key = std::tuple<IpAddress, IpAddress, std::uint8_t, std::uint32_t>;
  static constexpr std::size_t block_bytes = 8;  // what fragment offsets count in
  static constexpr std::size_t max_blocks = 8192;
  struct Partial {
    std::vector<std::byte> bytes;
    std::bitset<max_blocks> present;
    std::optional<std::size_t> total_bytes;
    Timestamp since;
  };

  void make_room(Timestamp now);

  Limits limits_;
  std::map<Key, Partial> partials_;
  std::vector<std::byte> whole_;
  std::uint64_t dropped_ = 0;
};

}  // namespace trestle::pcaps
