#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/describe/system.hpp"

namespace trestle::generate {

/// A service as a whole: what may be called and subscribed to.
struct ServiceExplanation {
  struct Message {
    std::string part;    ///< "request", "response", "payload"
    std::string values;  ///< "Side side, uint16[] angles"; empty: none
  };
  struct Member {
    std::string kind;  ///< "method", "event", "field"
    std::string name;  ///< "open", "open:slowly"
    std::string ids;   ///< "0x0010"; of a field "get 0x0001, notify 0x8001"
    std::vector<Message> messages{};
  };
  std::string name;  ///< "car.Door"
  std::string id;    ///< "0x4711"
  std::string version;
  std::vector<Member> members{};  ///< methods, events, fields
};

/// @param name  of a service, "Door" or "car.Door".
/// @return nothing: there is no such service; or which there are, where it is not clear which one is meant.
[[nodiscard]] tl::expected<std::optional<ServiceExplanation>, std::string> explain_service(
    const describe::System& system, std::string_view name);

/// As a table for people.
[[nodiscard]] std::string to_text(const ServiceExplanation& explanation);
/// An object: docs/describe.md.
[[nodiscard]] std::string to_json_text(const ServiceExplanation& explanation);

}  // namespace trestle::generate
