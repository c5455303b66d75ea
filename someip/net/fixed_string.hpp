#pragma once
#include <cstddef>
#include <string>

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

}  // namespace trestle::someip
