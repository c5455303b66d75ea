#include "bridge/convert/byte_swap.hpp"

namespace trestle::bridge {
namespace {

template <typename Number>
void swap_each(std::byte* to, const std::byte* from, std::size_t count) noexcept {
  for (std::size_t i = 0; i < count; ++i) {
    Number number;
    std::memcpy(&number, from + i * sizeof(Number), sizeof(Number));
    number = swapped(number);
    std::memcpy(to + i * sizeof(Number), &number, sizeof(Number));
  }
}

}  // namespace

void copy_swapped(std::byte* to, const std::byte* from, std::size_t count, std::size_t width) noexcept {
  switch (width) {
    case 2:
      return swap_each<std::uint16_t>(to, from, count);
    case 4:
      return swap_each<std::uint32_t>(to, from, count);
    case 8:
      return swap_each<std::uint64_t>(to, from, count);
    default:
      if (count != 0) {
        std::memcpy(to, from, count * width);
      }
  }
}

}  // namespace trestle::bridge
