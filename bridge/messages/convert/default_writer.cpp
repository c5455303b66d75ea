#include "bridge/messages/convert/default_writer.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <span>

#include "bridge/messages/convert/conversion_plan.hpp"
#include "bridge/messages/convert/program/wire_forms.hpp"
#include "bridge/messages/types/literals.hpp"
#include "bridge/messages/types/number_text.hpp"
#include "someip/wire/utf.hpp"

namespace trestle::messages {
namespace {

std::uint64_t bits_of(Primitive type, const std::string& text) {
  switch (type) {
    case Primitive::boolean:
      return text == "true" ? 1 : 0;
    case Primitive::float32:
      return std::bit_cast<std::uint32_t>(read_float<float>(text).value_or(0));
    case Primitive::float64:
      return std::bit_cast<std::uint64_t>(read_float<double>(text).value_or(0));
    default:
      break;
  }
  const Whole whole = read_signed(text).value_or(Whole{});
  return whole.negative ? std::uint64_t{0} - whole.magnitude : whole.magnitude;
}

}  // namespace

DefaultValue default_value_of(const Field& field) {
  DefaultValue value;
  value.type = *field.type.primitive;
  value.is_sequence = field.type.array == ArrayKind::bounded || field.type.array == ArrayKind::unbounded;
  for (DefaultElement& element : default_elements(field)) {
    if (width(value.type) == 0) {
      value.strings.push_back(std::move(element.text));
    } else {
      value.numbers.push_back(bits_of(value.type, element.text));
    }
  }
  return value;
}

bool DefaultWriter::write(std::size_t i) {
  const Op& op = program_.ops[i];
  if (op.optional) {
    return zero_numbers(1, 4);
  }
  return op.default_at < program_.defaults.size() ? value(program_.defaults[op.default_at])
                                                  : zeros(i + 1, op.end);
}

/// Writes what the operations produce without any input.
bool DefaultWriter::zeros(std::size_t begin, std::size_t end) {
  for (std::size_t i = begin; i < end;) {
    const Op& op = program_.ops[i];
    std::size_t next = i + 1;
    bool good = true;
    switch (op.kind) {
      case Op::Kind::numbers:
        good = zero_numbers(op.count, op.width);
        break;
      case Op::Kind::bools:
      case Op::Kind::bits:
        good = zero_numbers(op.count, 1);
        break;
      case Op::Kind::packed:
        for (const PackedNumber& one : program_.packed[op.members_at]) {
          good = good && zero_numbers(1, one.width);
        }
        break;
      case Op::Kind::string:
        good = text("", false);
        break;
      case Op::Kind::wstring:
      case Op::Kind::number_sequence:
      case Op::Kind::bool_sequence:
        good = zero_numbers(1, 4);
        break;
      case Op::Kind::sequence:
      case Op::Kind::alternative:
        good = zero_numbers(1, 4);
        next = op.end;
        break;
      case Op::Kind::repeat:
        for (std::uint64_t k = 0; good && k < op.count; ++k) {
          good = zeros(i + 1, op.end);
        }
        next = op.end;
        break;
      case Op::Kind::field:
      case Op::Kind::member:
        good = write(i);
        next = op.end;
        break;
      case Op::Kind::structure:
      case Op::Kind::fixed_array:
      case Op::Kind::tagged:
      case Op::Kind::choice:
        break;  // their bodies follow
    }
    if (!good) {
      return false;
    }
    i = next;
  }
  return true;
}

bool DefaultWriter::value(const DefaultValue& value) {
  if (value.is_sequence) {
    write_cdr_u32(out_, static_cast<std::uint32_t>(value.numbers.size() + value.strings.size()));
  }
  const std::size_t bytes = width(value.type);
  if (!spend(8 + value.numbers.size() * bytes)) {
    return false;
  }
  for (const std::uint64_t number : value.numbers) {
    align_cdr(out_, bytes);
    store_number(out_.room(bytes), bytes, number, std::endian::native);
  }
  return std::ranges::all_of(value.strings,
                             [&](const auto& one) { return text(one, value.type == Primitive::wstring); });
}

bool DefaultWriter::text(std::string_view text, bool wide) {
  if (!spend(8 + 4 * text.size())) {
    return false;
  }
  const ByteView bytes = std::as_bytes(std::span{text});
  if (wide) {
    wide_characters(bytes);
    return true;
  }
  write_cdr_u32(out_, static_cast<std::uint32_t>(text.size() + 1));
  std::ranges::copy(bytes, out_.room(bytes.size()));
  *out_.room(1) = std::byte{0};
  return true;
}

void DefaultWriter::wide_characters(ByteView text) {
  align_cdr(out_, 4);
  const std::size_t count_place = out_.copied();
  static_cast<void>(out_.room(4));
  std::uint32_t units = 0;
  while (!text.empty()) {
    const auto character = someip::first_utf8(text).value_or(someip::Character{U'\ufffd', 1});
    std::array<std::byte, 4> utf16{};
    someip::put_utf16(character.code, utf16.data(), std::endian::big);
    for (std::size_t at = 0; at < someip::utf16_bytes(character.code); at += 2, ++units) {
      store_u32(out_.room(4), someip::load<std::uint16_t>(&utf16.at(at)), std::endian::native);
    }
    text = text.subspan(character.bytes);
  }
  store_u32(out_.place(count_place), units, std::endian::native);
}

bool DefaultWriter::zero_numbers(std::uint64_t count, std::size_t width) {
  if (count > max_default_bytes || !spend(static_cast<std::size_t>(count) * width)) {
    return false;
  }
  align_cdr(out_, width);
  const std::size_t bytes = static_cast<std::size_t>(count) * width;
  std::fill_n(out_.room(bytes), bytes, std::byte{0});
  return true;
}

bool DefaultWriter::spend(std::size_t bytes) noexcept {
  spent_ += bytes;
  return spent_ <= max_default_bytes;
}

}  // namespace trestle::messages
