#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstring>
#include <type_traits>

#include "someip/wire/types.hpp"

namespace trestle::someip {

template <std::unsigned_integral T>
[[nodiscard]] constexpr T byteswap(T number) noexcept {
  if constexpr (sizeof(T) == 1) {
    return number;
  } else if constexpr (sizeof(T) == 2) {
    return __builtin_bswap16(number);
  } else if constexpr (sizeof(T) == 4) {
    return __builtin_bswap32(number);
  } else {
    static_assert(sizeof(T) == 8);
    return __builtin_bswap64(number);
  }
}

/// Loads an integer in the given byte order from possibly unaligned memory of at least sizeof(T) bytes.
/// Compiles to a move, and a swap where the order is not the machine's.
template <std::unsigned_integral T>
[[nodiscard]] constexpr T load(const std::byte* from, std::endian order = std::endian::big) noexcept {
  std::array<std::byte, sizeof(T)> bytes{};
  if (std::is_constant_evaluated()) {
    std::copy_n(from, sizeof(T), bytes.begin());
  } else {
    std::memcpy(bytes.data(), from, sizeof(T));  // a move, also with -Os
  }
  const T number = std::bit_cast<T>(bytes);
  return order == std::endian::native ? number : byteswap(number);
}

/// Stores an integer in the given byte order into possibly unaligned memory of at least sizeof(T) bytes.
template <std::unsigned_integral T>
constexpr void store(std::byte* to, T number, std::endian order = std::endian::big) noexcept {
  const auto bytes = std::bit_cast<std::array<std::byte, sizeof(T)>>(
      order == std::endian::native ? number : byteswap(number));
  if (std::is_constant_evaluated()) {
    std::copy_n(bytes.begin(), sizeof(T), to);
  } else {
    std::memcpy(to, bytes.data(), sizeof(T));
  }
}

/// Reads numbers from the front of a view. The first read beyond the end fails the reader for good: reads
/// after that give zero and empty views, so a codec reads all its fields and asks failed() once.
class ByteReader {
 public:
  explicit constexpr ByteReader(ByteView bytes, std::endian order = std::endian::big) noexcept
      : bytes_{bytes}, order_{order} {}

  constexpr std::uint8_t u8() noexcept { return number<std::uint8_t>(); }
  constexpr std::uint16_t u16() noexcept { return number<std::uint16_t>(); }
  constexpr std::uint32_t u32() noexcept { return number<std::uint32_t>(); }
  constexpr std::uint64_t u64() noexcept { return number<std::uint64_t>(); }

  /// The next `size` bytes, as a view into the input.
  constexpr ByteView take(std::size_t size) noexcept {
    if (failed_ || size > bytes_.size() - position_) {
      failed_ = true;
      return {};
    }
    const ByteView taken = bytes_.subspan(position_, size);
    position_ += size;
    return taken;
  }

  constexpr void skip(std::size_t size) noexcept { take(size); }
  [[nodiscard]] constexpr ByteView rest() const noexcept {
    return failed_ ? ByteView{} : bytes_.subspan(position_);
  }
  /// How many bytes have been read. After a failure: where the read that failed began.
  [[nodiscard]] constexpr std::size_t position() const noexcept { return position_; }
  [[nodiscard]] constexpr bool failed() const noexcept { return failed_; }
  constexpr void order(std::endian order) noexcept { order_ = order; }

 private:
  template <std::unsigned_integral T>
  constexpr T number() noexcept {
    const ByteView bytes = take(sizeof(T));
    return bytes.empty() ? T{0} : load<T>(bytes.data(), order_);
  }

  ByteView bytes_;
  std::size_t position_ = 0;
  std::endian order_;
  bool failed_ = false;
};

/// Writes numbers to the front of a buffer. The first beyond its end fails it for good: see failed().
class ByteWriter {
 public:
  explicit constexpr ByteWriter(ByteSpan room, std::endian order = std::endian::big) noexcept
      : room_{room}, order_{order} {}

  constexpr void u8(std::uint8_t number) noexcept { put(number); }
  constexpr void u16(std::uint16_t number) noexcept { put(number); }
  constexpr void u32(std::uint32_t number) noexcept { put(number); }
  constexpr void u64(std::uint64_t number) noexcept { put(number); }

  constexpr void bytes(ByteView bytes) noexcept {
    const ByteSpan place = reserve(bytes.size());
    if (!place.empty()) {
      std::memcpy(place.data(), bytes.data(), bytes.size());
    }
  }

  /// The next `size` bytes of the buffer, for the caller to fill; empty when there is no room.
  constexpr ByteSpan reserve(std::size_t size) noexcept {
    if (failed_ || size > room_.size() - position_) {
      failed_ = true;
      return {};
    }
    const ByteSpan place = room_.subspan(position_, size);
    position_ += size;
    return place;
  }

  [[nodiscard]] constexpr std::size_t position() const noexcept { return position_; }
  [[nodiscard]] constexpr ByteSpan written() const noexcept { return room_.first(position_); }
  [[nodiscard]] constexpr bool failed() const noexcept { return failed_; }

 private:
  template <std::unsigned_integral T>
  constexpr void put(T number) noexcept {
    const ByteSpan place = reserve(sizeof(T));
    if (!place.empty()) {
      store(place.data(), number, order_);
    }
  }

  ByteSpan room_;
  std::size_t position_ = 0;
  std::endian order_;
  bool failed_ = false;
};

}  // namespace trestle::someip
