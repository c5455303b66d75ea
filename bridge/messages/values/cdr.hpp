#pragma once
#include <bit>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

#include "someip/wire/bytes.hpp"

/// Plain CDR (XCDR1), number by number: what the fast paths of bridge/messages/convert do in blocks.
namespace trestle::messages {

/// The unsigned type of the same width.
template <typename T>
using BitsOf =
    std::conditional_t<sizeof(T) == 1, std::uint8_t,
                       std::conditional_t<sizeof(T) == 2, std::uint16_t,
                                          std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>>>;
template <typename T>
[[nodiscard]] constexpr BitsOf<T> bits_of(T number) noexcept {
  return std::bit_cast<BitsOf<T>>(number);
}

/// Reads the body of a sample. Alignment counts from its first byte. The first read beyond the end fails the
/// reader for good: later reads give zero or nothing.
class CdrReader {
 public:
  CdrReader(ByteView body, std::endian order) noexcept : body_{body}, order_{order} {}

  template <std::unsigned_integral T>
  T number() noexcept {
    const std::size_t padding = (0 - position_) & (sizeof(T) - 1);
    take(padding);
    const ByteView bytes = take(sizeof(T));
    return bytes.empty() ? T{0} : someip::load<T>(bytes.data(), order_);
  }
  ByteView take(std::size_t size) noexcept {
    if (failed_ || size > left()) {
      failed_ = true;
      return {};
    }
    const ByteView taken = body_.subspan(position_, size);
    position_ += size;
    return taken;
  }
  void fail() noexcept { failed_ = true; }

  [[nodiscard]] bool failed() const noexcept { return failed_; }
  [[nodiscard]] std::size_t left() const noexcept { return body_.size() - position_; }
  [[nodiscard]] std::size_t position() const noexcept { return position_; }

 private:
  ByteView body_;
  std::size_t position_ = 0;
  std::endian order_;
  bool failed_ = false;
};

/// Writes a sample with its encapsulation header. A sample that would become larger than `max_bytes` fails
/// the writer for good.
class CdrWriter {
 public:
  explicit CdrWriter(std::size_t max_bytes, std::endian order = std::endian::native)
      : sample_{std::byte{0}, static_cast<std::byte>(order == std::endian::little ? 1 : 0), std::byte{0},
                std::byte{0}},
        max_bytes_{max_bytes},
        order_{order} {}

  template <std::unsigned_integral T>
  void number(T number) {
    align(sizeof(T));
    std::byte* const to = room(sizeof(T));
    if (to != nullptr) {
      someip::store(to, number, order_);
    }
  }
  void bytes(ByteView bytes) {
    std::byte* const to = room(bytes.size());
    if (to != nullptr && !bytes.empty()) {
      std::memcpy(to, bytes.data(), bytes.size());
    }
  }

  /// `count` numbers of `width` bytes.
  void zeros(std::size_t count, std::size_t width) {
    align(width);
    if (count > max_bytes_ / width) {
      failed_ = true;
    }
    room(count * width);
  }

  [[nodiscard]] bool failed() const noexcept { return failed_; }
  [[nodiscard]] std::vector<std::byte> take() { return std::move(sample_); }

 private:
  static constexpr std::size_t encapsulation = 4;

  void align(std::size_t width) { room((encapsulation - sample_.size()) & (width - 1)); }
  std::byte* room(std::size_t size) {
    if (failed_ || size > max_bytes_ - sample_.size()) {
      failed_ = true;
      return nullptr;
    }
    sample_.resize(sample_.size() + size);
    return sample_.data() + sample_.size() - size;
  }

  std::vector<std::byte> sample_;
  std::size_t max_bytes_;
  std::endian order_;
  bool failed_ = false;
};

}  // namespace trestle::messages
