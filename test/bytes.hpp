#pragma once
#include <cctype>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "someip/wire/types.hpp"

namespace trestle::test {

/// Bytes from hexadecimal digits; white space between them is skipped: "1234 8001 0000000c".
inline std::vector<std::byte> hex(std::string_view digits) {
  std::vector<std::byte> result;
  int high = -1;
  for (const char digit : digits) {
    if (std::isspace(static_cast<unsigned char>(digit)) != 0) {
      continue;
    }
    const int nibble = digit >= '0' && digit <= '9'   ? digit - '0'
                       : digit >= 'a' && digit <= 'f' ? digit - 'a' + 10
                       : digit >= 'A' && digit <= 'F'
                           ? digit - 'A' + 10
                           : throw std::invalid_argument{"not a hexadecimal digit"};
    if (high < 0) {
      high = nibble;
    } else {
      result.push_back(static_cast<std::byte>(high * 16 + nibble));
      high = -1;
    }
  }
  if (high >= 0) {
    throw std::invalid_argument{"odd number of hexadecimal digits"};
  }
  return result;
}

/// Bytes as lower-case hexadecimal digits, so that a failed comparison can be read.
inline std::string to_hex(ByteView bytes) {
  std::string result;
  for (const std::byte byte : bytes) {
    constexpr std::string_view digits = "0123456789abcdef";
    result += digits[std::to_integer<unsigned>(byte) >> 4U];
    result += digits[std::to_integer<unsigned>(byte) & 15U];
  }
  return result;
}

}  // namespace trestle::test
