#include "bridge/carry/runtime/conversion_words.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bridge/messages/convert/program/string_frame.hpp"

namespace trestle::carry {
namespace {

constexpr std::size_t shown = 16;
constexpr std::size_t length_bytes = 4;

std::uint8_t at(ByteView bytes, std::size_t place) {
  return std::to_integer<std::uint8_t>(bytes[place]);
}

bool is_text(ByteView bytes, std::size_t begin, std::size_t step) {
  constexpr std::size_t enough = 4;
  for (std::size_t i = 0; i < enough; ++i) {
    const std::size_t place = begin + i * step;
    if (place >= bytes.size() || at(bytes, place) < 0x20 || at(bytes, place) > 0x7e) {
      return false;
    }
  }
  return true;
}

// What the sender's rules may be, from the length and the text at fault.
std::string guess(const messages::ConversionError& error, ByteView payload,
                  const someip::PayloadRules& rules) {
  using enum messages::ConversionFault;
  if (error.offset + length_bytes > payload.size() || rules.string_length != someip::FieldWidth::bits32) {
    return {};
  }
  const std::size_t begin = error.offset + length_bytes;
  const std::size_t left = payload.size() - begin;
  std::uint32_t big = 0;
  std::uint32_t little = 0;
  for (std::size_t i = 0; i < length_bytes; ++i) {
    big = big << 8U | at(payload, error.offset + i);
    little |= std::uint32_t{at(payload, error.offset + i)} << (8 * i);
  }
  if (error.fault == truncated && big > left && little > 0 && little <= left) {
    return fmt::format(
        "; 0x{:08x} as a length is {} in little endian, which would fit: write `wire: {{byte_order: little, "
        "length_order: as_payload}}`",
        big, little);
  }
  if (error.fault != bad_string && error.fault != bad_encoding && error.fault != bad_length) {
    return {};
  }
  const bool has_bom = std::ranges::equal(payload.subspan(begin, std::min(left, messages::utf8_bom.size())),
                                          messages::utf8_bom);
  if (is_text(payload, begin + (has_bom ? messages::utf8_bom.size() : 0), 1)) {
    return error.is_wide
               ? "; the text looks like UTF-8, but the field is a wstring, which is UTF-16: make it a "
                 "string in the message's definition, or have the sender write UTF-16"
           : rules.string_encoding != someip::StringEncoding::utf8
               ? "; the text looks like UTF-8: write `wire: {string_encoding: utf8}`"
           : has_bom
               ? "; the text looks like UTF-8 without a zero at its end: write `wire: {string_terminator: "
                 "false}`"
               : "; the text looks like UTF-8 without a byte order mark: write `wire: {string_bom: false}`";
  }
  if (rules.string_encoding == someip::StringEncoding::utf8) {
    const std::size_t bom = left >= 2 && (at(payload, begin) | at(payload, begin + 1)) == 0xff ? 2 : 0;
    if (is_text(payload, begin + bom, 2)) {
      return "; the text looks like UTF-16: write `wire: {string_encoding: utf16le}`";
    }
    if (is_text(payload, begin + bom + 1, 2)) {
      return "; the text looks like UTF-16: write `wire: {string_encoding: utf16be}`";
    }
  }
  return {};
}

}  // namespace

std::string in_words(const messages::ConversionError& error, ByteView input) {
  if (error.is_between) {
    return fmt::format("{} (of {} bytes)", to_string(error), input.size());
  }
  const std::size_t begin = std::min(error.offset, input.size());
  std::string bytes;
  for (const std::byte one : input.subspan(begin, std::min(shown, input.size() - begin))) {
    bytes += fmt::format("{}{:02x}", bytes.empty() ? "" : " ", std::to_integer<unsigned>(one));
  }
  return fmt::format("{} (of {} bytes{})", to_string(error), input.size(),
                     bytes.empty() ? "" : "; there stands " + bytes);
}

std::string in_words(const messages::ConversionError& error, ByteView payload,
                     const someip::PayloadRules& rules) {
  return in_words(error, payload) + (error.is_between ? "" : guess(error, payload, rules));
}

}  // namespace trestle::carry
