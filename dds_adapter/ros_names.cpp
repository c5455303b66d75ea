#include "dds_adapter/ros_names.hpp"

#include <algorithm>

namespace trestle::dds {
namespace {

std::string prefixed(std::string_view prefix, std::string_view name) {
  std::string result{prefix};
  if (name.empty() || name.front() != '/') {
    result += '/';
  }
  return result.append(name);
}

}  // namespace

std::string ros_topic_name(std::string_view topic) {
  return prefixed("rt", topic);
}

std::optional<std::string> topic_of_ros(std::string_view dds_topic) {
  constexpr std::string_view prefix = "rt";
  return dds_topic.starts_with("rt/") ? std::optional{std::string{dds_topic.substr(prefix.size())}}
                                      : std::nullopt;
}

std::string ros_request_topic(std::string_view service) {
  return prefixed("rq", service).append("Request");
}

std::string ros_reply_topic(std::string_view service) {
  return prefixed("rr", service).append("Reply");
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

std::optional<std::string> type_of_ros(std::string_view dds_type) {
  // "PACKAGE::msg::dds_::NAME_"
  constexpr std::string_view before_name = "::dds_::";
  const std::size_t path_end = dds_type.find(before_name);
  if (path_end == std::string_view::npos || !dds_type.ends_with('_') ||
      dds_type.find('/') != std::string_view::npos) {
    return std::nullopt;
  }
  std::string_view name = dds_type.substr(path_end + before_name.size());
  name.remove_suffix(std::min<std::size_t>(1, name.size()));
  std::string result{dds_type.substr(0, path_end)};
  for (std::size_t at = 0; (at = result.find("::", at)) != std::string::npos;) {
    result.replace(at, 2, "/");
  }
  return result + '/' + std::string{name};
}

std::string ros_type_hash_entry(std::string_view type_hash) {
  return "typehash=" + std::string{type_hash} + ";";
}

std::string ros_service_hash_entry(std::string_view service_hash) {
  return "sertypehash=" + std::string{service_hash} + ";";
}

std::string_view user_data_value(std::string_view user_data, std::string_view key) noexcept {
  while (!user_data.empty()) {
    const std::string_view entry = user_data.substr(0, user_data.find(';'));
    if (entry.size() > key.size() && entry.starts_with(key) && entry[key.size()] == '=') {
      return entry.substr(key.size() + 1);
    }
    user_data.remove_prefix(std::min(user_data.size(), entry.size() + 1));
  }
  return {};
}

bool have_other_type_hashes(std::string_view one_user_data, std::string_view other_user_data) noexcept {
  const std::string_view one = user_data_value(one_user_data, "typehash");
  const std::string_view other = user_data_value(other_user_data, "typehash");
  return !one.empty() && !other.empty() && one != other;
}

}  // namespace trestle::dds
