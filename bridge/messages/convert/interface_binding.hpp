#pragma once
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "bridge/messages/convert/message_rules.hpp"
#include "bridge/messages/types/type_source.hpp"
#include "someip/wire/types.hpp"

namespace trestle::messages {

/// What an interface description tells of an interface besides its types: how SOME/IP carries it. FIDL and
/// ARXML have it, `.msg` and `.idl` files do not. See TypeSource::binding().
struct InterfaceBinding {
  std::optional<someip::ServiceId> service{};
  std::map<std::string, someip::MethodId, std::less<>> members{};  ///< methods and events, by their names
  MessageRules rules{};
};

}  // namespace trestle::messages
