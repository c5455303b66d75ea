#include "bridge/messages/convert/failure.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bridge/messages/convert/program/wire_forms.hpp"

namespace trestle::messages {
namespace {

std::string count_of(std::uint64_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

std::string in_hexadecimal(ByteView bytes) {
  std::string text;
  for (const std::byte one : bytes) {
    text += fmt::format("{}{:02x}", text.empty() ? "" : " ", std::to_integer<unsigned>(one));
  }
  return text;
}

std::string bytes_wanted(std::uint64_t wanted, std::size_t left) {
  return fmt::format("{} wanted, {} left", count_of(wanted, "byte"), left);
}

std::string with_length(const Program& program, const Op& op, ByteView rest) {
  const std::size_t width = bytes(op.length);
  if (width == 0) {
    return op.fixed_bytes != 0 ? bytes_wanted(op.fixed_bytes, rest.size())
                               : fmt::format("more bytes wanted than {}", rest.size());
  }
  if (rest.size() < width) {
    return fmt::format("a length field of {} wanted, {} left", count_of(width, "byte"), rest.size());
  }
  const auto length = load_length(rest.data(), op.length, length_order(program.rules));
  return fmt::format("{} wanted, as the length says, {} left", count_of(length, "byte"), rest.size() - width);
}

std::string when_truncated(const Program& program, const Op& op, bool to_cdr, ByteView rest) {
  switch (op.kind) {
    case Op::Kind::numbers:
      return bytes_wanted(op.width, rest.size());
    case Op::Kind::bools:
      return bytes_wanted(1, rest.size());
    case Op::Kind::bits:
      return bytes_wanted(to_cdr ? op.width : 1, rest.size());
    case Op::Kind::packed:
      return to_cdr ? bytes_wanted(op.fixed_bytes, rest.size())
                    : fmt::format("a whole number wanted, {} left", count_of(rest.size(), "byte"));
    case Op::Kind::repeat:
      return bytes_wanted(op.count * (to_cdr ? op.min_someip : op.min_cdr), rest.size());
    case Op::Kind::tagged:
      return fmt::format("a tag and its value wanted, {} left", count_of(rest.size(), "byte"));
    case Op::Kind::choice:
      return fmt::format("a type and its value wanted, {} left", count_of(rest.size(), "byte"));
    default:
      return to_cdr ? with_length(program, op, rest)
                    : fmt::format("a count of 4 bytes, and as many as it says, wanted, {} left", rest.size());
  }
}

std::string text_wanted(const Program& program, const Op& op, bool to_cdr) {
  if (!to_cdr) {
    return "characters other than zero, and one zero behind them, wanted";
  }
  const StringFrame& frame = program.frames[op.frame];
  std::string wanted;
  if (!frame.bom.empty()) {
    wanted += "BOM " + in_hexadecimal(frame.bom);
  }
  if (!frame.terminator.empty()) {
    wanted += fmt::format("{}terminator {}", wanted.empty() ? "" : " and ", in_hexadecimal(frame.terminator));
  }
  return (wanted.empty() ? "nothing but zeros behind the characters" : wanted) + " wanted";
}

std::string length_wanted(const Op& op) {
  switch (op.kind) {
    case Op::Kind::string:
    case Op::Kind::wstring:
      return fmt::format("a length of {} wanted", op.fixed_bytes);
    case Op::Kind::number_sequence:
    case Op::Kind::bool_sequence:
      return fmt::format("a length that is a multiple of {} wanted", op.count * op.width);
    default:
      return "the length of what is in it wanted";
  }
}

/// What a converter wanted where it stopped: "4 bytes wanted, 0 left".
/// @param at    of the program, at fault; none of its operations: the message as a whole.
/// @param rest  of the input, from the item at fault to where it would have to end.
std::string expectation(const Program& program, ConversionFault fault, std::size_t at, bool to_cdr,
                        ByteView rest) {
  static const Op whole{.kind = Op::Kind::choice};
  const bool known = at < program.ops.size();
  const Op& op = known ? program.ops[at] : whole;
  switch (fault) {
    case ConversionFault::truncated:
      return known ? when_truncated(program, op, to_cdr, rest) : "4 bytes of encapsulation wanted";
    case ConversionFault::bad_encapsulation:
      return "plain CDR wanted, which begins with 00 00 or 00 01";
    case ConversionFault::trailing_bytes:
      return fmt::format("the end wanted, {} left", count_of(rest.size(), "byte"));
    case ConversionFault::bound_exceeded:
      return op.kind == Op::Kind::packed ? "a number that its bits can hold wanted"
                                         : fmt::format("at most {} wanted", op.bound);
    case ConversionFault::bad_bool:
      return "0 or 1 wanted";
    case ConversionFault::bad_string:
      return text_wanted(program, op, to_cdr);
    case ConversionFault::bad_encoding: {
      const bool utf16 = op.kind == Op::Kind::wstring || (to_cdr && program.frames[op.frame].utf16);
      return utf16 ? "UTF-16 wanted" : "UTF-8 wanted";
    }
    case ConversionFault::bad_length:
      return length_wanted(op);
    case ConversionFault::length_overflow: {
      const std::size_t bits = 8 * bytes(op.length);
      return op.fixed_bytes != 0 ? fmt::format("at most {} bytes wanted", op.fixed_bytes)
             : bits == 0         ? fmt::format("at most {} bytes wanted", op.count)
                                 : fmt::format("at most {} bytes wanted, as the length field has {} bits",
                                               (std::uint64_t{1} << bits) - 1, bits);
    }
    case ConversionFault::too_large:
      return known ? fmt::format("at most {} bytes of defaults wanted", max_default_bytes)
                   : fmt::format("at most {} bytes wanted", max_converted_bytes);
    case ConversionFault::bad_tag:
      return "each member once, with the wire type of its type, wanted";
    case ConversionFault::missing_member:
      return "a member with this tag wanted";
    case ConversionFault::not_in_table:
      return "a value that the table of `map` has, wanted";
    case ConversionFault::bad_union: {
      std::size_t alternatives = 0;
      bool counted = true;
      const Op& holder = op;
      for (std::size_t j = at + 1; holder.kind == Op::Kind::choice && known && j < holder.end;
           j = program.ops[j].end) {
        counted = counted && program.ops[j].count == ++alternatives;
      }
      return !to_cdr ? "one alternative wanted"
             : alternatives == 0 || !counted
                 ? "a type that is known wanted"
                 : fmt::format("a type from {} to {} wanted", program.rules.union_null ? 0 : 1, alternatives);
    }
  }
  return {};
}

}  // namespace

ConversionError Failure::error(const Program& program, bool to_cdr, ByteView in) const {
  const ByteView left = in.subspan(std::min(offset_, in.size()));
  ConversionError error{fault_, offset_, {}, expectation(program, fault_, op_, to_cdr, left)};
  if (op_ >= program.labels.size()) {
    return error;
  }
  error.is_wide = program.ops[op_].kind == Op::Kind::wstring;
  const auto& labels = program.labels[op_];
  const std::uint64_t element = element_ == no_element ? 0 : element_;
  const auto after = std::ranges::upper_bound(labels, element, {}, &Label::first);
  const Label& label = *std::prev(after);
  std::size_t loop = loops_;
  std::string_view rest = label.path;
  for (auto at = rest.find("[]"); at != std::string_view::npos; at = rest.find("[]")) {
    error.field += rest.substr(0, at);
    error.field += fmt::format("[{}]", loop > 0 ? indices_[--loop] : 0);
    rest.remove_prefix(at + 2);
  }
  error.field += rest;
  if (label.stride != 0 && element_ != no_element) {
    error.field += fmt::format("[{}]", (element - label.first) / label.stride);
  }
  return error;
}

ConversionError error_of_message(const Program& program, ConversionFault fault, bool to_cdr, ByteView in) {
  return {fault, 0, {}, expectation(program, fault, Program::no_op, to_cdr, in)};
}

}  // namespace trestle::messages
