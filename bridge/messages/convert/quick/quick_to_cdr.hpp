#pragma once
#include <algorithm>

#include "bridge/messages/convert/program/wire_forms.hpp"
#include "bridge/messages/convert/quick/conversion_scratch.hpp"
#include "bridge/messages/convert/quick/quick_copies.hpp"

namespace trestle::messages {

/// What stays the same during a conversion to CDR.
struct QuickToCdr {
  const Program& program;
  const std::byte* in;  ///< the payload
  bool swap;            ///< numbers differ in byte order, unless the operation's is the other one
};

/// Does what most operations are, few numbers, booleans and short strings, with everything in registers:
/// stores of bytes make the compiler doubt all members. For the same reason it is not inlined. It begins a
/// line of the cache: how fast its loops are depends on their places in one.
/// @tparam is_usual  the strings are usual_strings, with length fields of 32 bits, or left to others.
/// @tparam with_arrays  does also arrays of numbers, and empty ones of anything, of programs that have
///                      Program::quick_arrays; texts take longer then.
/// @param times     how often to do all of them, one after another; on return, how often is left, with the
///                  time that has begun.
/// @param begin_at  where the operation's fields begin; on return, those of the one that is returned.
/// @param limit     where they end at the latest.
/// @return the first operation that it left to do: of another kind, long, or not good.
template <bool is_usual, bool with_arrays>
__attribute__((noinline, aligned(64))) std::size_t quick_to_cdr(const QuickToCdr& source, std::size_t begin,
                                                                std::size_t end, std::uint64_t& times,
                                                                std::size_t& begin_at, std::size_t limit,
                                                                ConversionScratch& out) {
  constexpr std::size_t most_padding = 7;
  const Program& program = source.program;
  const std::byte* const in = source.in;
  const bool swap = source.swap;
  const QuickFrame strings = is_usual ? usual_strings : program.quick_strings;
  const std::span<std::byte> room = out.left();
  const std::size_t before = out.position() - encapsulation_bytes;
  std::byte* to = room.data();
  const auto align_to = [&](std::size_t width) {
    const std::size_t position = before + static_cast<std::size_t>(to - room.data());
    std::memset(to, 0, most_padding + 1);
    to += (0 - position) & (width - 1);
  };
  std::size_t at = begin_at;
  std::uint64_t left = times;
  const Op* const first = program.ops.data() + begin;
  const Op* const behind = program.ops.data() + end;
  const Op* op = first;
  for (;;) {
    const std::size_t space = room.size() - static_cast<std::size_t>(to - room.data());
    if (op->kind == Op::Kind::numbers) {
      if (exceed(op->count, op->width, most_quick_bytes)) {
        break;
      }
      const std::size_t bytes = static_cast<std::size_t>(op->count) * op->width;
      if (bytes > limit - at || bytes + most_padding + 1 > space) {
        break;
      }
      align_to(op->width);
      copy_few_numbers(to, in + at, static_cast<std::size_t>(op->count), op->width, swap != op->other_order);
      at += bytes;
      to += bytes;
    } else if (op->kind == Op::Kind::string && strings.is_plain && op->fixed_bytes == 0 &&
               (!is_usual || op->length == someip::FieldWidth::bits32)) {
      const someip::FieldWidth width = is_usual ? someip::FieldWidth::bits32 : op->length;
      const std::size_t ahead = bytes(width);
      if (ahead + sizeof strings.bom > limit - at) {
        break;
      }
      const std::byte* const from = in + at + ahead;
      const std::size_t length = load_length(in + at, width, strings.length_order);
      const std::size_t text = length - strings.overhead();
      std::uint32_t bom = 0;
      std::memcpy(&bom, from, sizeof bom);
      if (length > limit - at - ahead || length < strings.overhead() || text >= short_text ||
          text > op->bound || 4 + text + 1 + most_padding > space ||
          (bom & strings.bom_mask) != strings.bom) {
        break;
      }
      const std::byte* const characters = from + strings.bom_bytes;
      const std::size_t there = std::min(limit - at - ahead - strings.bom_bytes, space - most_padding - 4);
      std::byte* const before_it = to;
      align_to(4);
      const bool no_zero = copy_text(to + 4, characters, text, there);
      if (strings.has_terminator && (!no_zero || characters[text] != std::byte{0})) {
        to = before_it;
        break;
      }
      store_u32(to, static_cast<std::uint32_t>(text + 1), std::endian::native);
      to[4 + text] = std::byte{0};
      to += 4 + text + 1;
      at += ahead + length;
    } else if (op->kind == Op::Kind::bools) {
      const auto count = static_cast<std::size_t>(op->count);
      if (op->count > most_quick_bytes || count > limit - at || count > space ||
          !copy_bools(to, in + at, count)) {
        break;
      }
      at += count;
      to += count;
    } else if (with_arrays && (!is_usual || op->length == someip::FieldWidth::bits32) &&
               (op->kind == Op::Kind::number_sequence || op->kind == Op::Kind::sequence)) {
      const someip::FieldWidth width = is_usual ? someip::FieldWidth::bits32 : op->length;
      const std::size_t ahead = bytes(width);
      if (ahead > limit - at) {
        break;
      }
      const std::size_t length = load_length(in + at, width, strings.length_order);
      if (length > limit - at - ahead || 4 + length + 2 * most_padding + 1 > space) {
        break;
      }
      std::uint64_t elements = 0;
      const bool is_swapped = op->width > 1 && swap != op->other_order;
      if (length != 0) {
        const std::uint64_t element_bytes = op->count * op->width;
        elements = op->count == 1 ? length >> std::countr_zero(op->width) : length / element_bytes;
        if (op->kind == Op::Kind::sequence || elements > op->bound || elements * element_bytes != length ||
            (!is_swapped && length >= out.reference_from())) {
          break;
        }
      }
      align_to(4);
      store_u32(to, static_cast<std::uint32_t>(elements), std::endian::native);
      to += 4;
      if (length != 0) {
        align_to(op->width);
        copy_array(to, in + at + ahead, length, op->width, is_swapped);
      }
      to += length;
      at += ahead + length;
      op = op->kind == Op::Kind::sequence ? program.ops.data() + op->end - 1 : op;
    } else {
      break;
    }
    if (++op == behind) {
      if (--left == 0) {
        break;
      }
      op = first;
    }
  }
  times = left;
  begin_at = at;
  out.use(static_cast<std::size_t>(to - room.data()));
  return left == 0 ? end : static_cast<std::size_t>(op - program.ops.data());
}

/// The same, whatever the strings are.
template <bool with_arrays>
std::size_t quick_to_cdr(const QuickToCdr& source, std::size_t begin, std::size_t end, std::uint64_t& times,
                         std::size_t& begin_at, std::size_t limit, ConversionScratch& out) {
  return source.program.is_usual
             ? quick_to_cdr<true, with_arrays>(source, begin, end, times, begin_at, limit, out)
             : quick_to_cdr<false, with_arrays>(source, begin, end, times, begin_at, limit, out);
}

}  // namespace trestle::messages
