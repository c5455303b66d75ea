#include "bridge/describe/model_source.hpp"

#include <utility>

#include "bridge/messages/types/parsers.hpp"

namespace trestle::describe {

std::optional<messages::InterfaceMessages> messages_of(const Lowered& lowered,
                                                       const messages::InterfaceName& interface,
                                                       const std::string& place) {
  messages::InterfaceMessages found;
  for (const std::string& name : messages::message_names(interface)) {
    const messages::MessageDefinition* const definition = lowered.definition(name);
    if (definition == nullptr) {
      return std::nullopt;
    }
    found.push_back(*definition);
  }
  messages::add_generated_messages(found, interface, place);
  return found;
}

tl::expected<std::optional<messages::InterfaceMessages>, messages::TypeError> ModelSource::find(
    const messages::InterfaceName& interface) const {
  return messages_of(lowered_, interface, place_);
}

}  // namespace trestle::describe
