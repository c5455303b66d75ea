#pragma once
#include "someip/wire/types.hpp"

namespace trestle::sd {

/// Whether no method and no event may have this id.  [feat_req_someipids_636]
[[nodiscard]] constexpr bool is_reserved(someip::MethodId id) noexcept {
  return id == someip::MethodId{0} || id == someip::MethodId{0x7fff} || id == someip::MethodId{0x8000} ||
         id == someip::MethodId{0xffff};
}

/// What an id is used for: getters and setters count as methods, notifiers as events.
enum class IdKind : std::uint8_t { method, event };

/// Whether the id is in the range for the other kind: methods are below 0x8000, events from there on. That is
/// a "should", so it can be used.  [feat_req_someip_626] [feat_req_someip_60] [feat_req_someip_67]
[[nodiscard]] constexpr bool is_for_other_kind(someip::MethodId id, IdKind kind) noexcept {
  return (someip::value(id) >= 0x8000) != (kind == IdKind::event);
}

}  // namespace trestle::sd
