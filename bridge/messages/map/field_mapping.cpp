#include "bridge/messages/map/field_mapping.hpp"

#include <fmt/format.h>

namespace trestle::messages {
namespace {

constexpr const char* name_of(TimeUnit unit) noexcept {
  switch (unit) {
    case TimeUnit::ns:
      return "ns";
    case TimeUnit::us:
      return "us";
    case TimeUnit::ms:
      return "ms";
    case TimeUnit::s:
      break;
  }
  return "s";
}

std::string table_text(const std::vector<TableEntry>& table, bool turned) {
  std::string text;
  for (const TableEntry& entry : table) {
    text += fmt::format("{}{}: {}", text.empty() ? "" : ", ", (turned ? entry.to : entry.from).text,
                        (turned ? entry.from : entry.to).text);
  }
  return "{" + text + "}";
}

std::string to_ros_text(const MapRule& rule) {
  const std::string& from = rule.payload.text;
  if (rule.value) {
    return fmt::format("\"{}\"", rule.value->text);
  }
  if (rule.is_received) {
    return "time of receiving";
  }
  if (rule.unit) {
    return fmt::format("{} in {}", from, name_of(*rule.unit));
  }
  if (!rule.table.empty()) {
    return fmt::format("{} by {}, otherwise {}", from, table_text(rule.table, false),
                       rule.otherwise == Otherwise::keep    ? "as it is"
                       : rule.otherwise == Otherwise::value ? rule.otherwise_value.text
                                                            : "an error");
  }
  return (rule.scale == 1 ? "" : fmt::format("{} * ", rule.scale)) + from +
         (rule.offset == 0 ? ""
                           : fmt::format(" {} {}", rule.offset < 0 ? '-' : '+',
                                         rule.offset < 0 ? -rule.offset : rule.offset));
}

std::string to_payload_text(const MapRule& rule) {
  const std::string& from = rule.ros.text;
  if (rule.unit) {
    return fmt::format("{} in {}", from, name_of(*rule.unit));
  }
  if (!rule.table.empty() || !rule.back.empty()) {
    return fmt::format("{} by {}, otherwise {}", from,
                       rule.back.empty() ? table_text(rule.table, true) : table_text(rule.back, false),
                       rule.otherwise == Otherwise::keep ? "as it is" : "an error");
  }
  const std::string difference = rule.offset == 0
                                     ? from
                                     : fmt::format("({} {} {})", from, rule.offset < 0 ? '+' : '-',
                                                   rule.offset < 0 ? -rule.offset : rule.offset);
  return rule.scale == 1 ? rule.offset == 0 ? from : difference.substr(1, difference.size() - 2)
                         : fmt::format("{} / {}", difference, rule.scale);
}

}  // namespace

std::string to_string(const MapRule& rule, MapDirection direction) {
  if (rule.only && *rule.only != direction) {
    return {};
  }
  if (direction == MapDirection::to_ros) {
    return fmt::format("{} = {}", rule.ros.text, to_ros_text(rule));
  }
  return rule.payload.text.empty() ? std::string{}
                                   : fmt::format("{} = {}", rule.payload.text, to_payload_text(rule));
}

std::vector<std::string> in_lines(const FieldMapping& mapping, MapDirection direction) {
  std::vector<std::string> lines;
  for (const MapRule& rule : mapping.rules) {
    if (std::string line = to_string(rule, direction); !line.empty()) {
      lines.push_back(std::move(line));
    }
  }
  if (direction == MapDirection::to_payload) {
    for (const PayloadConstant& one : mapping.constants) {
      lines.push_back(fmt::format("{} = \"{}\"", one.payload.text, one.value.text));
    }
  }
  std::string dropped;
  for (const MarkedText& one : mapping.dropped) {
    dropped += (dropped.empty() ? "" : ", ") + one.text;
  }
  if (!dropped.empty()) {
    lines.push_back(direction == MapDirection::to_ros ? "dropped: " + dropped : dropped + " = default");
  }
  if (mapping.others_default) {
    lines.emplace_back("others = default");
  }
  return lines;
}

}  // namespace trestle::messages
