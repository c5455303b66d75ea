#include "bridge/describe/write/routes/action_entries.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

namespace trestle::describe {
namespace {

constexpr std::string_view between = "/_action/";
constexpr std::array<std::string_view, 5> parts{"send_goal", "cancel_goal", "get_result", "feedback",
                                                "status"};
constexpr std::size_t first_event = 3;

std::string text_of(const YAML::Node& node, const char* key) {
  const YAML::Node found = node[key];
  return found.IsDefined() ? YAML::Dump(found) : std::string{};
}

std::string name_of(const RouteEntry& entry) {
  return entry.node[std::string_view{entry.list} == "methods" ? "ros_service" : "topic"].Scalar();
}

using Found = std::array<const RouteEntry*, parts.size()>;

/// "pkg/action/Name", if all five are there and are those of one action.
std::string type_of(const Found& found) {
  if (std::ranges::any_of(found, [](const RouteEntry* one) { return one == nullptr; })) {
    return {};
  }
  const auto type = [&](std::size_t part) { return found[part]->node["type"].Scalar(); };
  constexpr std::string_view end = "_FeedbackMessage";
  const std::string feedback = type(3);
  if (!feedback.ends_with(end)) {
    return {};
  }
  const std::string action = feedback.substr(0, feedback.size() - end.size());
  const bool is_one = type(0) == action + "_SendGoal" && type(1) == "action_msgs/srv/CancelGoal" &&
                      type(2) == action + "_GetResult" && type(4) == "action_msgs/msg/GoalStatusArray";
  return is_one ? action : std::string{};
}

/// What all parts share; false: they do not.
bool put_common(const Found& found, YAML::Node& node) {
  for (const char* key : {"service", "instance", "major", "minor", "port", "wire", "tp", "transport"}) {
    const std::string text = text_of(found[0]->node, key);
    if (std::ranges::any_of(found, [&](const RouteEntry* one) { return text_of(one->node, key) != text; })) {
      return false;
    }
    if (!text.empty()) {
      node[key] = found[0]->node[key];
    }
  }
  for (const char* key : {"eventgroup", "multicast"}) {
    const std::string text = text_of(found[first_event]->node, key);
    if (text_of(found[4]->node, key) != text) {
      return false;
    }
    if (!text.empty()) {
      node[key] = found[first_event]->node[key];
    }
  }
  return !node["wire"].IsDefined() || !node["wire"]["types"].IsDefined();
}

std::optional<RouteEntry> action_of(const std::string& name, const Found& found) {
  const std::string type = type_of(found);
  if (type.empty()) {
    return std::nullopt;
  }
  // Not a copy of the first: nodes of YAML share what is assigned to them.
  const std::string member = name.substr(name.rfind('/') + 1);
  RouteEntry entry{.list = "actions",
                   .element = found[0]->service + "." + member,
                   .member = member,
                   .service = found[0]->service,
                   .instance = found[0]->instance,
                   .node = YAML::Node{YAML::NodeType::Map}};
  entry.node["action"] = name;
  entry.node["type"] = type;
  entry.node["server"] = found[0]->node["server"].Scalar();
  if (!put_common(found, entry.node)) {
    return std::nullopt;
  }
  for (std::size_t part = 0; part < parts.size(); ++part) {
    const YAML::Node& of_part = found[part]->node;
    const bool is_event = part >= first_event;
    entry.node[is_event ? "events" : "methods"][std::string{parts[part]}] =
        of_part[is_event ? "event" : "method"].Scalar();
    if (of_part["e2e"].IsDefined()) {
      entry.node["e2e"][std::string{parts[part]}] = of_part["e2e"];
    }
  }
  if (found[0]->node["timeout"].IsDefined()) {
    entry.node["timeout"] = found[0]->node["timeout"].Scalar();
  }
  if (found[2]->node["timeout"].IsDefined()) {
    entry.node["result_timeout"] = found[2]->node["timeout"].Scalar();
  }
  return entry;
}

}  // namespace

void join_actions(std::vector<RouteEntry>& entries, std::vector<NotCarried>& not_carried) {
  std::map<std::tuple<std::string, std::string, someip::InstanceId>, Found> actions;
  const auto key_of = [](const RouteEntry& entry) {
    const std::string name = name_of(entry);
    return std::tuple{name.substr(0, name.find(between)), entry.service, entry.instance};
  };
  for (const RouteEntry& entry : entries) {
    const std::string name = name_of(entry);
    const std::size_t at = name.find(between);
    if (at == std::string::npos || std::string_view{entry.list} == "fields") {
      continue;
    }
    const auto part = std::ranges::find(parts, std::string_view{name}.substr(at + between.size()));
    if (part != parts.end()) {
      actions[key_of(entry)][static_cast<std::size_t>(part - parts.begin())] = &entry;
    }
  }
  std::vector<RouteEntry> made;
  std::map<const RouteEntry*, bool> used;
  for (const auto& [key, found] : actions) {
    if (auto action = action_of(std::get<0>(key), found)) {
      made.push_back(std::move(*action));
      for (const RouteEntry* const part : found) {
        used[part] = true;
      }
    }
  }
  std::vector<RouteEntry> rest;
  for (RouteEntry& entry : entries) {
    if (used.contains(&entry)) {
      continue;
    }
    if (entry.node["type"].Scalar().find("/action/") != std::string::npos) {
      not_carried.push_back({entry.element, "a part of an action without the others, or unlike them"});
      continue;
    }
    rest.push_back(std::move(entry));
  }
  rest.insert(rest.end(), std::make_move_iterator(made.begin()), std::make_move_iterator(made.end()));
  entries = std::move(rest);
}

}  // namespace trestle::describe
