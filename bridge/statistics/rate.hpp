#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace trestle::statistics {

/// How often something comes, and how many bytes come with it: over the last two to four seconds. Taking note
/// of one costs a comparison and two additions, and nothing has to look at it in between.
class Rate {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  static constexpr std::chrono::seconds window{2};

  void note(TimePoint now, std::size_t bytes) noexcept;

  /// In a second.
  struct Value {
    double count = 0;
    double bytes = 0;
  };
  /// 0 when nothing has come for two windows.
  [[nodiscard]] Value at(TimePoint now) const noexcept;

 private:
  struct Window {
    TimePoint start{};
    std::uint64_t count = 0;
    std::uint64_t bytes = 0;
  };
  Window now_;     ///< begins with the first that came in it
  Window before_;  ///< ends where that begins
};

}  // namespace trestle::statistics
