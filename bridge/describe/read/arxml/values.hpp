#pragma once
#include <charconv>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "someip/wire/endpoint.hpp"

namespace trestle::describe::arxml {

/// An integer as AUTOSAR writes it: decimal, 0x…, 0b…, octal with a leading 0, or as "4.0". Nothing: no
/// integer.
[[nodiscard]] std::optional<std::int64_t> integer(std::string_view text);
/// A number with or without fraction, or "INF".
[[nodiscard]] std::optional<double> number(std::string_view text);
[[nodiscard]] std::optional<bool> boolean(std::string_view text);
/// Seconds, as all times of AUTOSAR are, rounded to whole nanoseconds; nothing: no time from 0 to a day.
[[nodiscard]] std::optional<std::chrono::nanoseconds> seconds(std::string_view text);
/// An IPv4 or IPv6 address. "ANY" and what is no address: nothing.
[[nodiscard]] std::optional<IpAddress> address(std::string_view text);

}  // namespace trestle::describe::arxml
