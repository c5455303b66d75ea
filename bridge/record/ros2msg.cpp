#include "bridge/record/ros2msg.hpp"

#include <fmt/format.h>

#include <string_view>

#include "bridge/describe/lower.hpp"

namespace trestle::record {
namespace {

std::string text_of(messages::MessageDefinition definition) {
  definition.mark.clear();
  for (messages::Field& field : definition.fields) {
    field.mark.clear();
    if (definition.is_idl) {
      field.default_value.clear();
    }
  }
  if (definition.is_idl) {
    definition.constants.clear();
  }
  return describe::msg_text({}, definition);
}

/// "std_msgs/Header" of "std_msgs/msg/Header".
std::string short_name(std::string_view name) {
  return fmt::format("{}/{}", name.substr(0, name.find('/')), name.substr(name.rfind('/') + 1));
}

}  // namespace

std::string ros2msg(const messages::TypeTree& tree) {
  std::string text = text_of(tree.root());
  for (std::size_t i = tree.messages.size() - 1; i-- > 0;) {
    text +=
        fmt::format("{:=>80}\nMSG: {}\n{}", "", short_name(tree.messages[i].name), text_of(tree.messages[i]));
  }
  return text;
}

}  // namespace trestle::record
