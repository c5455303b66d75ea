#include "bridge/describe/model_source.hpp"

#include <utility>

#include "bridge/messages/types/parsers.hpp"

namespace trestle::describe {

tl::expected<std::optional<messages::InterfaceMessages>, messages::TypeError> ModelSource::find(
    const messages::InterfaceName& interface) const {
  messages::InterfaceMessages found;
  for (const std::string& name : messages::message_names(interface)) {
    const messages::MessageDefinition* const definition = lowered_.definition(name);
    if (definition == nullptr) {
      return std::optional<messages::InterfaceMessages>{};
    }
    found.push_back(*definition);
  }
  messages::add_generated_messages(found, interface, place_);
  return std::optional{std::move(found)};
}

}  // namespace trestle::describe
