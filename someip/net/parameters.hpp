#pragma once
#include <array>
#include <boost/pfr/core.hpp>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "someip/wire/payload_reader.hpp"
#include "someip/wire/payload_writer.hpp"

/// C++ values as the parameters of methods, events and fields, and back, as the specification lays them out:
///
///     bool, integers, float, double, enums       as they are
///     std::string                                a string of any length
///     std::vector<T>                             an array of any size
///     std::array<T, N>                           an array whose size is fixed
///     std::map<K, V>                             an array of structs of key and value
///     std::tuple, std::pair, plain structs       a struct of its members in their order
///
/// A plain struct has public members and neither constructors nor bases: `struct Pose { double x; float y;
/// };`. What else there is (unions, fixed strings) PayloadWriter and PayloadReader can do.
namespace trestle::someip {

/// The payload that consists of these parameters.
/// @throws std::invalid_argument when a string is not valid UTF-8, or a length field cannot say how long
///         something is.
template <typename... Ts>
[[nodiscard]] std::vector<std::byte> pack(const Ts&... parameters);
/// The same for a service with rules of its own.
template <typename... Ts>
[[nodiscard]] std::vector<std::byte> pack(const PayloadRules& rules, const Ts&... parameters);

/// The one T, or the tuple of Ts.
template <typename... Ts>
using Parameters = std::conditional_t<sizeof...(Ts) == 1, std::tuple_element_t<0, std::tuple<Ts..., void>>,
                                      std::tuple<Ts...>>;

/// The parameters that a payload consists of; or what is wrong with it, as PayloadReader says. Bytes after
/// the last parameter are left alone.  [feat_req_someip_168]
template <typename... Ts>
[[nodiscard]] Result<Parameters<Ts...>> unpack(ByteView payload, const PayloadRules& rules = {});

/// A function of values as one of payloads: `typed([](double x, double y) { return x * y; })`.
///
/// What the function returns becomes the payload: nothing, one parameter, or several as a std::tuple. It may
/// return a Result<T, ReturnCode>, to answer with an error. A payload that does not hold the arguments gives
/// ReturnCode::malformed_message without a call.
template <typename Function>
[[nodiscard]] std::function<Result<std::vector<std::byte>, ReturnCode>(ByteView)> typed(
    Function function, const PayloadRules& rules = {});

namespace parameters_detail {

template <typename T, template <typename...> typename Of>
inline constexpr bool is = false;
template <template <typename...> typename Of, typename... Ts>
inline constexpr bool is<Of<Ts...>, Of> = true;
template <typename T>
inline constexpr bool is_array = false;
template <typename T, std::size_t size>
inline constexpr bool is_array<std::array<T, size>> = true;
template <typename T>
inline constexpr bool is_result = false;
template <typename T>
inline constexpr bool is_result<Result<T, ReturnCode>> = true;
template <typename T>
inline constexpr bool is_bytes =
    std::is_same_v<T, std::vector<std::byte>> || std::is_same_v<T, std::vector<std::uint8_t>>;

template <typename T>
void write(PayloadWriter& out, const T& value) {
  if constexpr (std::is_same_v<T, bool>) {
    out.boolean(value);
  } else if constexpr (std::is_same_v<T, float>) {
    out.f32(value);
  } else if constexpr (std::is_same_v<T, double>) {
    out.f64(value);
  } else if constexpr (std::is_enum_v<T>) {
    write(out, static_cast<std::underlying_type_t<T>>(value));
  } else if constexpr (std::is_integral_v<T>) {
    if constexpr (sizeof(T) == 1) {
      out.u8(static_cast<std::uint8_t>(value));
    } else if constexpr (sizeof(T) == 2) {
      out.u16(static_cast<std::uint16_t>(value));
    } else if constexpr (sizeof(T) == 4) {
      out.u32(static_cast<std::uint32_t>(value));
    } else {
      out.u64(static_cast<std::uint64_t>(value));
    }
  } else if constexpr (std::is_convertible_v<const T&, std::string_view>) {
    out.string(value);
  } else if constexpr (is_bytes<T>) {
    out.byte_array(std::as_bytes(std::span{value}));
  } else if constexpr (is<T, std::vector> || is<T, std::map>) {
    const auto array = out.begin_array();
    for (const typename T::value_type& element : value) {
      write(out, element);
    }
    out.end(array);
  } else if constexpr (is_array<T>) {
    const auto array = out.begin_fixed_array();
    for (const auto& element : value) {
      write(out, element);
    }
    out.end(array);
  } else {
    const auto all = [&](const auto&... members) { (write(out, members), ...); };
    const auto open = out.begin_struct();
    if constexpr (is<T, std::tuple> || is<T, std::pair>) {
      std::apply(all, value);
    } else {
      std::apply(all, boost::pfr::structure_tie(value));
    }
    out.end(open);
  }
}

/// A reader, and room for text that has to be converted.
struct Source {
  PayloadReader in;
  std::vector<char> room;
};

template <typename T>
void read(Source& from, T& value) {
  PayloadReader& in = from.in;
  if constexpr (std::is_same_v<T, bool>) {
    value = in.boolean();
  } else if constexpr (std::is_same_v<T, float>) {
    value = in.f32();
  } else if constexpr (std::is_same_v<T, double>) {
    value = in.f64();
  } else if constexpr (std::is_enum_v<T>) {
    std::underlying_type_t<T> number{};
    read(from, number);
    value = static_cast<T>(number);
  } else if constexpr (std::is_integral_v<T>) {
    if constexpr (sizeof(T) == 1) {
      value = static_cast<T>(in.u8());
    } else if constexpr (sizeof(T) == 2) {
      value = static_cast<T>(in.u16());
    } else if constexpr (sizeof(T) == 4) {
      value = static_cast<T>(in.u32());
    } else {
      value = static_cast<T>(in.u64());
    }
  } else if constexpr (std::is_same_v<T, std::string>) {
    value = in.string(from.room);
  } else if constexpr (is_bytes<T>) {
    const ByteView bytes = in.byte_array();
    value.resize(bytes.size());
    std::ranges::copy(bytes, std::as_writable_bytes(std::span{value}).begin());
  } else if constexpr (is<T, std::vector>) {
    auto array = in.begin_array();
    while (in.more(array)) {
      typename T::value_type element{};
      read(from, element);
      value.push_back(std::move(element));
    }
    in.end(array);
  } else if constexpr (is<T, std::map>) {
    auto array = in.begin_array();
    while (in.more(array)) {
      std::pair<typename T::key_type, typename T::mapped_type> element{};
      read(from, element);
      value.insert(std::move(element));
    }
    in.end(array);
  } else if constexpr (is_array<T>) {
    const auto array = in.begin_fixed_array();
    for (auto& element : value) {
      read(from, element);
    }
    in.end(array);
  } else {
    const auto all = [&](auto&... members) { (read(from, members), ...); };
    const auto open = in.begin_struct();
    if constexpr (is<T, std::tuple> || is<T, std::pair>) {
      std::apply(all, value);
    } else {
      std::apply(all, boost::pfr::structure_tie(value));
    }
    in.end(open);
  }
}

template <typename... Ts>
Result<std::tuple<Ts...>> read_all(ByteView payload, const PayloadRules& rules) {
  const bool convert = rules.string_encoding != StringEncoding::utf8;
  Source from{PayloadReader{payload, rules}, std::vector<char>(convert ? payload.size() / 2 * 3 : 0)};
  std::tuple<Ts...> values;
  std::apply([&](auto&... each) { (read(from, each), ...); }, values);
  if (const auto error = from.in.error()) {
    return tl::unexpected{*error};
  }
  return values;
}

template <typename T>
std::vector<std::byte> pack_result(const PayloadRules& rules, const T& result) {
  if constexpr (is<T, std::tuple>) {
    return std::apply([&](const auto&... each) { return pack(rules, each...); }, result);
  } else {
    return pack(rules, result);
  }
}

template <typename R, typename... Args>
auto typed(std::function<R(Args...)> function, const PayloadRules& rules) {
  return [function = std::move(function),
          rules](ByteView payload) -> Result<std::vector<std::byte>, ReturnCode> {
    auto arguments = read_all<std::decay_t<Args>...>(payload, rules);
    if (!arguments) {
      return tl::unexpected{ReturnCode::malformed_message};
    }
    if constexpr (std::is_void_v<R>) {
      std::apply(function, std::move(*arguments));
      return {};
    } else if constexpr (is_result<R>) {
      const R result = std::apply(function, std::move(*arguments));
      if (!result) {
        return tl::unexpected{result.error()};
      }
      if constexpr (std::is_void_v<typename R::value_type>) {
        return {};
      } else {
        return pack_result(rules, *result);
      }
    } else {
      return pack_result(rules, std::apply(function, std::move(*arguments)));
    }
  };
}

}  // namespace parameters_detail

template <typename... Ts>
std::vector<std::byte> pack(const PayloadRules& rules, const Ts&... parameters) {
  for (std::vector<std::byte> room(256);; room.resize(room.size() * 4)) {
    PayloadWriter out{room, rules};
    (parameters_detail::write(out, parameters), ...);
    const auto payload = out.finish();
    if (payload) {
      room.resize(payload->size());
      return room;
    }
    if (payload.error() != WireError::no_room) {
      throw std::invalid_argument{std::string{"parameters that cannot be sent: "} +
                                  to_string(payload.error())};
    }
  }
}

template <typename... Ts>
std::vector<std::byte> pack(const Ts&... parameters) {
  return pack(PayloadRules{}, parameters...);
}

template <typename... Ts>
Result<Parameters<Ts...>> unpack(ByteView payload, const PayloadRules& rules) {
  auto values = parameters_detail::read_all<Ts...>(payload, rules);
  if constexpr (sizeof...(Ts) == 1) {
    return std::move(values).map([](std::tuple<Ts...>&& one) { return std::get<0>(std::move(one)); });
  } else {
    return values;
  }
}

template <typename Function>
std::function<Result<std::vector<std::byte>, ReturnCode>(ByteView)> typed(Function function,
                                                                          const PayloadRules& rules) {
  return parameters_detail::typed(std::function{std::move(function)}, rules);
}

}  // namespace trestle::someip
