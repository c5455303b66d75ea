#include "dds_adapter/ros_names.hpp"

namespace trestle::dds {

std::string ros_topic_name(std::string_view topic) {
  std::string result{"rt"};
  if (topic.empty() || topic.front() != '/') {
    result += '/';
  }
  return result.append(topic);
}

std::string ros_type_name(std::string_view type) {
  const std::size_t name_at = type.rfind('/');
  if (name_at == std::string_view::npos) {
    return std::string{type};
  }
  std::string_view path = type.substr(0, name_at);
  std::string result;
  bool one_part = true;
  for (std::size_t slash = path.find('/'); slash != std::string_view::npos; slash = path.find('/')) {
    result.append(path.substr(0, slash)).append("::");
    path.remove_prefix(slash + 1);
    one_part = false;
  }
  result.append(path);
  if (one_part) {
    result += "::msg";
  }
  return result.append("::dds_::").append(type.substr(name_at + 1)).append("_");
}

}  // namespace trestle::dds
