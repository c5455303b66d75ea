#include "bridge/messages/types/builtin_source.hpp"

#include <algorithm>

#include "bridge/messages/types/builtin.hpp"
#include "bridge/messages/types/interface_parser.hpp"

namespace trestle::messages {

tl::expected<std::optional<InterfaceMessages>, TypeError> BuiltinSource::find(
    const InterfaceName& interface) const {
  const std::string name = interface.full();
  const auto all = builtin_definitions();
  const auto same = std::ranges::lower_bound(all, name, {}, &BuiltinDefinition::name);
  if (same == all.end() || same->name != name) {
    return std::nullopt;
  }
  return parse_interface(same->text, interface,
                         "built-in " + name + "." + std::string{to_string(interface.kind)});
}

}  // namespace trestle::messages
