#pragma once
#include <cstddef>
#include <optional>

#include "bridge/messages/convert/program/program.hpp"

namespace trestle::messages {

/// The most bytes that a message of this program has in SOME/IP; nothing where no bound is known: there are
/// strings or arrays without one, or length fields behind which others may have more than we know.
/// [feat_req_someipcompat_1199]
[[nodiscard]] std::optional<std::size_t> most_someip_bytes(const Program& program);

/// What a receiver is to have room for, for a message that may be so large: a newer interface may have more
/// behind what we know [feat_req_someip_168], and end-to-end protection has a header.
/// @return someip::max_plain_payload_bytes where that does not need segments.
[[nodiscard]] std::size_t room_to_receive(std::size_t most_bytes) noexcept;

}  // namespace trestle::messages
