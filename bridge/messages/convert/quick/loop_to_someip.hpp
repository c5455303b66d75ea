#pragma once
#include "bridge/messages/convert/quick/loop.hpp"

namespace trestle::messages::quick {

/// Single operations of the loop from CDR to SOME/IP. False: left to others, and nothing was done.
template <bool is_usual>
class LoopToSomeip : LoopWay<is_usual> {
  using Base = LoopWay<is_usual>;
  using Base::at_, Base::in_, Base::limit_, Base::to_;
  using Base::space, Base::strings, Base::width_of_length, Base::is_swapped, Base::is_long;

 public:
  using Base::bools, Base::position, Base::written;

  LoopToSomeip(const Source& source, std::size_t at, std::size_t limit, Output& out)
      : Base{source, at, limit, out}, order_{source.order} {}

  __attribute__((always_inline)) bool numbers(const Op& op) {
    const auto count = static_cast<std::size_t>(op.count);
    const std::size_t bytes = count * op.width;
    const std::size_t from = aligned(op.width);
    if (from + bytes > limit_ || bytes > space()) {
      return false;
    }
    copy_few_numbers(to_, in_ + from, count, op.width, is_swapped(op));
    at_ = from + bytes;
    to_ += bytes;
    return true;
  }

  __attribute__((always_inline)) bool string(const Op& op) {
    const QuickFrame frame = strings();
    const std::size_t from = aligned(4) + 4;
    if (from > limit_) {
      return false;
    }
    const std::size_t with_zero = load_u32(in_ + from - 4, order_);
    if (with_zero - 1 >= std::min(short_text, limit_ - from) || in_[from + with_zero - 1] != std::byte{0}) {
      return false;
    }
    const std::size_t text = with_zero - 1;
    const std::size_t length = frame.overhead() + text;
    const someip::FieldWidth width = width_of_length(op);
    const std::size_t ahead = bytes(width);
    if (text > op.bound || !fits(width, length) || ahead + length + surplus > space()) {
      return false;
    }
    std::memcpy(to_ + ahead, &frame.bom, sizeof frame.bom);
    std::byte* const characters = to_ + ahead + frame.bom_bytes;
    const std::size_t there = std::min(limit_ - from, space() - ahead - frame.bom_bytes);
    if (!copy_text(characters, in_ + from, text, there) && frame.has_terminator) {
      return false;
    }
    characters[text] = std::byte{0};
    store_length(to_, width, length, frame.length_order);
    to_ += ahead + length;
    at_ = from + with_zero;
    return true;
  }

  __attribute__((always_inline)) bool array(const Op& op) {
    const std::size_t behind_count = aligned(4) + 4;
    if (behind_count > limit_) {
      return false;
    }
    const someip::FieldWidth width = width_of_length(op);
    const std::size_t ahead = bytes(width);
    const std::uint64_t elements = load_u32(in_ + behind_count - 4, order_);
    if (ahead > space()) {
      return false;
    }
    std::size_t from = behind_count;
    std::size_t length = 0;
    if (elements != 0) {
      const std::uint64_t element_bytes = op.count * op.width;
      from = (from + op.width - 1) & ~std::size_t{op.width - 1U};
      length = static_cast<std::size_t>(elements * element_bytes);
      if (op.loop == Op::Loop::if_empty || elements > op.bound || from > limit_ ||
          exceed(elements, element_bytes, std::min(limit_ - from, space() - ahead)) || !fits(width, length) ||
          is_long(op, length)) {
        return false;
      }
      copy_array(to_ + ahead, in_ + from, length, op.width, is_swapped(op));
    }
    store_length(to_, width, length, strings().length_order);
    to_ += ahead + length;
    at_ = from + length;
    return true;
  }

 private:
  static constexpr std::size_t surplus = 4;  ///< that a store may write beyond the end of a string

  [[nodiscard]] std::size_t aligned(std::size_t width) const noexcept {
    return (at_ + width - 1) & ~(width - 1);
  }

  std::endian order_;
};

}  // namespace trestle::messages::quick
