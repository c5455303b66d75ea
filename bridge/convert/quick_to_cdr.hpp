#pragma once
#include <algorithm>

#include "bridge/convert/conversion_scratch.hpp"
#include "bridge/convert/wire_forms.hpp"

namespace trestle::bridge {

/// What stays the same during a conversion to CDR.
struct QuickSource {
  QuickSource(const Program& program_used, const std::byte* payload, bool swap_numbers,
              const StringFrame& frame)
      : program{program_used},
        in{payload},
        swap{swap_numbers},
        strings{frame},
        plain_strings{program.rules.string_encoding == someip::StringEncoding::utf8 &&
                      program.rules.alignment <= 1} {}

  const Program& program;
  const std::byte* in;
  bool swap;  ///< numbers differ in byte order, unless the operation's is the other one
  const StringFrame& strings;
  bool plain_strings;  ///< UTF-8, and no padding behind them
};

/// Does what most operations are, few numbers and short strings, with everything in registers: stores of
/// bytes make the compiler doubt all members.
/// @param begin_at  where the operation's fields begin; on return, those of the one that is returned.
/// @param limit     where they end at the latest.
/// @return the first operation that it left to do: of another kind, long, or not good.
inline std::size_t quick_to_cdr(const QuickSource& source, std::size_t i, std::size_t end,
                                std::size_t& begin_at, std::size_t limit, ConversionScratch& out) {
  constexpr std::size_t most_padding = 7;
  const someip::PayloadRules& rules = source.program.rules;
  const StringFrame& strings = source.strings;
  const std::byte* const in = source.in;
  const bool swap = source.swap;
  const std::span<std::byte> room = out.left();
  const std::size_t before = out.position() - encapsulation_bytes;
  std::byte* to = room.data();
  const auto align_to = [&](std::size_t width) {
    std::size_t position = before + static_cast<std::size_t>(to - room.data());
    for (; (position & (width - 1)) != 0; ++position) {
      *to++ = std::byte{0};
    }
  };
  std::size_t at = begin_at;
  for (const Op* op = source.program.ops.data() + i; i < end; ++i, ++op) {
    const std::size_t space = room.size() - static_cast<std::size_t>(to - room.data());
    if (op->kind == Op::Kind::numbers) {
      if (op->count > most_quick_bytes / op->width) {
        break;
      }
      const std::size_t bytes = static_cast<std::size_t>(op->count) * op->width;
      if (bytes > limit - at || bytes + most_padding > space) {
        break;
      }
      align_to(op->width);
      copy_few_numbers(to, in + at, static_cast<std::size_t>(op->count), op->width, swap != op->other_order);
      at += bytes;
      to += bytes;
    } else if (op->kind == Op::Kind::string && source.plain_strings && op->fixed_bytes == 0) {
      const std::size_t ahead = bytes(op->length);
      if (ahead > limit - at) {
        break;
      }
      const std::size_t length = load_length(in + at, op->length, length_order(rules));
      const std::size_t text = length - strings.overhead();
      const std::byte* const from = in + at + ahead + strings.bom.size();
      if (length > limit - at - ahead || length < strings.overhead() || text >= short_text ||
          text > op->bound || 4 + text + 1 + most_padding > space ||
          !std::equal(strings.bom.begin(), strings.bom.end(), in + at + ahead) ||
          (rules.string_terminator && std::memchr(from, 0, text + 1) != from + text)) {
        break;
      }
      align_to(4);
      store_u32(to, static_cast<std::uint32_t>(text + 1), std::endian::native);
      copy_few(to + 4, from, text);
      to[4 + text] = std::byte{0};
      to += 4 + text + 1;
      at += ahead + length;
    } else {
      break;
    }
  }
  begin_at = at;
  out.use(static_cast<std::size_t>(to - room.data()));
  return i;
}

}  // namespace trestle::bridge
