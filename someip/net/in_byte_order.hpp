#pragma once
#include <bit>
#include <compare>

namespace trestle::someip {

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
