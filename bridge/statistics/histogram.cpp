#include "bridge/statistics/histogram.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace trestle::statistics {
namespace {

// The first 2^exact_bits buckets hold one value each; every further half as many hold twice as many as those
// before.
std::size_t index_of(std::int64_t value, unsigned exact_bits) noexcept {
  const auto bits = static_cast<std::uint64_t>(value);
  const auto width = static_cast<unsigned>(std::bit_width(bits));
  const unsigned shift = width > exact_bits ? width - exact_bits : 0;
  return (static_cast<std::size_t>(shift) << (exact_bits - 1)) + (bits >> shift);
}

std::int64_t largest_of(std::size_t index, unsigned exact_bits) noexcept {
  const std::size_t half = std::size_t{1} << (exact_bits - 1);
  const std::size_t shift = index < 2 * half ? 0 : index / half - 1;
  return static_cast<std::int64_t>(((index - shift * half + 1) << shift) - 1);
}

}  // namespace

Histogram::Histogram(unsigned exact_bits)
    : exact_bits_{exact_bits}, counts_(index_of(largest, exact_bits) + 1) {}

void Histogram::add(std::int64_t value) noexcept {
  value = std::clamp<std::int64_t>(value, 0, largest);
  ++counts_[index_of(value, exact_bits_)];
  ++count_;
  min_ = std::min(min_, value);
  max_ = std::max(max_, value);
  sum_ += static_cast<double>(value);
}

double Histogram::mean() const noexcept {
  return count_ == 0 ? 0 : sum_ / static_cast<double>(count_);
}

std::int64_t Histogram::percentile(double percent) const noexcept {
  // 99.9 is not exact as a double, but 99.9 % of 1000 must be 999.
  constexpr double rounding = 1e-6;
  const double share = std::clamp(percent, 0.0, 100.0) * static_cast<double>(count_) / 100;
  const auto rank = static_cast<std::uint64_t>(std::max(1.0, std::ceil(share - rounding)));
  std::uint64_t below = 0;
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    below += counts_[i];
    if (below >= rank) {
      return std::min(largest_of(i, exact_bits_), max_);
    }
  }
  return max_;
}

std::vector<Histogram::Bucket> Histogram::buckets() const {
  std::vector<Bucket> result;
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    if (counts_[i] != 0) {
      result.push_back({largest_of(i, exact_bits_), counts_[i]});
    }
  }
  return result;
}

}  // namespace trestle::statistics
