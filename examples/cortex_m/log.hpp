#pragma once
#include <array>
#include <concepts>
#include <string_view>

#include <trestle/someip/wire/endpoint.hpp>

#include "board/startup.hpp"

namespace trestle::example {

/// A line for the console of the emulator or debugger: Line{} << "port " << 30509; it is written at the end
/// of the expression. What goes beyond 95 characters is cut off. Without emulator and debugger semihosting is
/// a fault: a product has its own way out here, say a serial port.
class Line {
 public:
  Line() = default;
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;
  ~Line() {
    text_[size_] = '\n';
    board_semihosting(0x04, text_.data());  // SYS_WRITE0: up to a zero
  }

  Line& operator<<(std::string_view text) noexcept {
    for (const char character : text) {
      if (size_ < text_.size() - 2) {
        text_[size_++] = character;
      }
    }
    return *this;
  }

  Line& operator<<(std::unsigned_integral auto number) noexcept {
    std::array<char, 20> digits{};
    std::size_t first = digits.size();
    do {
      digits[--first] = static_cast<char>('0' + number % 10);
      number = static_cast<decltype(number)>(number / 10);
    } while (number != 0);
    return *this << std::string_view{digits.data() + first, digits.size() - first};
  }

  /// An IPv4 endpoint.
  Line& operator<<(const Endpoint& endpoint) noexcept {
    for (std::size_t i = 0; i < 4; ++i) {
      *this << endpoint.address.bytes[i] << (i < 3 ? "." : ":");
    }
    return *this << endpoint.port;
  }

 private:
  std::array<char, 97> text_{};
  std::size_t size_ = 0;
};

}  // namespace trestle::example
