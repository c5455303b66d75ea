#include "bridge/messages/map/number_map.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace trestle::messages {
namespace {

/// What a number loses by becoming whole, up to here, is not worth counting: whole numbers of 16 bits lose
/// less on the way through a scale and a float32, and come back as they were.
constexpr double little = 1.0 / 64;

/// The largest magnitude of whole numbers of a type; of negative ones it is one more.
std::uint64_t most(Primitive type) noexcept {
  const unsigned bits = 8U * width(type) - (is_signed_whole(type) ? 1U : 0U);
  return type == Primitive::boolean ? 1 : bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
}

std::uint64_t cut(std::uint64_t bits, Primitive type) noexcept {
  const unsigned unused = 64U - 8U * width(type);
  return bits << unused >> unused;
}

/// From one whole number to another.
std::uint64_t whole_of(std::uint64_t bits, Primitive from, Primitive to, MapCounters& counters) noexcept {
  const std::int64_t number = NumberMap::whole(bits, from);
  const bool is_negative = is_signed_whole(from) && number < 0;
  const std::uint64_t largest = most(to);
  const std::int64_t least = is_signed_whole(to) ? -static_cast<std::int64_t>(largest) - 1 : 0;
  if (is_negative ? number < least : static_cast<std::uint64_t>(number) > largest) {
    ++counters.saturated;
    return cut(is_negative ? static_cast<std::uint64_t>(least) : largest, to);
  }
  return cut(static_cast<std::uint64_t>(number), to);
}

}  // namespace

bool NumberMap::is_same() const noexcept {
  return are_same(from, to) && scale == 1 && offset == 0 && !has_table;
}

std::int64_t NumberMap::whole(std::uint64_t bits, Primitive from) noexcept {
  const unsigned unused = 64U - 8U * width(from);
  return is_signed_whole(from) ? static_cast<std::int64_t>(bits << unused) >> unused
                               : static_cast<std::int64_t>(bits);
}

double NumberMap::value(std::uint64_t bits, Primitive from) noexcept {
  switch (from) {
    case Primitive::float32:
      return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
    case Primitive::float64:
      return std::bit_cast<double>(bits);
    default:
      return is_signed_whole(from) ? static_cast<double>(whole(bits, from)) : static_cast<double>(bits);
  }
}

std::uint64_t NumberMap::nearest(double number, Primitive to, MapCounters& counters) noexcept {
  if (to == Primitive::float64) {
    return std::bit_cast<std::uint64_t>(number);
  }
  if (to == Primitive::float32) {
    constexpr double largest = std::numeric_limits<float>::max();
    if (std::abs(number) > largest && !std::isinf(number)) {
      ++counters.saturated;
      number = std::copysign(largest, number);
    }
    return std::bit_cast<std::uint32_t>(static_cast<float>(number));
  }
  if (std::isnan(number)) {
    ++counters.not_a_number;
    return 0;
  }
  const double rounded = std::round(number);
  const std::uint64_t largest = most(to);
  // One more than the largest is a power of two, which a double can always say.
  const double end =
      to == Primitive::boolean ? 2.0 : std::ldexp(1.0, static_cast<int>(std::bit_width(largest)));
  const double least = is_signed_whole(to) ? -end : 0.0;
  if (rounded < least || rounded >= end) {
    ++counters.saturated;
    return rounded < least ? cut(is_signed_whole(to) ? ~largest : 0, to) : largest;
  }
  if (std::abs(rounded - number) > little) {
    ++counters.rounded;
  }
  return cut(rounded < 0 ? static_cast<std::uint64_t>(static_cast<std::int64_t>(rounded))
                         : static_cast<std::uint64_t>(rounded),
             to);
}

bool NumberMap::convert(std::uint64_t& bits, MapCounters& counters) const noexcept {
  if (has_table) {
    const std::int64_t number = whole(bits, from);
    const auto found = std::ranges::lower_bound(table, number, {}, &Entry::from);
    if (found != table.end() && found->from == number) {
      bits = found->to;
      return true;
    }
    if (otherwise != Otherwise::keep) {
      bits = otherwise_bits;
      return otherwise == Otherwise::value;
    }
  }
  if (scale == 1 && offset == 0 && !is_real(from) && !is_real(to)) {
    bits = whole_of(bits, from, to, counters);
  } else {
    const double number = value(bits, from);
    bits = nearest(backwards ? (number - offset) / scale : scale * number + offset, to, counters);
  }
  return true;
}

}  // namespace trestle::messages
