#include "bridge/messages/types/made_source.hpp"

#include "bridge/messages/types/interface_parser.hpp"

namespace trestle::messages {

tl::expected<std::optional<InterfaceMessages>, TypeError> MadeSource::find(
    const InterfaceName& interface) const {
  const std::string name = interface.full();
  const auto made = texts_.find(name);
  if (made == texts_.end()) {
    return std::nullopt;
  }
  return parse_interface(made->second, interface,
                         "made " + name + "." + std::string{to_string(interface.kind)});
}

}  // namespace trestle::messages
