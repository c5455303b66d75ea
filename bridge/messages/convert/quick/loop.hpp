#pragma once
#include <algorithm>
#include <bit>
#include <cstring>

#include "bridge/messages/convert/program/output.hpp"
#include "bridge/messages/convert/program/program.hpp"
#include "bridge/messages/convert/program/wire_forms.hpp"
#include "bridge/messages/convert/quick/few_bytes.hpp"

namespace trestle::messages::quick {

/// Texts of so many bytes and more are left to the operations, which put them as a slice of their own.
inline constexpr std::size_t short_text = 64;
/// Numbers, and booleans, count as few up to so many bytes.
inline constexpr std::size_t most_few_bytes = 64;

/// What is converted, and how.
struct Source {
  const Program& program;
  const std::byte* in;  ///< a payload; or CDR, without encapsulation
  std::endian order;    ///< of the CDR
  bool swap;            ///< numbers differ in byte order, unless the operation's is the other one
};

/// Does operations one after another, each as `Way` does it, until there is one that it leaves to others.
///
/// All that it looks at is in variables of its own, and so in registers: stores of bytes make the compiler
/// doubt the members of anything that lives longer. For the same reason it is not inlined. It begins a line
/// of the cache, as how fast a loop is depends on its place in one.
/// @tparam Way          LoopToCdr or LoopToSomeip
/// @tparam with_arrays  without arrays, texts are up to 15 % quicker
template <typename Way, bool with_arrays>
__attribute__((noinline, aligned(64))) std::size_t loop(const Source& source, std::size_t begin,
                                                        std::size_t end, std::uint64_t& times,
                                                        std::size_t& at, std::size_t limit, Output& out) {
  Way way{source, at, limit, out};
  const Op* const ops = source.program.ops.data();
  const Op* const first = ops + begin;
  const Op* const behind = ops + end;
  const Op* op = first;
  std::uint64_t left = times;
  for (;;) {
    if (op->loop == Op::Loop::numbers) {
      if (!way.numbers(*op)) {
        break;
      }
    } else if (op->loop == Op::Loop::string) {
      if (!way.string(*op)) {
        break;
      }
    } else if (op->loop == Op::Loop::bools) {
      if (!way.bools(static_cast<std::size_t>(op->count))) {
        break;
      }
    } else if (with_arrays && op->loop != Op::Loop::no) {
      if (!way.array(*op)) {
        break;
      }
      op = op->loop == Op::Loop::if_empty ? ops + op->end - 1 : op;
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
  at = way.position();
  out.use(way.written());
  return left == 0 ? end : static_cast<std::size_t>(op - ops);
}

/// Does operations as far as they can be done quickly.
/// @tparam Way      LoopToCdr or LoopToSomeip
/// @param times     how often to do all of them, one time after another; on return, how often is left, with
///                  the time that has begun
/// @param at        in the input, where the first one's fields begin; on return, where those of the
///                  returned operation begin
/// @param limit     where they end at the latest
/// @param arrays    whether there may be arrays among them
/// @return the first operation that is left to do: it is of another kind, long, or its bytes are not good
template <template <bool> class Way>
std::size_t run(const Source& source, std::size_t begin, std::size_t end, std::uint64_t& times,
                std::size_t& at, std::size_t limit, bool arrays, Output& out) {
  if (source.program.quick.is_usual) {
    return arrays ? loop<Way<true>, true>(source, begin, end, times, at, limit, out)
                  : loop<Way<true>, false>(source, begin, end, times, at, limit, out);
  }
  return arrays ? loop<Way<false>, true>(source, begin, end, times, at, limit, out)
                : loop<Way<false>, false>(source, begin, end, times, at, limit, out);
}

/// What both ways begin with.
/// @tparam is_usual  QuickWays::is_usual: what is known as this is compiled makes texts a tenth quicker
template <bool is_usual>
class LoopWay {
 public:
  LoopWay(const Source& source, std::size_t at, std::size_t limit, Output& out)
      : in_{source.in},
        at_{at},
        limit_{limit},
        begin_{out.left().data()},
        to_{begin_},
        end_{begin_ + out.left().size()},
        reference_from_{out.reference_from()},
        swap_{source.swap},
        strings_{source.program.quick.strings} {}

  __attribute__((always_inline)) bool bools(std::size_t count) {
    if (count > space() || at_ > limit_ || count > left() || !copy_bools(to_, in_ + at_, count)) {
      return false;
    }
    at_ += count;
    to_ += count;
    return true;
  }

  [[nodiscard]] std::size_t position() const noexcept { return at_; }
  [[nodiscard]] std::size_t written() const noexcept { return static_cast<std::size_t>(to_ - begin_); }

 protected:
  [[nodiscard]] std::size_t left() const noexcept { return limit_ - at_; }
  [[nodiscard]] std::size_t space() const noexcept { return static_cast<std::size_t>(end_ - to_); }
  [[nodiscard]] static someip::FieldWidth width_of_length(const Op& op) noexcept {
    return is_usual ? someip::FieldWidth::bits32 : op.length;
  }
  [[nodiscard]] bool is_swapped(const Op& op) const noexcept {
    return op.width > 1 && swap_ != op.other_order;
  }
  [[nodiscard]] QuickFrame strings() const noexcept {
    if constexpr (is_usual) {
      return usual_strings;
    } else {
      return strings_;
    }
  }
  /// Whether bytes of an array are better referenced than copied.
  [[nodiscard]] bool is_long(const Op& op, std::size_t bytes) const noexcept {
    return !is_swapped(op) && bytes >= reference_from_;
  }

  const std::byte* in_;
  std::size_t at_;
  std::size_t limit_;
  std::byte* begin_;  ///< of the room in the output
  std::byte* to_;
  std::byte* end_;
  std::size_t reference_from_;
  bool swap_;
  QuickFrame strings_;
};

}  // namespace trestle::messages::quick
