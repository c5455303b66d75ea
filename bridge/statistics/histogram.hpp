// bridge/statistics: numbers about what happens often, in memory that does not grow.
//
//   histogram.hpp  how long something takes
//   rate.hpp       how often something comes
//
// Nothing here reads a clock: times are given.
#pragma once
#include <cstdint>
#include <vector>

namespace trestle::statistics {

/// Latencies in nanoseconds, counted in the buckets of an HdrHistogram: each is exact up to a size, and from
/// there on as wide as the resolution allows. Its memory does not grow.
class Histogram {
 public:
  /// What is larger counts as this: eighteen minutes.
  static constexpr std::int64_t largest = (std::int64_t{1} << 40) - 1;
  /// Three significant digits: exact below 2048, then in steps of at most 0.1 %. 250 KB.
  static constexpr unsigned fine = 11;
  /// Exact below 16, then in steps of at most 12.5 %. 2.5 KB.
  static constexpr unsigned coarse = 4;

  /// @param exact_bits  values of so many bits have a bucket each.
  explicit Histogram(unsigned exact_bits = fine);

  /// Negative values count as 0.
  void add(std::int64_t value) noexcept;

  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  /// These are 0 when nothing was added.
  [[nodiscard]] std::int64_t min() const noexcept { return count_ == 0 ? 0 : min_; }
  [[nodiscard]] std::int64_t max() const noexcept { return max_; }
  [[nodiscard]] double mean() const noexcept;
  /// Of all that was added.
  [[nodiscard]] double sum() const noexcept { return sum_; }
  /// The largest value of the bucket that the value of this rank (nearest rank) is in, but not above max().
  /// @param percent  0 to 100.
  [[nodiscard]] std::int64_t percentile(double percent) const noexcept;

  /// Values that are counted together.
  struct Bucket {
    std::int64_t up_to = 0;  ///< the largest value that belongs into it
    std::uint64_t count = 0;
    friend bool operator==(const Bucket&, const Bucket&) = default;
  };
  /// Those that are not empty, by value.
  [[nodiscard]] std::vector<Bucket> buckets() const;

 private:
  unsigned exact_bits_;
  std::vector<std::uint64_t> counts_;
  std::uint64_t count_ = 0;
  std::int64_t min_ = largest;
  std::int64_t max_ = 0;
  double sum_ = 0;
};

}  // namespace trestle::statistics
