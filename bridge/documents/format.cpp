#include "bridge/documents/format.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <type_traits>

#include "someip/net/address_text.hpp"

namespace trestle::documents {
namespace {

struct Unit {
  std::string_view name;
  double size;
};

// Largest first, so that printing finds the largest that fits.
constexpr std::array<Unit, 4> time_units{{{"s", 1e9}, {"ms", 1e6}, {"us", 1e3}, {"ns", 1}}};
constexpr std::array<Unit, 3> size_units{{{"MiB", 1048576}, {"KiB", 1024}, {"B", 1}}};

/// A decimal number and a unit, with or without spaces between them, in the smallest unit. No sign, exponent,
/// infinity or NaN. A number without a unit is left to the caller.
template <std::size_t N>
std::optional<double> read_quantity(std::string_view text, const std::array<Unit, N>& units) {
  const std::size_t digits = std::min(text.find_first_not_of("0123456789."), text.size());
  double number = 0;
  const auto [end, failure] =
      std::from_chars(text.data(), text.data() + digits, number, std::chars_format::fixed);
  if (failure != std::errc{} || end != text.data() + digits) {
    return std::nullopt;
  }
  text.remove_prefix(std::min(text.find_first_not_of(' ', digits), text.size()));
  for (const Unit& unit : units) {
    if (text == unit.name) {
      return number * unit.size;
    }
  }
  return std::nullopt;
}

template <std::size_t N>
std::string quantity_to_string(double quantity, const std::array<Unit, N>& units) {
  for (const Unit& unit : units) {
    if (quantity >= unit.size) {
      return fmt::format("{} {}", quantity / unit.size, unit.name);
    }
  }
  return fmt::format("0 {}", units.back().name);
}

template <typename T>
Format<T> bounded(std::string expected, Shape::Kind kind, T min, T max,
                  std::optional<T> (*read)(std::string_view)) {
  Shape shape{.kind = kind};
  if constexpr (std::is_same_v<T, Duration>) {
    shape.min = static_cast<std::uint64_t>(min.count());
    shape.max = static_cast<std::uint64_t>(max.count());
  } else {
    shape.min = min;
    shape.max = max;
  }
  return {std::move(expected),
          [=](std::string_view text) {
            const std::optional<T> value = read(text);
            return value && *value >= min && *value <= max ? value : std::nullopt;
          },
          std::move(shape)};
}

std::optional<Duration> read_duration(std::string_view text) {
  const auto nanoseconds = text == "0" ? 0.0 : read_quantity(text, time_units);
  if (!nanoseconds || *nanoseconds > 1e18) {
    return std::nullopt;
  }
  return Duration{std::llround(*nanoseconds)};
}

std::optional<std::uint64_t> read_size(std::string_view text) {
  if (const auto bytes = read_whole(text)) {
    return bytes;
  }
  const auto bytes = read_quantity(text, size_units);
  if (!bytes || *bytes > 1e15 || *bytes != std::floor(*bytes)) {
    return std::nullopt;
  }
  return static_cast<std::uint64_t>(*bytes);
}

}  // namespace

std::optional<std::uint64_t> read_whole(std::string_view text) {
  int base = 10;
  if (text.starts_with("0x") || text.starts_with("0X")) {
    text.remove_prefix(2);
    base = 16;
  } else if (text.size() > 1 && text.front() == '0') {
    return std::nullopt;
  }
  std::uint64_t number = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), number, base);
  if (failure != std::errc{} || end != text.data() + text.size()) {
    return std::nullopt;
  }
  return number;
}

Format<std::uint64_t> whole_number(std::uint64_t min, std::uint64_t max) {
  return bounded(fmt::format("a whole number from {} to {}", min, max), Shape::Kind::number, min, max,
                 read_whole);
}

Format<std::uint64_t> id_number(std::uint64_t min, std::uint64_t max) {
  return bounded(fmt::format("an id from 0x{:04x} to 0x{:04x}", min, max), Shape::Kind::number, min, max,
                 read_whole);
}

Format<bool> truth() {
  auto format = one_of<bool>({{"true", true}, {"false", false}});
  format.expected = "true or false";
  return format;
}

Format<Duration> duration(Duration min, Duration max) {
  return bounded(
      fmt::format("a time from {} to {}, with its unit (ns, us, ms, s)", to_string(min), to_string(max)),
      Shape::Kind::time, min, max, read_duration);
}

Format<std::uint64_t> byte_size(std::uint64_t min, std::uint64_t max) {
  return bounded(
      fmt::format("a size from {} to {} (in B, KiB or MiB)", bytes_to_string(min), bytes_to_string(max)),
      Shape::Kind::size, min, max, read_size);
}

Format<IpAddress> ip_address() {
  return {"an IPv4 or IPv6 address",
          [](std::string_view text) -> std::optional<IpAddress> {
            // C strings end at a NUL byte, which text from a file may hold.
            const bool is_text = text.find('\0') == std::string_view::npos;
            const auto address = is_text ? someip::parse_address(std::string{text}) : std::nullopt;
            return address && !address->is_unspecified() ? address : std::nullopt;
          },
          {.pattern = "^[0-9a-fA-F]*[.:][0-9a-fA-F.:]*$"}};
}

Format<IpAddress> multicast_address() {
  auto result = ip_address();
  result.expected = "a multicast address";
  result.read = [read = std::move(result.read)](std::string_view text) {
    const auto address = read(text);
    return address && address->is_multicast() ? address : std::nullopt;
  };
  return result;
}

Format<std::string> text_that(std::string expected, bool (*is_good)(std::string_view text),
                              std::string pattern) {
  return {std::move(expected),
          [is_good](std::string_view text) {
            return is_good(text) ? std::optional<std::string>{text} : std::nullopt;
          },
          {.pattern = std::move(pattern)}};
}

Format<std::string> any_text(std::string expected) {
  return text_that(std::move(expected), [](std::string_view text) {
    return !text.empty() && text.find('\0') == std::string_view::npos;
  });
}

std::string to_string(Duration duration) {
  return quantity_to_string(static_cast<double>(duration.count()), time_units);
}

std::string bytes_to_string(std::uint64_t bytes) {
  return quantity_to_string(static_cast<double>(bytes), size_units);
}

}  // namespace trestle::documents
