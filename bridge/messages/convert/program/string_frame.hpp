#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <optional>

#include "someip/wire/payload_rules.hpp"
#include "someip/wire/types.hpp"

namespace trestle::messages {

/// What stands before and behind the characters of a string.  [feat_req_someip_662] [feat_req_someip_687]
struct StringFrame {
  ByteView bom;
  ByteView terminator;
  bool utf16 = false;
  someip::StringEncoding encoding = someip::StringEncoding::utf8;
  [[nodiscard]] constexpr std::size_t overhead() const noexcept { return bom.size() + terminator.size(); }
};

inline constexpr std::array<std::byte, 3> utf8_bom{std::byte{0xef}, std::byte{0xbb}, std::byte{0xbf}};
inline constexpr std::array<std::byte, 2> utf16le_bom{std::byte{0xff}, std::byte{0xfe}};
inline constexpr std::array<std::byte, 2> utf16be_bom{std::byte{0xfe}, std::byte{0xff}};
inline constexpr std::array<std::byte, 2> zeros{};

/// What is around such a string; it points to constants.
[[nodiscard]] constexpr StringFrame string_frame(someip::StringEncoding encoding, bool bom,
                                                 bool terminator) noexcept {
  StringFrame frame;
  frame.utf16 = encoding != someip::StringEncoding::utf8;
  frame.encoding = encoding;
  if (bom) {
    frame.bom = encoding == someip::StringEncoding::utf8      ? ByteView{utf8_bom}
                : encoding == someip::StringEncoding::utf16le ? ByteView{utf16le_bom}
                                                              : ByteView{utf16be_bom};
  }
  if (terminator) {
    frame.terminator = ByteView{zeros}.first(frame.utf16 ? 2 : 1);
  }
  return frame;
}

/// Where the first zero byte or unit stands; the size of `text` if there is none.
[[nodiscard]] inline std::size_t first_zero(ByteView text, std::size_t unit) noexcept {
  if (unit == 1) {
    return static_cast<std::size_t>(std::ranges::find(text, std::byte{0}) - text.begin());
  }
  std::size_t at = 0;
  while (at < text.size() && (text[at] != std::byte{0} || text[at + 1] != std::byte{0})) {
    at += 2;
  }
  return at;
}

/// The characters of a string, between BOM and terminator; nothing: these are not there, or something else
/// than zeros is behind.
/// @param is_fixed  of a fixed size: what it does not need is zero.
[[nodiscard]] inline std::optional<ByteView> text_within(const StringFrame& frame, ByteView string,
                                                         bool is_fixed) noexcept {
  const std::size_t unit = frame.utf16 ? 2 : 1;
  ByteView text = string.first(string.size() -
                               string.size() % unit);  // an odd last byte is ignored  [feat_req_someip_641]
  if (text.size() < frame.bom.size() || !std::ranges::equal(text.first(frame.bom.size()), frame.bom)) {
    return std::nullopt;  // [feat_req_someip_666]
  }
  text = text.subspan(frame.bom.size());
  if (frame.terminator.empty() && !is_fixed) {
    return text;
  }
  // More zeros than the terminator may follow [feat_req_someip_639] [feat_req_someip_239], nothing else may.
  const std::size_t end = first_zero(text, unit);
  if ((end == text.size() && !frame.terminator.empty()) ||
      !std::ranges::all_of(text.subspan(end), [](std::byte b) { return b == std::byte{0}; })) {
    return std::nullopt;
  }
  return text.first(end);
}

/// wstrings are UTF-16 also where strings are UTF-8: big endian then.
[[nodiscard]] constexpr someip::StringEncoding wide_encoding(someip::StringEncoding of_strings) noexcept {
  return of_strings == someip::StringEncoding::utf16le ? someip::StringEncoding::utf16le
                                                       : someip::StringEncoding::utf16be;
}

/// The byte order of UTF-16 units; big endian for UTF-8, which has none.
[[nodiscard]] constexpr std::endian utf16_order(someip::StringEncoding encoding) noexcept {
  return encoding == someip::StringEncoding::utf16le ? std::endian::little : std::endian::big;
}

/// Of length fields and of the type fields of unions.  [feat_req_someip_675]
[[nodiscard]] constexpr std::endian length_order(const someip::PayloadRules& rules) noexcept {
  return rules.length_fields_always_big ? std::endian::big : rules.byte_order;
}

/// The frame of strings in words, so that a single store writes each part of it.
struct QuickFrame {
  constexpr explicit QuickFrame(const someip::PayloadRules& rules)
      : is_plain{rules.string_encoding == someip::StringEncoding::utf8 && rules.alignment <= 1},
        has_terminator{rules.string_terminator},
        length_order{messages::length_order(rules)} {
    if (rules.string_bom) {
      bom = std::bit_cast<std::uint32_t>(std::array{utf8_bom[0], utf8_bom[1], utf8_bom[2], std::byte{0}});
      bom_mask = std::bit_cast<std::uint32_t>(
          std::array{std::byte{0xff}, std::byte{0xff}, std::byte{0xff}, std::byte{0}});
      bom_bytes = utf8_bom.size();
    }
  }

  bool is_plain;  ///< UTF-8, and no padding behind strings; what follows is of these
  bool has_terminator;
  std::endian length_order;
  std::uint32_t bom = 0;
  std::uint32_t bom_mask = 0;
  std::size_t bom_bytes = 0;
  [[nodiscard]] constexpr std::size_t overhead() const noexcept {
    return bom_bytes + (has_terminator ? 1 : 0);
  }
  friend bool operator==(const QuickFrame&, const QuickFrame&) = default;
};

/// The frame of the default rules. Code that knows it at compile time is quicker.
inline constexpr QuickFrame usual_strings{someip::PayloadRules{}};

}  // namespace trestle::messages
