#include "bridge/messages/map/table_reader.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bridge/documents/problems.hpp"
#include "bridge/documents/section.hpp"
#include "bridge/messages/convert/default_writer.hpp"
#include "bridge/messages/types/characters.hpp"
#include "bridge/messages/types/literals.hpp"

namespace trestle::messages {

using documents::quote;

tl::expected<std::uint64_t, std::string> number_of(const std::string& text, Primitive type,
                                                   const MessageDefinition& holder) {
  std::string value = text;
  std::vector<std::string> names;
  for (const Constant& constant : holder.constants) {
    names.push_back(constant.name);
    if (constant.name == text) {
      value = constant.value;
    }
  }
  if (const Complaint complaint = check_literal(type, 0, value); !complaint.empty()) {
    if (!is_identifier(text) || names.empty()) {
      return tl::unexpected{complaint};
    }
    const std::string likely = documents::nearest(text, names);
    return tl::unexpected{likely.empty() ? fmt::format("{}, or a constant of {}", complaint, holder.name)
                                         : fmt::format("{} has no constant {}; did you mean {}?", holder.name,
                                                       quote(text), quote(likely))};
  }
  Field field;
  field.type.primitive = type;
  field.default_value = value;
  const std::uint64_t bits = default_value_of(field).numbers.front();
  const unsigned unused = 64U - 8U * width(type);
  return bits << unused >> unused;
}

void TableReader::read_forth(NumberMap& map) {
  read(rule_.table, payload_, ros_, false, map);
  map.otherwise = rule_.otherwise;
  if (rule_.otherwise == Otherwise::value) {
    const auto bits = number_of(rule_.otherwise_value.text, map.to, ros_);
    if (!bits) {
      problems_.push_back({rule_.otherwise_value.mark, "otherwise: " + bits.error()});
    }
    map.otherwise_bits = bits.value_or(0);
  }
}

void TableReader::read_back(NumberMap& map) {
  // A value for what the table lacks is one of ROS.
  map.otherwise = rule_.otherwise == Otherwise::keep ? Otherwise::keep : Otherwise::error;
  if (!rule_.back.empty()) {
    return read(rule_.back, ros_, payload_, false, map);
  }
  std::vector<TableEntry> turned = rule_.table;
  for (TableEntry& entry : turned) {
    std::swap(entry.from, entry.to);
  }
  read(turned, ros_, payload_, true, map);
}

void TableReader::read(const std::vector<TableEntry>& entries, const MessageDefinition& from,
                       const MessageDefinition& to, bool is_backwards, NumberMap& map) {
  map.has_table = true;
  if (is_real(map.from)) {
    problems_.push_back(
        {rule_.table_mark,
         fmt::format("table: is for whole numbers and booleans, and {} is not whole", to_string(map.from))});
    return;
  }
  std::vector<std::pair<std::int64_t, const TableEntry*>> seen;
  for (const TableEntry& entry : entries) {
    const auto key = number_of(entry.from.text, map.from, from);
    const auto value = number_of(entry.to.text, map.to, to);
    for (const auto* one : {&key, &value}) {
      if (!*one) {
        problems_.push_back({(one == &key ? entry.from : entry.to).mark, "table: " + one->error()});
      }
    }
    if (!key || !value) {
      continue;
    }
    const std::int64_t number = NumberMap::whole(*key, map.from);
    const auto same = std::ranges::find(seen, number, [](const auto& one) { return one.first; });
    if (same != seen.end() && is_backwards) {
      problems_.push_back(
          {entry.from.mark,
           fmt::format("table: {} and {} both become {}, so that the way back (dds_to_someip) is not known: "
                       "say it, as in `back: {{{}: {}}}`",
                       quote(same->second->to.text), quote(entry.to.text), quote(entry.from.text),
                       entry.from.text, same->second->to.text)});
    } else if (same != seen.end()) {
      problems_.push_back({entry.from.mark, fmt::format("table: {} is the same as {}", quote(entry.from.text),
                                                        quote(same->second->from.text))});
    }
    seen.emplace_back(number, &entry);
    map.table.push_back({number, *value});
  }
  std::ranges::sort(map.table, {}, &NumberMap::Entry::from);
}

}  // namespace trestle::messages
