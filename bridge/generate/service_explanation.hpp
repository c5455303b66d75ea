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
  struct Id {
    std::string part;        ///< of a field: "get", "set", "notify"; else empty
    std::string text;        ///< "0x4711"
    bool is_chosen = false;  ///< no description gives it: Trestle chose it
  };
  struct Member {
    std::string kind;  ///< "method", "event", "field"
    std::string name;  ///< "open", "open:slowly"
    std::vector<Id> ids{};
    std::vector<Message> messages{};
  };
  std::string name;  ///< "car.Door"
  Id id;
  std::string version;
  std::vector<Member> members{};  ///< methods, events, fields
};

/// @param name  of a service, "Door" or "car.Door".
/// @return nothing: there is no such service; or which there are, where it is not clear which one is meant.
[[nodiscard]] tl::expected<std::optional<ServiceExplanation>, std::string> explain_service(
    const describe::System& system, std::string_view name);

/// All that can be explained: services with their members, and types.
struct Contents {
  struct NamedType {
    std::string name;  ///< "car.Door.Side"
    std::string kind;  ///< "enumeration"
  };
  std::vector<ServiceExplanation> services{};
  std::vector<NamedType> types{};
};

[[nodiscard]] Contents contents_of(const describe::System& system);

/// As a table for people.
[[nodiscard]] std::string to_text(const ServiceExplanation& explanation);
[[nodiscard]] std::string to_text(const Contents& contents);
/// An object: docs/describe.md.
[[nodiscard]] std::string to_json_text(const ServiceExplanation& explanation);
[[nodiscard]] std::string to_json_text(const Contents& contents);

}  // namespace trestle::generate
