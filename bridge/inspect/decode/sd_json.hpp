#pragma once
#include <functional>
#include <optional>

#include "bridge/describe/interfaces.hpp"
#include "bridge/inspect/decode/message_json.hpp"
#include "someip/wire/endpoint.hpp"

namespace trestle::inspect {

/// Whether a message has the Message ID of service discovery.  [feat_req_someipsd_26]
[[nodiscard]] bool has_sd_id(const someip::Header& header) noexcept;

/// Adds "sd" to the object of such a message: flags, entries and options as far as they can be read.
/// @param offset     of the message, which the violation's offset counts from.
/// @param announced  called for each unicast or multicast endpoint; may be empty.
/// @param interfaces  by which entries have names; null: none.
/// @return the first rule that the message breaks.
[[nodiscard]] std::optional<traffic::Violation> add_sd(
    Json& object, std::size_t offset, const someip::Message& message,
    const std::function<void(Transport, const Endpoint&)>& announced,
    const describe::Interfaces* interfaces = nullptr);

}  // namespace trestle::inspect
