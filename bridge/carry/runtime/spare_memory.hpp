#pragma once
#include <algorithm>
#include <boost/asio/steady_timer.hpp>
#include <cstddef>

namespace trestle::carry {

/// When memory that was freed goes back to the system. The allocator keeps what lies between things in use,
/// and after a time of slow subscribers that is as much as the samples that waited for them.
class SpareMemoryRule {
 public:
  static constexpr std::size_t worth_it = 4'000'000;  ///< bytes; below, what is freed is soon used again
  static constexpr int longest_wait = 4;              ///< looks, for a bridge that needs it again and again

  /// Whether to give back now. unused: bytes that the process has and does not use.
  [[nodiscard]] bool is_due(std::size_t unused) {
    kept_ = std::min(kept_, unused);
    if (unused < kept_ + worth_it) {
      wait_ = 1;
      passed_ = 0;
      return false;
    }
    if (++passed_ < wait_) {
      return false;
    }
    passed_ = 0;
    wait_ = std::min(2 * wait_, longest_wait);
    return true;
  }
  /// Memory was given back; so much is left that could not be.
  void given_back(std::size_t unused) { kept_ = unused; }

 private:
  std::size_t kept_ = 0;
  int wait_ = 1;
  int passed_ = 0;
};

/// Looks once a second, for the whole process; where the C library is glibc. Made before DDS has threads:
/// each would get an arena of its own, and what lies unused in one is of no use to the others.
class SpareMemory {
 public:
  static constexpr int most_arenas = 2;
  /// Allocations of so many bytes, and what lies unused at the end of an arena, go back at once. What is
  /// smaller does not: a sample would have each of its pages made anew. The most that glibc permits.
  static constexpr int most_kept = 32 << 20;

  explicit SpareMemory(boost::asio::io_context& io);

 private:
  void wait();
  void look();

  boost::asio::steady_timer timer_;
  SpareMemoryRule rule_;
};

}  // namespace trestle::carry
