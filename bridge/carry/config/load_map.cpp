#include <fmt/format.h>

#include <cmath>
#include <initializer_list>

#include "bridge/carry/config/elements.hpp"
#include "bridge/messages/types/names.hpp"
#include "bridge/messages/types/number_text.hpp"

namespace trestle::carry {
namespace {

using messages::MapDirection;
using messages::MapRule;
using messages::MarkedText;
using messages::Otherwise;
using messages::TableEntry;
using messages::TimeUnit;

/// What the values of a map's keys are; the types say later whether that is good.
documents::Format<std::string> scalar(std::string expected) {
  return {std::move(expected), [](std::string_view text) { return std::optional{std::string{text}}; }};
}

documents::Format<std::string> payload_name() {
  return documents::text_that(
      "the message type of the payload, such as car_msgs/msg/VehicleSpeed, or VehicleSpeed where "
      "`interfaces` have it",
      messages::is_type_name, "^([A-Za-z][A-Za-z0-9_]*/msg/)?[A-Za-z][A-Za-z0-9_]*$");
}

documents::Format<std::string> field_name() {
  return documents::any_text("the name of a field, such as header.stamp or wheels[2].speed");
}

documents::Format<double> decimal() {
  return {"a decimal number, such as 0.01", [](std::string_view text) -> std::optional<double> {
            const auto number = messages::read_float<double>(text);
            return number && std::isfinite(*number) ? number : std::nullopt;
          }};
}

/// What `time` says: a unit, or nothing for the time at which the message came.
documents::Format<std::optional<TimeUnit>> time_word() {
  return documents::one_of<std::optional<TimeUnit>>({{"received", std::nullopt},
                                                     {"ns", TimeUnit::ns},
                                                     {"us", TimeUnit::us},
                                                     {"ms", TimeUnit::ms},
                                                     {"s", TimeUnit::s}});
}

std::vector<TableEntry> load_table(documents::Section& rule, const char* key, documents::Problems& problems) {
  std::vector<TableEntry> entries;
  const YAML::Node node = rule.child(key);
  if (!node) {
    return entries;
  }
  documents::Section table{node, key, problems};
  for (const std::string& from : table.keys()) {
    TableEntry entry{.from = {from, table.key_mark(from.c_str())},
                     .to = {{}, table.value_mark(from.c_str())}};
    if (table.read(from.c_str(), scalar("a number or the name of a constant"), entry.to.text)) {
      entries.push_back(std::move(entry));
    }
  }
  return entries;
}

/// Tells of keys that do not go together with another one.
void refuse_beside(const documents::Section& rule, const char* key, std::initializer_list<const char*> others,
                   documents::Problems& problems) {
  for (const char* other : others) {
    if (rule.has(key) && rule.has(other)) {
      problems.error(rule.key_mark(other), fmt::format("{}: cannot stand beside {}", other, key));
    }
  }
}

/// What goes together in a rule.
void check_rule(const documents::Section& rule, const std::string& name, const MapRule& read,
                documents::Problems& problems) {
  refuse_beside(rule, "value", {"from", "time", "scale", "offset", "table", "back", "otherwise"}, problems);
  refuse_beside(rule, "time", {"scale", "offset", "table", "back", "otherwise"}, problems);
  refuse_beside(rule, "table", {"scale", "offset"}, problems);
  if (read.is_received) {
    refuse_beside(rule, "time", {"from"}, problems);
  }
  for (const char* key : {"back", "otherwise"}) {
    if (rule.has(key) && !rule.has("table")) {
      problems.error(rule.key_mark(key), fmt::format("{}: needs `table` beside it", key));
    }
  }
  if (rule.has("from") || rule.has("value") || read.is_received) {
    return;
  }
  problems.error(rule.has("time") ? rule.key_mark("time") : rule.mark(),
                 fmt::format("map: {} needs `from`, a field of the payload{}", documents::quote(name),
                             rule.has("time") ? "" : ", or `value`, or `time: received`"));
}

MapRule load_rule(const YAML::Node& node, MarkedText ros, documents::Problems& problems) {
  MapRule read{.ros = std::move(ros)};
  documents::Section rule{node, "map", problems};
  if (rule.read("from", field_name(), read.payload.text)) {
    read.payload.mark = rule.value_mark("from");
  }
  MarkedText value{.mark = rule.value_mark("value")};
  if (rule.read("value", scalar("a number, a truth value or a text"), value.text)) {
    read.value = std::move(value);
  }
  std::optional<TimeUnit> unit;
  if (rule.read("time", time_word(), unit)) {
    read.unit = unit;
    read.is_received = !unit;
  }
  read.time_mark = rule.value_mark("time");
  rule.read("scale", decimal(), read.scale);
  read.scale_mark = rule.value_mark("scale");
  rule.read("offset", decimal(), read.offset);
  read.table = load_table(rule, "table", problems);
  read.table_mark = rule.value_mark("table");
  read.back = load_table(rule, "back", problems);
  read.back_mark = rule.value_mark("back");
  std::string otherwise;
  if (rule.read("otherwise", scalar("error, keep, or the value that ROS gets"), otherwise)) {
    read.otherwise = otherwise == "error"  ? Otherwise::error
                     : otherwise == "keep" ? Otherwise::keep
                                           : Otherwise::value;
    read.otherwise_value = {std::move(otherwise), rule.value_mark("otherwise")};
  }
  Direction only{};
  if (rule.read("only", direction(), only)) {
    read.only = map_direction(only);
  }
  rule.finish();
  check_rule(rule, read.ros.text, read, problems);
  return read;
}

}  // namespace

void load_map(Element& element, std::optional<messages::FieldMapping>& into, documents::Problems& problems) {
  messages::FieldMapping mapping;
  const bool has_map = element.Section::has("map");
  const YAML::Node map = element.child("map");
  if (map) {
    element.require("payload", payload_name(), mapping.payload.text);
    mapping.mark = element.use_mark("map");
    documents::Section rules{map, "map", problems};
    for (const std::string& name : rules.keys()) {
      if (const YAML::Node node = rules.child(name.c_str())) {
        mapping.rules.push_back(load_rule(node, {name, rules.key_mark(name.c_str())}, problems));
      }
    }
  } else {
    element.read("payload", payload_name(), mapping.payload.text);
  }
  mapping.payload.mark = element.value_mark("payload");
  std::vector<std::string> dropped;
  std::vector<documents::Mark> marks;
  element.read_list("drop", field_name(), dropped, marks);
  for (std::size_t i = 0; i < dropped.size(); ++i) {
    mapping.dropped.push_back({std::move(dropped[i]), marks[i]});
  }
  if (const YAML::Node node = element.child("constants")) {
    documents::Section constants{node, "constants", problems};
    for (const std::string& name : constants.keys()) {
      MarkedText value{.mark = constants.value_mark(name.c_str())};
      if (constants.read(name.c_str(), scalar("a number, a truth value or a text"), value.text)) {
        mapping.constants.push_back({{name, constants.key_mark(name.c_str())}, std::move(value)});
      }
    }
  }
  element.read("others", documents::one_of<bool>({{"error", false}, {"default", true}}),
               mapping.others_default);
  for (const char* key : {"payload", "drop", "constants", "others"}) {
    if (!has_map && element.Section::has(key)) {
      problems.error(element.use_mark(key), fmt::format("{}: is for routes with `map`", key));
    }
  }
  if (map && element.has("payload")) {
    into = std::move(mapping);
  }
}

}  // namespace trestle::carry
