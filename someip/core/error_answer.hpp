#pragma once
#include <optional>

#include "someip/wire/header.hpp"

namespace trestle::someip {

/// The header of the message that tells the sender of `received` that it failed; its payload is empty.
/// [feat_req_someip_655]
///
/// @param code  why; not ReturnCode::ok.
/// @return nothing when no answer may be sent: to events, to fire-and-forget requests, to responses, and to
///         messages that bring an error themselves.  [feat_req_someip_597] [feat_req_someip_654]
///         [feat_req_someip_704]
[[nodiscard]] std::optional<Header> error_answer(const Header& received, ReturnCode code) noexcept;

}  // namespace trestle::someip
