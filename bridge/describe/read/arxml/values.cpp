#include "bridge/describe/read/arxml/values.hpp"

#include <arpa/inet.h>

#include <array>
#include <cmath>
#include <cstring>

namespace trestle::describe::arxml {

std::optional<std::int64_t> integer(std::string_view text) {
  const bool negative = text.starts_with('-');
  std::string_view digits = text;
  if (negative || text.starts_with('+')) {
    digits.remove_prefix(1);
  }
  int base = 10;
  if (digits.starts_with("0x") || digits.starts_with("0X")) {
    base = 16;
  } else if (digits.starts_with("0b") || digits.starts_with("0B")) {
    base = 2;
  }
  if (base != 10) {
    digits.remove_prefix(2);
  } else if (digits.size() > 1 && digits.front() == '0' &&
             digits.find_first_not_of("01234567") == std::string_view::npos) {
    base = 8;
  }
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value, base);
  if (error != std::errc{}) {
    return std::nullopt;
  }
  if (end != digits.data() + digits.size()) {
    const std::optional<double> exact = base == 10 ? number(text) : std::nullopt;
    if (!exact || *exact != std::floor(*exact) || std::abs(*exact) >= 9.2e18) {
      return std::nullopt;
    }
    return static_cast<std::int64_t>(*exact);
  }
  // The upper half of uint64 is carried by its bits.
  return static_cast<std::int64_t>(negative ? std::uint64_t{0} - value : value);
}

std::optional<double> number(std::string_view text) {
  if (text.starts_with('+')) {
    text.remove_prefix(1);
  }
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) {
    return std::nullopt;
  }
  return value;
}

std::optional<bool> boolean(std::string_view text) {
  if (text == "true" || text == "1") {
    return true;
  }
  if (text == "false" || text == "0") {
    return false;
  }
  return std::nullopt;
}

std::optional<std::chrono::nanoseconds> seconds(std::string_view text) {
  const std::optional<double> value = number(text);
  constexpr double day = 86'400;
  if (!value || !(*value >= 0) || *value > day) {
    return std::nullopt;
  }
  return std::chrono::nanoseconds{std::llround(*value * 1e9)};
}

std::optional<IpAddress> address(std::string_view text) {
  IpAddress address;
  const std::string zeroed{text};
  if (inet_pton(AF_INET, zeroed.c_str(), address.bytes.data()) == 1) {
    return address;
  }
  address.v6 = true;
  if (inet_pton(AF_INET6, zeroed.c_str(), address.bytes.data()) == 1) {
    return address;
  }
  return std::nullopt;
}

}  // namespace trestle::describe::arxml
