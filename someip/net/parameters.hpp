#pragma once
#include <functional>
#include <stdexcept>

#include "someip/net/parameter_reader.hpp"
#include "someip/net/parameter_writer.hpp"

/// C++ values as the parameters of methods, events and fields, and back, as the specification lays them out:
///
///     bool, integers, float, double, enums       as they are; a bit field is an unsigned integer
///     std::string                                a string of any length, in the encoding that the rules say
///     std::u16string                             one in UTF-16, whatever they say
///     FixedString<N>                             a string of N bytes
///     LittleEndian<T>, BigEndian<T>              a T in its own byte order, whatever the rules say
///     std::vector<T>                             an array of any size
///     std::array<T, N>                           an array whose size is fixed
///     std::map<K, V>                             an array of structs of key and value
///     std::variant<Ts...>                        a union, whose types count from 1 in this order
///     std::variant<std::monostate, Ts...>        a union that may be empty, which is type 0
///     std::tuple, std::pair, plain structs       a struct of its members in their order
///     plain structs with data_ids                a struct whose members have tags
///     std::optional<T> in one of those           a member that may be left out
///
/// A plain struct has public members and neither constructors nor bases: `struct Pose { double x; float y;
/// };`. Its members have tags (TLV, see tag.hpp) when it says which:
///
///     struct Reading {
///       std::uint16_t sensor = 0;
///       std::optional<float> distance;
///       static constexpr std::array data_ids{1, 2};
///     };
///
/// Tagged members come in any order; those that are not known are skipped, and those that are no
/// std::optional have to be there. A tagged struct needs a length field (PayloadRules::struct_length) where
/// anything but the end of the message, of an array, a union or another tagged member comes after it.
namespace trestle::someip {

/// The payload that consists of these parameters.
/// @throws std::invalid_argument when a string is not valid Unicode or longer than it may be, a length field
///         cannot say how long something is, tags and alignment meet, or nobody could tell where a tagged
///         struct ends.
template <typename... Ts>
[[nodiscard]] std::vector<std::byte> pack(const Ts&... parameters);
/// The same for a service with rules of its own.
template <typename... Ts>
[[nodiscard]] std::vector<std::byte> pack(const PayloadRules& rules, const Ts&... parameters);

/// The one T, or the tuple of Ts.
template <typename... Ts>
using Parameters = std::conditional_t<sizeof...(Ts) == 1, std::tuple_element_t<0, std::tuple<Ts..., void>>,
                                      std::tuple<Ts...>>;

/// The parameters that a payload consists of; or what is wrong, as PayloadReader says: truncated also when a
/// tagged member is missing. Bytes after the last are left alone.  [feat_req_someip_168]
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

template <typename T>
inline constexpr bool is_result = false;
template <typename T>
inline constexpr bool is_result<Result<T, ReturnCode>> = true;

template <typename... Ts>
Result<std::tuple<Ts...>> read_all(ByteView payload, const PayloadRules& rules) {
  Source from{payload, rules};
  std::tuple<Ts...> values;
  std::apply([&](auto&... each) { (read(from, each), ...); }, values);
  if (const auto error = from.error()) {
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
    parameters_detail::Sink to{room, rules};
    (parameters_detail::write(to, parameters), ...);
    const auto payload = to.out.finish();
    if (payload && !to.ambiguous) {
      room.resize(payload->size());
      return room;
    }
    if (payload || payload.error() != WireError::no_room) {
      throw std::invalid_argument{std::string{"parameters that cannot be sent: "} +
                                  (payload ? "something follows a tagged struct without a length field"
                                           : to_string(payload.error()))};
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
