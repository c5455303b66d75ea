#include "bridge/messages/convert/quick/message_shape.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>

#include "bridge/messages/convert/program/byte_swap.hpp"
#include "bridge/messages/convert/program/wire_forms.hpp"
#include "bridge/messages/convert/quick/words.hpp"

namespace trestle::messages::quick {
namespace {

/// Of the count in CDR and of the length field in SOME/IP.
constexpr std::size_t count_bytes = 4;
/// More than there ever are.
constexpr std::size_t max_array_bytes = UINT32_MAX;
/// Numbers are read eight bytes at a time, of which the last may be the array's.
constexpr std::size_t least_array_bytes = sizeof(std::uint64_t);

/// In the byte order of memory: the last bytes of a number go, the others move up to them, or down again.
constexpr std::uint64_t without_last(std::uint64_t number, unsigned bits) noexcept {
  return std::endian::native == std::endian::little ? number >> bits : number << bits;
}

}  // namespace

__attribute__((always_inline)) inline bool MessageShape::is_front(const std::byte* input) const noexcept {
  Words difference{};
  const auto compare = [&](const std::byte* from, const Block& block) {
    difference |= (words(from) ^ words(block.bytes.data())) & words(block.compared.data());
  };
  const Block* block = front_.data();
  const std::byte* const last = input + reads_ - block_bytes;
  for (; input < last; input += block_bytes) {
    compare(input, *block++);
  }
  compare(last, *block);  // overlaps the one before it
  return is_zero(difference);
}

/// Eight bytes at a time, of which the others stay: of all widths alike, in little code.
__attribute__((always_inline)) inline void MessageShape::put_numbers(const std::byte* input) noexcept {
  for (std::size_t i = 0; i < numbers_; ++i) {
    const Number place = number_[i];
    std::uint64_t number = 0;
    std::uint64_t there = 0;
    std::memcpy(&number, &input[place.from], sizeof number);
    std::memcpy(&there, &output_[place.to], sizeof there);
    number = place.swap ? without_last(swapped(number), place.shift) : number;
    there ^= (there ^ number) & without_last(~std::uint64_t{0}, place.shift);
    std::memcpy(&output_[place.to], &there, sizeof there);
  }
}

__attribute__((hot)) bool MessageShape::convert(const Shape::Conversion& conversion, ByteView input,
                                                Gathered& result) noexcept {
  if (key(conversion) != key_ || input.size() < array_at_ || !is_front(input.data())) {
    return false;
  }
  const std::size_t bytes = load_u32(&input[array_at_ - count_bytes], count_order_);
  const std::size_t left = input.size() - array_at_;
  if (bytes < least_array_bytes || bytes > most_ || bytes > left || left - bytes < reads_behind_ ||
      (!may_be_longer_ && left - bytes - reads_behind_ >= 4)) {
    return false;
  }
  const std::byte* const behind = input.data() + array_at_ + bytes;
  for (std::size_t i = 0; i < reads_behind_; ++i) {
    if (behind[i] != behind_[i]) {
      return false;
    }
  }
  put_numbers(input.data());
  store_u32(&output_[count_to_], static_cast<std::uint32_t>(bytes), count_order_to_);
  const std::size_t begin = to_cdr_ ? 0 : room_in_front;
  slices_[0] = {&output_[begin], count_to_ + count_bytes - begin};
  slices_[1] = {behind - bytes, bytes};
  result = {std::span{slices_.data(), writes_behind_ > 0 ? 3U : 2U},
            slices_[0].size() + bytes + writes_behind_};
  return true;
}

void MessageShape::learn(const Program& program, const Shape& front, const Shape::Conversion& conversion,
                         ByteView input, const Gathered& made) noexcept {
  key_ = 0;
  if (!front.fitted() || front.end() != program.quick.array_at || front.reads() > most_bytes ||
      front.writes() > most_bytes || made.slices.size() > slices_.size()) {
    return;
  }
  // In CDR padding stands before the count.
  const std::size_t gap = (0 - (conversion.to_cdr ? front.writes() : front.reads())) % count_bytes;
  const std::size_t array_at = front.reads() + (conversion.to_cdr ? 0 : gap) + count_bytes;
  const std::endian length = length_order(program.rules);
  const std::endian count_order = conversion.to_cdr ? length : conversion.order;
  const std::size_t bytes = load_u32(&input[array_at - count_bytes], count_order);
  const bool is_copied = made.slices.size() == 1;
  if (bytes < least_array_bytes || (!is_copied && made.slices[1].data() != &input[array_at])) {
    return;
  }
  const std::size_t count_to = front.writes() + (conversion.to_cdr ? encapsulation_bytes + gap : 0);
  const ByteView behind = input.subspan(array_at + bytes);
  const ByteView output_behind = is_copied ? made.slices[0].subspan(count_to + count_bytes + bytes)
                                 : made.slices.size() == 3 ? made.slices[2]
                                                           : ByteView{};
  if (behind.size() > most_bytes_behind || output_behind.size() > most_bytes_behind ||
      !learn_numbers(front.loose())) {
    return;
  }
  learn_front(front);
  array_at_ = static_cast<std::uint32_t>(array_at);
  most_ = static_cast<std::uint32_t>(
      std::min<std::uint64_t>(program.ops[program.quick.array_at].bound, max_array_bytes));
  to_cdr_ = conversion.to_cdr;
  may_be_longer_ = to_cdr_ || program.may_be_longer;
  count_to_ = static_cast<std::uint16_t>(count_to + (to_cdr_ ? 0 : room_in_front));
  count_order_ = count_order;
  count_order_to_ = to_cdr_ ? std::endian::native : length;
  reads_behind_ = static_cast<std::uint8_t>(behind.size());
  writes_behind_ = static_cast<std::uint8_t>(output_behind.size());
  std::ranges::copy(behind, behind_.begin());
  std::ranges::copy(output_behind, output_behind_.begin());
  slices_[2] = {output_behind_.data(), output_behind.size()};
  key_ = key(conversion);
}

/// @return false: too many.
bool MessageShape::learn_numbers(std::span<const Shape::Place> places) noexcept {
  numbers_ = 0;
  for (const Shape::Place& place : places) {
    for (unsigned at = 0; at < place.bytes; at += place.width) {
      if (numbers_ == most_numbers) {
        return false;
      }
      number_[numbers_++] = {static_cast<std::uint16_t>(place.from + at),
                             static_cast<std::uint16_t>(room_in_front + place.to + at),
                             static_cast<std::uint8_t>(64 - 8 * place.width), place.swap};
    }
  }
  return true;
}

void MessageShape::learn_front(const Shape& front) noexcept {
  reads_ = static_cast<std::uint32_t>(front.reads());
  const auto keep = [&](std::size_t at, Block& block) {
    std::memcpy(block.bytes.data(), &front.input()[at], block_bytes);
    std::memcpy(block.compared.data(), &front.compared()[at], block_bytes);
  };
  Block* block = front_.data();
  const std::size_t last = reads_ - block_bytes;
  for (std::size_t at = 0; at < last; at += block_bytes) {
    keep(at, *block++);
  }
  keep(last, *block);
  output_.fill(std::byte{0});
  std::ranges::copy(encapsulation, output_.begin());
  std::ranges::copy(front.output(), output_.begin() + room_in_front);
}

}  // namespace trestle::messages::quick
