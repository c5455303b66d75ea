#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <boost/pfr/core.hpp>
#include <compare>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <variant>
#include <vector>

#include "someip/wire/payload_rules.hpp"
#include "someip/wire/tag.hpp"

namespace trestle::someip {

/// A text that takes `size` bytes of a payload, whatever its length: byte order mark, characters and
/// terminator have to fit into them, and zeros fill the rest.  [feat_req_someip_233]
///
///     struct Plate { FixedString<16> number; };
///     const Plate plate{.number = {"B-TR 1"}};
template <std::size_t size>
struct FixedString {
  std::string text;  ///< in UTF-8, whatever it is on the wire
  friend auto operator<=>(const FixedString&, const FixedString&) = default;
};

/// A parameter that has its own byte order, whatever that of the rules is. All numbers in it have it, unless
/// they say otherwise themselves; its length and type fields don't.  [feat_req_someip_224]
///
///     struct Frame { LittleEndian<std::uint32_t> id; BigEndian<std::vector<float>> samples; };
///     const Frame frame{.id = {7}, .samples = {{1.5F}}};
template <typename T, std::endian order>
struct InByteOrder {
  T value{};
  friend auto operator<=>(const InByteOrder&, const InByteOrder&) = default;
};
template <typename T>
using LittleEndian = InByteOrder<T, std::endian::little>;
template <typename T>
using BigEndian = InByteOrder<T, std::endian::big>;

}  // namespace trestle::someip

