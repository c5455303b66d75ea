#pragma once
#include "someip/net/parameter_traits.hpp"
#include "someip/net/utf16_text.hpp"
#include "someip/wire/payload_reader.hpp"

/// C++ values out of a payload: the second half of parameters.hpp.
namespace trestle::someip::parameters_detail {

/// What values are read from, by which rules, and the first error.
class Source {
 public:
  PayloadReader in;
  PayloadRules rules;

  Source(ByteView payload, const PayloadRules& by)
      : in{payload, with_empty_unions(by)}, rules{by}, room_bytes_{payload.size() / 2 * 3} {}

  [[nodiscard]] std::optional<WireError> error() const { return in.error() ? in.error() : failed_; }
  /// For what only the types tell.
  void fail(WireError error) {
    if (!failed_ && !in.error()) {
      failed_ = error;
    }
  }
  /// Where text goes that has to be converted.
  std::span<char> room_for(StringEncoding encoding) {
    if (encoding != StringEncoding::utf8) {
      room_.resize(room_bytes_);
    }
    return room_;
  }

 private:
  std::size_t room_bytes_;  // what takes 2 bytes in UTF-16 never takes more than 3 in UTF-8
  std::vector<char> room_;
  std::optional<WireError> failed_;
};

template <typename T>
void read(Source& from, T& value);

template <typename T>
T read_number(PayloadReader& in) {
  if constexpr (std::is_same_v<T, bool>) {
    return in.boolean();
  } else if constexpr (std::is_same_v<T, float>) {
    return in.f32();
  } else if constexpr (std::is_same_v<T, double>) {
    return in.f64();
  } else if constexpr (sizeof(T) == 1) {
    return static_cast<T>(in.u8());
  } else if constexpr (sizeof(T) == 2) {
    return static_cast<T>(in.u16());
  } else if constexpr (sizeof(T) == 4) {
    return static_cast<T>(in.u32());
  } else {
    static_assert(sizeof(T) == 8);
    return static_cast<T>(in.u64());
  }
}

/// Reads an array of any size, element for element.
template <typename Element, typename Take>
void read_elements(Source& from, Take take) {
  auto array = from.in.begin_array();
  while (from.in.more(array)) {
    Element element{};
    read(from, element);
    take(std::move(element));
  }
  from.in.end(array);
}

template <typename... Ts>
void read_union(Source& from, std::variant<Ts...>& value) {
  using Variant = std::variant<Ts...>;
  constexpr std::uint32_t first = first_union_type<Variant>;
  const auto open = from.in.begin_union(sizeof...(Ts) - 1 + first, longest_alternative<Variant>(from.rules));
  if (open.type < first) {
    from.fail(WireError::bad_union_type);
  }
  const auto take = [&]<std::size_t index>(std::integral_constant<std::size_t, index>) {
    if (open.type != index + first) {
      return;
    }
    auto& member = value.template emplace<index>();
    if constexpr (!std::is_same_v<decltype(member), std::monostate&>) {
      read(from, member);
    }
  };
  [&]<std::size_t... indices>(std::index_sequence<indices...>) {
    (take(std::integral_constant<std::size_t, indices>{}), ...);
  }
  (std::index_sequence_for<Ts...>{});
  from.in.end(open.open);
}

/// Where the members of a tagged struct go, and which of them have been there.
template <typename T>
struct Members {
  static constexpr std::size_t size = boost::pfr::tuple_size_v<T>;
  T& structure;
  std::array<bool, size> read{};
};

/// A member that is looked at once its tag has been read. The bytes of others are skipped.
template <std::size_t index, typename T>
void read_tagged_member(Source& from, DataId id, Members<T>& members) {
  if (id != data_id<T>(index)) {
    return;
  }
  if (members.read[index]) {
    return from.fail(WireError::bad_tag);
  }
  members.read[index] = true;
  auto& member = boost::pfr::get<index>(members.structure);
  if constexpr (is<std::decay_t<decltype(member)>, std::optional>) {
    read(from, member.emplace());
  } else {
    read(from, member);
  }
}

/// What a member is when the message does not have it.
template <std::size_t index, typename T>
void leave_out_member(Source& from, Members<T>& members) {
  auto& member = boost::pfr::get<index>(members.structure);
  if (members.read[index]) {
    return;
  }
  if constexpr (is<std::decay_t<decltype(member)>, std::optional>) {
    member.reset();
  } else {
    from.fail(WireError::truncated);
  }
}

template <Tagged T>
void read_tagged_struct(Source& from, T& value) {
  Members<T> members{value};
  const auto open = from.in.begin_struct();
  [&]<std::size_t... indices>(std::index_sequence<indices...>) {
    while (const auto id = from.in.next_member()) {
      (read_tagged_member<indices>(from, *id, members), ...);
    }
    (leave_out_member<indices>(from, members), ...);
  }
  (std::make_index_sequence<Members<T>::size>{});
  from.in.end(open);
}

template <typename T>
void read(Source& from, T& value) {
  PayloadReader& in = from.in;
  if constexpr (std::is_enum_v<T>) {
    value = static_cast<T>(read_number<std::underlying_type_t<T>>(in));
  } else if constexpr (std::is_arithmetic_v<T>) {
    value = read_number<T>(in);
  } else if constexpr (std::is_same_v<T, std::string>) {
    value = in.string(from.room_for(from.rules.string_encoding));
  } else if constexpr (std::is_same_v<T, std::u16string>) {
    const StringEncoding encoding = utf16_encoding(from.rules);
    value = to_utf16(in.string(from.room_for(encoding), encoding));
  } else if constexpr (byte_order_of<T>) {
    const std::endian before = in.byte_order(*byte_order_of<T>);
    read(from, value.value);
    in.byte_order(before);
  } else if constexpr (is_fixed_string<T>) {
    value.text = in.fixed_string(fixed_string_bytes<T>, from.room_for(from.rules.string_encoding));
  } else if constexpr (is_bytes<T>) {
    const ByteView bytes = in.byte_array();
    value.resize(bytes.size());
    std::ranges::copy(bytes, std::as_writable_bytes(std::span{value}).begin());
  } else if constexpr (is<T, std::vector>) {
    read_elements<typename T::value_type>(
        from, [&](typename T::value_type&& element) { value.push_back(std::move(element)); });
  } else if constexpr (is<T, std::map>) {
    using Pair = std::pair<typename T::key_type, typename T::mapped_type>;
    read_elements<Pair>(from, [&](Pair&& element) { value.insert(std::move(element)); });
  } else if constexpr (is_array<T>) {
    const auto array = in.begin_fixed_array();
    for (auto& element : value) {
      read(from, element);
    }
    in.end(array);
  } else if constexpr (is<T, std::variant>) {
    read_union(from, value);
  } else if constexpr (Tagged<T>) {
    read_tagged_struct(from, value);
  } else {
    const auto open = in.begin_struct();
    visit_members(value, [&](auto&... members) { (read(from, members), ...); });
    in.end(open);
  }
}

}  // namespace trestle::someip::parameters_detail
