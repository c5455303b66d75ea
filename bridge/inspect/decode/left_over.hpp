#pragma once
#include <cstddef>
#include <optional>
#include <string>

#include "bridge/describe/interfaces.hpp"
#include "bridge/inspect/decode/message_json.hpp"

namespace trestle::inspect {

/// Bytes behind the last value of a payload. A receiver ignores them, so that a newer sender may add members;
/// but whoever looks at messages wants to know that the description does not have all that is sent.
/// [feat_req_someip_168]
struct LeftOver {
  std::size_t offset = 0;  ///< in the payload
  std::size_t bytes = 0;
};

/// Nothing: there are none; or the payload does not fit the description, or is not described.
/// @param content     of the element, of a request or an answer.
/// @param has_header  its E2E header, if the description has one, is in the payload.
[[nodiscard]] std::optional<LeftOver> left_over(const describe::Interfaces& interfaces,
                                                const describe::ServiceElement& element,
                                                const describe::Content& content, ByteView payload,
                                                bool has_header = true);

/// "3 bytes left over at offset 12"
[[nodiscard]] std::string to_string(const LeftOver& left_over);
/// The same with its numbers, as the member "left_over" of a message.
[[nodiscard]] Json to_json(const LeftOver& left_over);

}  // namespace trestle::inspect
