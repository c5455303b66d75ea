#include "bridge/messages/convert/quick/message_shape.hpp"

#include <algorithm>
#include <bit>

#include "bridge/messages/convert/program/wire_forms.hpp"

namespace trestle::messages::quick {
namespace {

/// The size of the count in CDR, and of the length field in SOME/IP.
constexpr std::size_t count_bytes = 4;

}  // namespace

MessageShape::Places MessageShape::places() const noexcept {
  const std::size_t padding = (0 - (to_cdr_ ? front_.writes() : front_.reads())) % count_bytes;
  return {.array = front_.reads() + (to_cdr_ ? 0 : padding) + count_bytes,
          .count = front_.writes() + (to_cdr_ ? padding : 0)};
}

__attribute__((hot)) bool MessageShape::convert(const Shape::Conversion& conversion, ByteView input,
                                                Gathered& result) noexcept {
  if (Shape::key(conversion) != key_ || !front_.fits(conversion, input) || front_.end() != array_op_) {
    return false;
  }
  const Places at = places();
  if (input.size() < at.array) {
    return false;
  }
  const std::size_t bytes = load_u32(&input[at.array - count_bytes], count_order_);
  const std::size_t left = input.size() - at.array;
  if (bytes == 0 || bytes > most_ || bytes > left || left - bytes < bytes_behind_ ||
      (!may_be_longer_ && left - bytes - bytes_behind_ >= 4)) {
    return false;
  }
  const std::byte* const array = input.data() + at.array;
  for (std::size_t i = 0; i < bytes_behind_; ++i) {
    if (array[bytes + i] != behind_[i]) {
      return false;
    }
  }
  std::byte* const to = front_.write_here(input.data());
  store_u32(to + at.count, static_cast<std::uint32_t>(bytes), count_order_to_);
  const std::size_t ahead = to_cdr_ ? encapsulation_bytes : 0;
  slices_ = {
      {{to - ahead, ahead + at.count + count_bytes}, {array, bytes}, {output_behind_.data(), bytes_behind_}}};
  result = {std::span{slices_.data(), bytes_behind_ > 0 ? 3U : 2U},
            slices_[0].size() + bytes + bytes_behind_};
  return true;
}

void MessageShape::learn(const Program& program, const Shape::Conversion& conversion, ByteView input,
                         const Gathered& made) noexcept {
  key_ = 0;
  if (!front_.fitted() || front_.end() != program.quick.array_at) {
    return;
  }
  to_cdr_ = conversion.to_cdr;
  const std::endian length = length_order(program.rules);
  count_order_ = to_cdr_ ? length : conversion.order;
  count_order_to_ = to_cdr_ ? std::endian::native : length;
  const std::size_t array_at = places().array;
  const std::size_t bytes = load_u32(&input[array_at - count_bytes], count_order_);
  // Single bytes, the same number on both sides; see choose().
  const ByteView behind = input.subspan(array_at + bytes);
  if (behind.size() > most_bytes_behind || made.slices.back().size() < behind.size()) {
    return;
  }
  array_op_ = front_.end();
  most_ = program.ops[array_op_].bound;
  may_be_longer_ = to_cdr_ || program.may_be_longer;
  bytes_behind_ = static_cast<std::uint8_t>(behind.size());
  std::ranges::copy(behind, behind_.begin());
  std::ranges::copy(made.slices.back().last(behind.size()), output_behind_.begin());
  key_ = Shape::key(conversion);
}

}  // namespace trestle::messages::quick
