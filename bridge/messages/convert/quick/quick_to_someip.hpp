#pragma once
#include <algorithm>

#include "bridge/messages/convert/program/wire_forms.hpp"
#include "bridge/messages/convert/quick/conversion_scratch.hpp"
#include "bridge/messages/convert/quick/quick_copies.hpp"

namespace trestle::messages {

/// What stays the same during a conversion to SOME/IP.
struct QuickToSomeip {
  const Program& program;
  ByteView body;  ///< a CDR sample without encapsulation
  std::endian order;
  bool swap;  ///< numbers differ in byte order, unless the operation's is the other one
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
/// @return the first operation that it left to do: of another kind, long, or not good.
template <bool is_usual, bool with_arrays>
__attribute__((noinline, aligned(64))) std::size_t quick_to_someip(const QuickToSomeip& source,
                                                                   std::size_t begin, std::size_t end,
                                                                   std::uint64_t& times,
                                                                   std::size_t& begin_at,
                                                                   ConversionScratch& out) {
  constexpr std::size_t surplus = 4;  // that a store may write beyond the end of a string
  const Program& program = source.program;
  const std::endian order = source.order;
  const bool swap = source.swap;
  const QuickFrame strings = is_usual ? usual_strings : program.quick_strings;
  const auto aligned = [](std::size_t at, std::size_t width) { return (at + width - 1) & ~(width - 1); };
  const std::span<std::byte> room = out.left();
  std::byte* to = room.data();
  const std::byte* const to_end = to + room.size();
  const std::byte* const in = source.body.data();
  const std::size_t size = source.body.size();
  std::size_t at = begin_at;
  std::uint64_t left = times;
  const Op* const first = program.ops.data() + begin;
  const Op* const behind = program.ops.data() + end;
  const Op* op = first;
  for (;;) {
    const auto space = static_cast<std::size_t>(to_end - to);
    if (op->kind == Op::Kind::numbers) {
      if (exceed(op->count, op->width, most_quick_bytes)) {
        break;
      }
      const std::size_t bytes = static_cast<std::size_t>(op->count) * op->width;
      const std::size_t from = aligned(at, op->width);
      if (from + bytes > size || bytes > space) {
        break;
      }
      copy_few_numbers(to, in + from, static_cast<std::size_t>(op->count), op->width,
                       swap != op->other_order);
      at = from + bytes;
      to += bytes;
    } else if (op->kind == Op::Kind::string && strings.is_plain && op->fixed_bytes == 0 &&
               (!is_usual || op->length == someip::FieldWidth::bits32)) {
      const std::size_t from = aligned(at, 4) + 4;
      if (from > size) {
        break;
      }
      const std::size_t with_zero = load_u32(in + from - 4, order);
      if (with_zero - 1 >= std::min(short_text, size - from) || in[from + with_zero - 1] != std::byte{0}) {
        break;
      }
      const std::size_t text = with_zero - 1;
      const std::size_t length = strings.overhead() + text;
      const someip::FieldWidth width = is_usual ? someip::FieldWidth::bits32 : op->length;
      const std::size_t ahead = bytes(width);
      if (text > op->bound || !fits(width, length) || ahead + length + surplus > space) {
        break;
      }
      std::memcpy(to + ahead, &strings.bom, sizeof strings.bom);
      std::byte* const characters = to + ahead + strings.bom_bytes;
      const std::size_t there = std::min(size - from, space - ahead - strings.bom_bytes);
      if (!copy_text(characters, in + from, text, there) && strings.has_terminator) {
        break;
      }
      characters[text] = std::byte{0};
      store_length(to, width, length, strings.length_order);
      to += ahead + length;
      at = from + with_zero;
    } else if (op->kind == Op::Kind::bools) {
      const auto count = static_cast<std::size_t>(op->count);
      if (op->count > most_quick_bytes || count > space || at > size || count > size - at ||
          !copy_bools(to, in + at, count)) {
        break;
      }
      at += count;
      to += count;
    } else if (with_arrays && (!is_usual || op->length == someip::FieldWidth::bits32) &&
               (op->kind == Op::Kind::number_sequence || op->kind == Op::Kind::sequence)) {
      const std::size_t behind_count = aligned(at, 4) + 4;
      if (behind_count > size) {
        break;
      }
      const someip::FieldWidth width = is_usual ? someip::FieldWidth::bits32 : op->length;
      const std::size_t ahead = bytes(width);
      const std::uint64_t elements = load_u32(in + behind_count - 4, order);
      const std::uint64_t element_bytes = op->count * op->width;
      const std::size_t from = elements == 0 ? behind_count : aligned(behind_count, op->width);
      if (ahead > space ||
          (elements != 0 && (op->kind == Op::Kind::sequence || elements > op->bound || from > size ||
                             exceed(elements, element_bytes, std::min(size - from, space - ahead))))) {
        break;
      }
      const auto length = static_cast<std::size_t>(elements * element_bytes);
      if (length != 0) {
        const bool is_swapped = op->width > 1 && swap != op->other_order;
        if (!fits(width, length) || (!is_swapped && length >= out.reference_from())) {
          break;
        }
        copy_array(to + ahead, in + from, length, op->width, is_swapped);
      }
      store_length(to, width, length, strings.length_order);
      to += ahead + length;
      at = from + length;
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
std::size_t quick_to_someip(const QuickToSomeip& source, std::size_t begin, std::size_t end,
                            std::uint64_t& times, std::size_t& begin_at, ConversionScratch& out) {
  return source.program.is_usual
             ? quick_to_someip<true, with_arrays>(source, begin, end, times, begin_at, out)
             : quick_to_someip<false, with_arrays>(source, begin, end, times, begin_at, out);
}

}  // namespace trestle::messages
