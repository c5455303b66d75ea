#pragma once
#include <bit>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "someip/wire/payload_rules.hpp"
#include "someip/wire/tag.hpp"

namespace trestle::messages {

/// How one use of a type differs from what holds otherwise. Interface descriptions give widths and encodings
/// for each use. What is not set is as PayloadRules say, or TypeRules::itself of a nested message. The length
/// of an array is that of the array, everything else concerns its elements. A field has what it needs: rules
/// for something else are refused when the plan is made.
struct FieldRules {
  /// Of a dynamic array; of an array of fixed size too, where nothing means none.
  std::optional<someip::FieldWidth> array_length{};
  std::optional<someip::FieldWidth> string_length{};
  std::optional<someip::StringEncoding> encoding{};
  std::optional<bool> bom{};
  std::optional<bool> terminator{};
  std::optional<someip::FieldWidth> struct_length{};  ///< of a nested message
  std::optional<someip::FieldWidth> union_length{};   ///< of a nested union, as the next four
  std::optional<someip::FieldWidth> union_type{};
  std::optional<bool> union_length_first{};
  /// Without length field: the bytes of the data and its padding; 0: no padding, as CommonAPI does. Nothing:
  /// those of the longest type.  [feat_req_someip_583]
  std::optional<std::uint32_t> union_bytes{};
  /// The type field's value for each field of the union; empty: 1, 2, 3 and so on.
  std::vector<std::uint32_t> selectors{};
  /// An integer in so many bits, which begins where the number before it ended: the lowest bit of a byte
  /// comes first. All numbers behind it are packed so, until one ends with a byte, or something else than a
  /// number comes, before which zeros fill up the byte. 0: in whole bytes.
  std::uint8_t bits = 0;
  std::string
      variant{};  ///< the nested message takes these of MessageRules::types: "pkg/msg/Type#2"; empty: its own
  friend bool operator==(const FieldRules&, const FieldRules&) = default;
};

/// What one message type is on the SOME/IP side, where its `.msg` file alone does not tell.
struct TypeRules {
  /// What the message is in SOME/IP.
  enum class Form : std::uint8_t {
    structure,  ///< its fields, one after another; with tags if there are any
    choice,     ///< a union: each field is a T[<=1], at most one of them has its element
    bits8,      ///< a bit field: each field is a bool or bool[N], the first is the lowest bit
    bits16,
    bits32,
    empty,  ///< no fields, and no byte either: else a message without fields has one
  };
  Form form = Form::structure;
  /// The data id of every field, or empty. A tagged T[<=1] is an optional member, not an array.
  std::map<std::string, someip::DataId, std::less<>> tags{};
  /// Strings that take a fixed number of bytes, BOM and terminator included.
  std::map<std::string, std::uint32_t, std::less<>> fixed_strings{};
  /// Of all numbers in a field, those of arrays and nested messages among them, unless rules of the nested
  /// message's type say otherwise. Fields that are not named follow what holds the message, at last
  /// PayloadRules::byte_order.  [feat_req_someip_224]
  std::map<std::string, std::endian, std::less<>> byte_orders{};
  /// Of single fields. A tagged field has the length field that its tag announces.
  std::map<std::string, FieldRules, std::less<>> fields{};
  /// Of the message as a whole, wherever a field that it is used in says nothing else: its length field, and
  /// all of a union. Also where it is the payload.
  FieldRules itself{};
  friend bool operator==(const TypeRules&, const TypeRules&) = default;
};

/// How the messages of one route are laid out on the SOME/IP side.
struct MessageRules {
  MessageRules() = default;
  /// Nothing but the payload's rules.
  MessageRules(const someip::PayloadRules& rules) : payload{rules} {}  // NOLINT(*-explicit-*)

  someip::PayloadRules payload;
  /// Fields missing at the end of the message, or of a struct with a length field, and tagged members that
  /// are not there have the default value of the `.msg` file, or zero; else they are an error.
  /// [feat_req_someipcompat_1200]
  bool default_missing = false;
  /// By "pkg/msg/Type"; variants of it, which fields ask for, by "pkg/msg/Type#2" with anything behind the #.
  std::map<std::string, TypeRules, std::less<>> types{};
  friend bool operator==(const MessageRules&, const MessageRules&) = default;
};

/// The message that rules are for: of "pkg/msg/Type#2" it is "pkg/msg/Type".
[[nodiscard]] constexpr std::string_view type_of_rules(std::string_view key) noexcept {
  return key.substr(0, key.find('#'));
}

}  // namespace trestle::messages