/// What pack() and unpack() ask about types.
namespace trestle::someip::parameters_detail {

template <typename T, template <typename...> typename Of>
inline constexpr bool is = false;
template <template <typename...> typename Of, typename... Ts>
inline constexpr bool is<Of<Ts...>, Of> = true;
template <typename T>
inline constexpr bool is_array = false;
template <typename T, std::size_t size>
inline constexpr bool is_array<std::array<T, size>> = true;
template <typename T>
inline constexpr std::size_t fixed_string_bytes = 0;
template <std::size_t size>
inline constexpr std::size_t fixed_string_bytes<FixedString<size>> = size;
template <typename T>
inline constexpr bool is_fixed_string = false;
template <std::size_t size>
inline constexpr bool is_fixed_string<FixedString<size>> = true;
template <typename T>
inline constexpr std::optional<std::endian> byte_order_of = std::nullopt;
template <typename T, std::endian order>
inline constexpr std::optional<std::endian> byte_order_of<InByteOrder<T, order>> = order;
template <typename T>
inline constexpr bool is_bytes =
    std::is_same_v<T, std::vector<std::byte>> || std::is_same_v<T, std::vector<std::uint8_t>>;
template <typename T>
inline constexpr bool is_tuple = is<T, std::tuple> || is<T, std::pair>;

/// A struct whose members have tags.
template <typename T>
concept Tagged = requires {
  T::data_ids;
};

template <typename T>
constexpr bool data_ids_are_unique() {
  for (auto id = std::begin(T::data_ids); id != std::end(T::data_ids); ++id) {
    if (std::find(std::begin(T::data_ids), id, *id) != id) {
      return false;
    }
  }
  return true;
}

template <Tagged T>
constexpr DataId data_id(std::size_t member) {
  static_assert(std::size(T::data_ids) == boost::pfr::tuple_size_v<T>,
                "data_ids has to name one id for each member of the struct, in their order");
  static_assert(std::all_of(std::begin(T::data_ids), std::end(T::data_ids),
                            [](auto id) { return id >= 0 && id <= max_data_id; }),
                "data_ids go from 0 to 0xfff");
  static_assert(data_ids_are_unique<T>(), "data_ids must not name an id twice");
  return DataId{static_cast<std::uint16_t>(T::data_ids[member])};
}

/// How a std::u16string is written: big endian, unless all texts are little endian.  [feat_req_someip_234]
constexpr StringEncoding utf16_encoding(const PayloadRules& rules) {
  return rules.string_encoding == StringEncoding::utf16le ? StringEncoding::utf16le : StringEncoding::utf16be;
}

/// That a type which is not one of the others is a struct.
template <typename T>
constexpr void expect_structure() {
  static_assert(
      !is<T, std::optional>,
      "std::optional is for members of a struct with data_ids; anywhere else an optional element is a "
      "std::vector of none or one [feat_req_someip_252]");
  static_assert(is_tuple<T> || is<T, std::optional> || std::is_aggregate_v<T>,
                "this type cannot be a parameter: someip/net/parameters.hpp lists those that can");
}

template <typename T, typename Visit>
void visit_members(T& structure, const Visit& visit) {
  expect_structure<std::remove_const_t<T>>();
  if constexpr (is_tuple<std::remove_const_t<T>>) {
    std::apply(visit, structure);
  } else if constexpr (std::is_aggregate_v<T>) {
    std::apply(visit, boost::pfr::structure_tie(structure));
  }
}

/// The type field that stands for the first alternative of a union: a std::monostate there is the empty
/// union, 0; all else counts from 1.  [feat_req_someip_273]
template <typename... Ts>
constexpr std::uint32_t first_type(const std::variant<Ts...>* /*type*/) {
  constexpr std::array<bool, sizeof...(Ts)> empty{std::is_same_v<Ts, std::monostate>...};
  static_assert(std::count(empty.begin() + 1, empty.end(), true) == 0,
                "std::monostate, the empty union, has to be the first alternative of a std::variant");
  return empty.front() ? 0 : 1;
}
template <typename T>
inline constexpr std::uint32_t first_union_type = first_type(static_cast<const T*>(nullptr));

/// The type of a union says whether it may be empty.
inline PayloadRules with_empty_unions(PayloadRules rules) {
  rules.union_null = true;
  return rules;
}

template <typename T>
std::optional<std::size_t> fixed_bytes(const PayloadRules& rules);

template <template <typename...> typename Of, typename... Ts>
std::array<std::optional<std::size_t>, sizeof...(Ts)> bytes_of_each(const PayloadRules& rules,
                                                                    const Of<Ts...>* /*type*/) {
  return {fixed_bytes<Ts>(rules)...};
}

/// The size of the longest alternative of a union without a length field, to which the others are padded; 0
/// where unions have one, or an alternative does not have one size only.  [feat_req_someip_583]
template <typename Variant>
std::size_t longest_alternative(const PayloadRules& rules) {
  if (rules.union_length != FieldWidth::none) {
    return 0;
  }
  const auto each = bytes_of_each(rules, static_cast<const Variant*>(nullptr));
  return std::ranges::all_of(each, [](const auto& size) { return size.has_value(); })
             ? **std::ranges::max_element(each)
             : 0;
}

/// How many bytes any value of a type takes; nothing where that depends on the value.
template <typename T>
std::optional<std::size_t> fixed_bytes(const PayloadRules& rules) {
  if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
    return sizeof(T);
  } else if constexpr (std::is_same_v<T, std::monostate>) {
    return 0;
  } else if constexpr (byte_order_of<T>) {
    return fixed_bytes<decltype(T::value)>(rules);
  } else if constexpr (is_fixed_string<T>) {
    return fixed_string_bytes<T>;
  } else if constexpr (is_array<T>) {
    const auto element = fixed_bytes<typename T::value_type>(rules);
    return element ? std::optional{bytes(rules.fixed_array_length) + std::tuple_size_v<T> * *element}
                   : std::nullopt;
  } else if constexpr (is<T, std::variant>) {
    const std::size_t longest = longest_alternative<T>(rules);
    return longest != 0 ? std::optional{bytes(rules.union_type) + longest} : std::nullopt;
  } else if constexpr (is_tuple<T>) {
    std::size_t size = bytes(rules.struct_length);
    for (const auto& member : bytes_of_each(rules, static_cast<const T*>(nullptr))) {
      if (!member) {
        return std::nullopt;
      }
      size += *member;
    }
    return size;
  } else if constexpr (std::is_aggregate_v<T> && !Tagged<T>) {
    return fixed_bytes<decltype(boost::pfr::structure_to_tuple(std::declval<T>()))>(rules);
  } else {
    return std::nullopt;
  }
}

}  // namespace trestle::someip::parameters_detail
