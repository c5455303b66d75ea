#pragma once
#include <yaml-cpp/yaml.h>

#include <map>
#include <string>

#include "bridge/documents/format.hpp"
#include "bridge/documents/problems.hpp"

namespace trestle::bridge {

class Section;

/// A method as it was read, which may be incomplete; as RouteInFile.
struct MethodInFile {
  MethodRoute method;
  std::map<std::string, Mark, std::less<>> good;
  Mark type_mark;
  const char* type_key = "type";  ///< what that place is the value of
};

/// A ROS service, absolute, and its type.
[[nodiscard]] Format<std::string> service_name();
[[nodiscard]] Format<std::string> service_type_name();

/// Warns of a method whose id, under `key`, looks like that of an event.
void check_method_id(const Section& section, const char* key, someip::MethodId method, Problems& problems);

/// Reads `timeout`, `max_calls`, `max_message`, `tp` and `ros_form`, which all methods have.
void load_calls(Section& section, MethodRoute& method, Problems& problems);

/// Reads one element of `methods`.
[[nodiscard]] MethodInFile load_method(const YAML::Node& node, Problems& problems);

}  // namespace trestle::bridge
