#pragma once
#include <bit>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "someip/wire/payload_rules.hpp"
#include "someip/wire/tag.hpp"

namespace trestle::messages {

/// What one message type is on the SOME/IP side, where its `.msg` file alone does not tell.
struct TypeRules {
  enum class Form : std::uint8_t {
    structure,  ///< its fields, one after another; with tags if there are any
    choice,     ///< a union: each field is a T[<=1], at most one of them has its element
    bits8,      ///< a bit field: each field is a bool or bool[N], the first is the lowest bit
    bits16,
    bits32,
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
  std::map<std::string, TypeRules, std::less<>> types{};  ///< by "pkg/msg/Type"
  friend bool operator==(const MessageRules&, const MessageRules&) = default;
};

}  // namespace trestle::messages
