#include "sd/core/receive_buffer.hpp"

#include <limits>

namespace trestle::sd {
namespace {

std::uint32_t number_in(std::string_view text) noexcept {
  constexpr std::uint32_t most = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t number = 0;
  for (const char digit : text) {
    if (digit < '0' || digit > '9') {
      return 0;
    }
    const auto unit = static_cast<std::uint32_t>(digit - '0');
    number = number > (most - unit) / 10 ? most : 10 * number + unit;
  }
  return number;
}

}  // namespace

ReceiveBufferOption::ReceiveBufferOption(std::uint32_t bytes) noexcept {
  std::array<char, 10> digits{};  // from the last one on
  std::size_t first = digits.size();
  do {
    digits[--first] = static_cast<char>('0' + bytes % 10);
    bytes /= 10;
  } while (bytes > 0);
  const std::string_view number{digits.data() + first, digits.size() - first};
  const std::array items{ConfigurationItem{receive_buffer_key, number}};
  const auto option = encode_configuration(items, body_);
  size_ = option ? option->body.size() : 0;  // it always fits
}

std::uint32_t receive_buffer_in(ConfigurationCursor configuration) noexcept {
  while (const auto item = configuration.next()) {
    if (item->key == receive_buffer_key) {
      return item->value ? number_in(*item->value) : 0;
    }
  }
  return 0;
}

}  // namespace trestle::sd
