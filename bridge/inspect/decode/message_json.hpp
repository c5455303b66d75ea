#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "bridge/traffic/violation.hpp"
#include "someip/wire/header.hpp"
#include "someip/wire/tp.hpp"

/// The parts of what `trestle decode` prints. docs/decode.md documents every field: a change here is a change
/// of an interface.
namespace trestle::inspect {

/// Objects whose fields keep the order in which they were added.
using Json = nlohmann::ordered_json;

/// Sets "error" of `object`.
void add_error(Json& object, const traffic::Violation& violation);

/// "0x1234"
[[nodiscard]] std::string hex_id(std::uint16_t id);
/// Lower-case digits without separators.
[[nodiscard]] std::string hex_digits(ByteView bytes);

/// The specification's name of a message type, TP_ in front of segments; null for a type that does not exist.
/// [feat_req_someip_684]
[[nodiscard]] Json message_type_name(someip::MessageType type);
/// The specification's name of a return code; null for one that it leaves to applications or reserves.
/// [feat_req_someip_371]
[[nodiscard]] Json return_code_name(someip::ReturnCode code);

/// Adds the fields of a header, "service" to "return_code_value".
void add_header(Json& object, const someip::Header& header, std::size_t payload_bytes);
/// Adds those fields of a header that are there when bytes end too early or contradict themselves.
void add_partial_header(Json& object, ByteView bytes);

/// Adds "tp": offset in bytes, more_segments and the reserved bits of a segment.
void add_tp(Json& object, const someip::TpHeader& tp);

/// Adds "magic_cookie" if the message is one.  [feat_req_someip_609]
void add_magic_cookie(Json& object, const someip::Message& message);
/// Whether the message is the cookie of a client or of a server.  [feat_req_someip_609]
[[nodiscard]] bool is_magic_cookie(const someip::Message& message) noexcept;

}  // namespace trestle::inspect
