#pragma once
#include "bridge/messages/convert/quick/loop.hpp"

namespace trestle::messages::quick {

/// Single operations of the loop from SOME/IP to CDR. False: left to others, and nothing was done.
template <bool is_usual>
class LoopToCdr : LoopWay<is_usual> {
  using Base = LoopWay<is_usual>;
  using Base::at_, Base::in_, Base::to_;
  using Base::left, Base::space, Base::strings, Base::width_of_length, Base::is_swapped, Base::is_long;

 public:
  using Base::bools, Base::position, Base::written;

  LoopToCdr(const Source& source, std::size_t at, std::size_t limit, Output& out)
      : Base{source, at, limit, out},
        alignment_{out.position() - encapsulation_bytes - reinterpret_cast<std::uintptr_t>(to_)} {}

  __attribute__((always_inline)) bool numbers(const Op& op) {
    const auto count = static_cast<std::size_t>(op.count);
    const std::size_t bytes = count * op.width;
    if (bytes > left() || bytes + most_padding + 1 > space()) {
      return false;
    }
    align(op.width);
    copy_few_numbers(to_, in_ + at_, count, op.width, is_swapped(op));
    at_ += bytes;
    to_ += bytes;
    return true;
  }

  __attribute__((always_inline)) bool string(const Op& op) {
    const QuickFrame frame = strings();
    const someip::FieldWidth width = width_of_length(op);
    const std::size_t ahead = bytes(width);
    if (ahead + sizeof frame.bom > left()) {
      return false;
    }
    const std::byte* const from = in_ + at_ + ahead;
    const std::size_t length = load_length(in_ + at_, width, frame.length_order);
    const std::size_t text = length - frame.overhead();
    std::uint32_t bom = 0;
    std::memcpy(&bom, from, sizeof bom);
    if (length > left() - ahead || length < frame.overhead() || text >= short_text || text > op.bound ||
        4 + text + 1 + most_padding > space() || (bom & frame.bom_mask) != frame.bom) {
      return false;
    }
    const std::byte* const characters = from + frame.bom_bytes;
    const std::size_t there = std::min(left() - ahead - frame.bom_bytes, space() - most_padding - 4);
    std::byte* const before = to_;
    align(4);
    const bool no_zero = copy_text(to_ + 4, characters, text, there);
    if (frame.has_terminator && (!no_zero || characters[text] != std::byte{0})) {
      to_ = before;
      return false;
    }
    store_u32(to_, static_cast<std::uint32_t>(text + 1), std::endian::native);
    to_[4 + text] = std::byte{0};
    to_ += 4 + text + 1;
    at_ += ahead + length;
    return true;
  }

  __attribute__((always_inline)) bool array(const Op& op) {
    const someip::FieldWidth width = width_of_length(op);
    const std::size_t ahead = bytes(width);
    if (ahead > left()) {
      return false;
    }
    const std::size_t length = load_length(in_ + at_, width, strings().length_order);
    if (length > left() - ahead || 4 + length + 2 * most_padding + 1 > space()) {
      return false;
    }
    std::uint64_t elements = 0;
    if (length != 0) {
      const std::uint64_t element_bytes = op.count * op.width;
      elements = op.count == 1 ? length >> std::countr_zero(op.width) : length / element_bytes;
      if (op.loop == Op::Loop::if_empty || elements > op.bound || elements * element_bytes != length ||
          is_long(op, length)) {
        return false;
      }
    }
    align(4);
    store_u32(to_, static_cast<std::uint32_t>(elements), std::endian::native);
    to_ += 4;
    if (length != 0) {
      align(op.width);
      copy_array(to_, in_ + at_ + ahead, length, op.width, is_swapped(op));
    }
    to_ += length;
    at_ += ahead + length;
    return true;
  }

 private:
  static constexpr std::size_t most_padding = 7;

  __attribute__((always_inline)) void align(std::size_t width) {
    std::memset(to_, 0, most_padding + 1);
    to_ += (0 - (alignment_ + reinterpret_cast<std::uintptr_t>(to_))) & (width - 1);
  }

  std::uintptr_t alignment_;  ///< what added to an address in the output gives the place in CDR
};

}  // namespace trestle::messages::quick
