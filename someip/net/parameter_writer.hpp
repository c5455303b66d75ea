#pragma once
#include "someip/net/parameter_traits.hpp"
#include "someip/net/utf16_text.hpp"
#include "someip/wire/payload_writer.hpp"

/// C++ values into a payload: the first half of parameters.hpp.
namespace trestle::someip::parameters_detail {

/// Where values are written to, and by which rules.
struct Sink {
  Sink(ByteSpan room, const PayloadRules& by) : out{room, with_empty_unions(by)}, rules{by} {}

  PayloadWriter out;
  PayloadRules rules;
  /// The last that was written is a tagged struct without a length field: only the end of what holds it tells
  /// where it ends, so that nothing may follow.
  bool open_ended = false;
  bool ambiguous = false;  ///< something followed

  /// Ends an element that began with a length field of this width.
  void end(const PayloadWriter::Open& element, FieldWidth length) {
    out.end(element);
    open_ended = open_ended && length == FieldWidth::none;
  }
};

template <typename T>
void write(Sink& to, const T& value);

template <typename T>
void write_number(PayloadWriter& out, T number) {
  if constexpr (std::is_same_v<T, bool>) {
    out.boolean(number);
  } else if constexpr (std::is_same_v<T, float>) {
    out.f32(number);
  } else if constexpr (std::is_same_v<T, double>) {
    out.f64(number);
  } else if constexpr (sizeof(T) == 1) {
    out.u8(static_cast<std::uint8_t>(number));
  } else if constexpr (sizeof(T) == 2) {
    out.u16(static_cast<std::uint16_t>(number));
  } else if constexpr (sizeof(T) == 4) {
    out.u32(static_cast<std::uint32_t>(number));
  } else {
    static_assert(sizeof(T) == 8);
    out.u64(static_cast<std::uint64_t>(number));
  }
}

template <typename T>
void write_elements(Sink& to, const T& elements, const PayloadWriter::Open& array, FieldWidth length) {
  for (const typename T::value_type& element : elements) {
    write(to, element);
    to.ambiguous = to.ambiguous || to.open_ended;  // also of one: another value would have two
  }
  to.end(array, length);
}

template <typename T>
void write_union(Sink& to, const T& value) {
  const auto type = static_cast<std::uint32_t>(value.index()) + first_union_type<T>;
  const auto open = to.out.begin_union(type, longest_alternative<T>(to.rules));
  std::visit(
      [&]<typename Member>(const Member& member) {
        if constexpr (!std::is_same_v<Member, std::monostate>) {
          write(to, member);
        }
      },
      value);
  to.end(open, to.rules.union_length);
}

template <typename T>
void write_tagged_member(Sink& to, DataId id, const T& member) {
  if constexpr (is<T, std::optional>) {
    if (member) {
      write_tagged_member(to, id, *member);
    }
  } else {
    to.out.tagged(id);
    write(to, member);
    to.open_ended = false;  // a tag tells where its member ends
  }
}

template <Tagged T>
void write_tagged_struct(Sink& to, const T& value) {
  const auto open = to.out.begin_struct();
  visit_members(value, [&](const auto&... members) {
    std::size_t index = 0;
    (write_tagged_member(to, data_id<T>(index++), members), ...);
  });
  to.out.end(open);
  to.open_ended = to.rules.struct_length == FieldWidth::none;
}

template <typename T>
void write(Sink& to, const T& value) {
  to.ambiguous = to.ambiguous || to.open_ended;
  PayloadWriter& out = to.out;
  if constexpr (std::is_enum_v<T>) {
    write_number(out, static_cast<std::underlying_type_t<T>>(value));
  } else if constexpr (std::is_arithmetic_v<T>) {
    write_number(out, value);
  } else if constexpr (std::is_convertible_v<const T&, std::string_view>) {
    out.string(value);
  } else if constexpr (std::is_convertible_v<const T&, std::u16string_view>) {
    out.string(to_utf8(value), utf16_encoding(to.rules));
  } else if constexpr (byte_order_of<T>) {
    const std::endian before = out.byte_order(*byte_order_of<T>);
    write(to, value.value);
    out.byte_order(before);
  } else if constexpr (is_fixed_string<T>) {
    out.fixed_string(value.text, fixed_string_bytes<T>);
  } else if constexpr (is_bytes<T>) {
    out.byte_array(std::as_bytes(std::span{value}));
  } else if constexpr (is<T, std::vector> || is<T, std::map>) {
    write_elements(to, value, out.begin_array(), to.rules.array_length);
  } else if constexpr (is_array<T>) {
    write_elements(to, value, out.begin_fixed_array(), to.rules.fixed_array_length);
  } else if constexpr (is<T, std::variant>) {
    write_union(to, value);
  } else if constexpr (Tagged<T>) {
    write_tagged_struct(to, value);
  } else {
    const auto open = out.begin_struct();
    visit_members(value, [&](const auto&... members) { (write(to, members), ...); });
    to.end(open, to.rules.struct_length);
  }
}

}  // namespace trestle::someip::parameters_detail
