#pragma once
#include <yaml-cpp/yaml.h>
#include "bridge/carry/config/bridge_config.hpp"

#include <map>
#include <string>

#include "bridge/documents/format.hpp"
#include "bridge/documents/problems.hpp"

namespace trestle::documents {
class Section;
}  // namespace trestle::documents

namespace trestle::carry {

/// A method as it was read, which may be incomplete; as RouteInFile.
struct MethodInFile {
  MethodRoute method;
  std::map<std::string, documents::Mark, std::less<>> good;
  documents::Mark type_mark;
  const char* type_key = "type";  ///< what that place is the value of
};

/// A ROS service, absolute, and its type.
[[nodiscard]] documents::Format<std::string> service_name();
[[nodiscard]] documents::Format<std::string> service_type_name();

/// Warns of a method whose id, under `key`, looks like that of an event.
void check_method_id(const documents::Section& section, const char* key, someip::MethodId method,
                     documents::Problems& problems);

/// Reads `timeout`, `max_calls`, `max_message`, `tp` and `ros_form`, which all methods have.
void load_calls(documents::Section& section, MethodRoute& method, documents::Problems& problems);

/// Reads one element of `methods`.
[[nodiscard]] MethodInFile load_method(const YAML::Node& node, documents::Problems& problems);

}  // namespace trestle::carry
