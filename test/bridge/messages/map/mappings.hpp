#pragma once
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "bridge/messages/map/map_compiler.hpp"
#include "bridge/messages/types/type_library.hpp"
#include "test/bytes.hpp"

namespace trestle::test {

using messages::FieldMapping;
using messages::MapDirection;
using messages::MapRule;
using messages::Otherwise;

/// `ros: {from: payload}`, in a line of its own.
inline MapRule from(std::string ros, std::string payload, MapRule more = {}, int line = 0) {
  more.ros = {std::move(ros), {line, 1}};
  more.payload = {std::move(payload), {line, 2}};
  return more;
}

/// `ros: {value: text}`
inline MapRule fixed(std::string ros, std::string text, int line = 0) {
  return {.ros = {std::move(ros), {line, 1}}, .value = messages::MarkedText{std::move(text), {line, 3}}};
}

inline MapRule received(std::string ros, int line = 0) {
  return {.ros = {std::move(ros), {line, 1}}, .is_received = true, .time_mark = {line, 4}};
}

/// `table: {1: 2}` and the like.
inline std::vector<messages::TableEntry> table(
    const std::vector<std::pair<std::string, std::string>>& entries) {
  std::vector<messages::TableEntry> result;
  for (const auto& [one, other] : entries) {
    result.push_back({{one, {7, 7}}, {other, {7, 8}}});
  }
  return result;
}

/// Types by their texts; what they are made of is built in.
struct MapTypes {
  MapTypes(const std::string& payload_msg, const std::string& ros_msg) {
    messages::TypeLibrary library;
    library.define(*messages::interface_name("car_msgs/msg/Status"), payload_msg);
    library.define(*messages::interface_name("out_msgs/msg/State"), ros_msg);
    payload = library.resolve("car_msgs/msg/Status").value();
    ros = library.resolve("out_msgs/msg/State").value();
  }
  messages::TypeTree payload;
  messages::TypeTree ros;
};

/// What is said of a mapping: "LINE:COLUMN text", warnings with "warning: " before the text.
inline std::vector<std::string> said(const MapTypes& types, const FieldMapping& mapping,
                                     MapDirection direction) {
  std::vector<std::string> lines;
  for (const auto& one : compile_map(types.payload, types.ros, mapping, direction).problems) {
    lines.push_back(std::to_string(one.mark.line) + ":" + std::to_string(one.mark.column) + " " +
                    (one.is_error ? "" : "warning: ") + one.text);
  }
  return lines;
}

/// A good mapping, compiled.
inline messages::FieldMap map_of(const MapTypes& types, const FieldMapping& mapping, MapDirection direction) {
  auto compiled = compile_map(types.payload, types.ros, mapping, direction);
  if (!compiled.map) {
    throw std::invalid_argument{compiled.problems.front().text};
  }
  return std::move(*compiled.map);
}

/// What becomes of a message, in hexadecimal; or the error in words. The input is copied to memory of exactly
/// its size, so that the address sanitizer sees every read beyond it.
inline std::string converted(const messages::FieldMap& map, ByteView cdr, messages::MapCounters& counters,
                             std::chrono::nanoseconds received = {}) {
  messages::MapScratch scratch;
  const std::vector<std::byte> exact{cdr.begin(), cdr.end()};
  const auto made =
      map.convert(exact, received, messages::ConversionPlan::default_reference_from, scratch, counters);
  return made ? to_hex(joined(*made)) : place_of(made.error());
}
inline std::string converted(const messages::FieldMap& map, std::string_view cdr) {
  messages::MapCounters counters;
  return converted(map, hex(cdr), counters);
}

}  // namespace trestle::test
