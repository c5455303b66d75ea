// bridge/messages/map: the fields of a message made of those of another message.
//
//   field_mapping.hpp  the rules of a route, as its configuration has them
//   map_compiler.hpp   rules and two types become a program, or what is wrong with them
//   map_program.hpp    the operations of a program
//   field_map.hpp      runs it: from the CDR of one message to that of the other
//   number_map.hpp     what becomes of a number
//   mapped_plan.hpp    a ConversionPlan with a FieldMap before or behind it
//
// docs/mapping.md says what the rules mean.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bridge/documents/problem.hpp"

namespace trestle::messages {

/// Which of the two messages is made of the other one. The payload is the message on the SOME/IP side.
enum class MapDirection : std::uint8_t { to_ros, to_payload };

/// A word of the configuration, and where it stands.
struct MarkedText {
  std::string text{};
  documents::Mark mark{};
};

/// "0: 22" of a table.
struct TableEntry {
  MarkedText from;
  MarkedText to;
};

/// What a value becomes that a table does not have.
enum class Otherwise : std::uint8_t {
  error,  ///< the message is dropped
  keep,   ///< the same number
  value,  ///< MapRule::otherwise_value
};

/// What a number of a point in time or a duration counts.
enum class TimeUnit : std::uint8_t { ns, us, ms, s };

/// Where a field of the ROS message comes from. On the way back the same makes the field of the payload.
struct MapRule {
  MarkedText ros{};      ///< "header.stamp"
  MarkedText payload{};  ///< "speed.raw", the field that it comes from; empty: it has a value of its own
  std::optional<MarkedText> value{};  ///< always the same
  bool is_received = false;           ///< the time at which the message came
  documents::Mark time_mark{};        ///< of `time`, which says that or the unit
  std::optional<TimeUnit> unit{};     ///< a Time or Duration of a number
  double scale = 1;
  double offset = 0;  ///< ros = scale * payload + offset
  documents::Mark scale_mark{};
  std::vector<TableEntry> table{};  ///< from the payload to ROS
  documents::Mark table_mark{};
  std::vector<TableEntry> back{};  ///< from ROS to the payload; empty: the table read backwards
  documents::Mark back_mark{};
  Otherwise otherwise = Otherwise::error;
  MarkedText otherwise_value{};
  std::optional<MapDirection> only{};  ///< in the other direction there is no such rule
};

/// A field of the payload that always has the same value on the way to SOME/IP, and is not read on the other.
struct PayloadConstant {
  MarkedText payload;
  MarkedText value;
};

/// How a message of one type becomes a message of another, and back.
struct FieldMapping {
  MarkedText payload{};  ///< the type on the SOME/IP side, "pkg/msg/Type"
  documents::Mark mark{};
  std::vector<MapRule> rules{};              ///< in the order of the file
  std::vector<MarkedText> dropped{};         ///< fields of the payload that ROS does not get
  std::vector<PayloadConstant> constants{};  ///< of the payload
  bool others_default = false;  ///< fields of which nothing is said get their default; else that is an error
};

/// What is to be said of a mapping.
struct MapProblem {
  documents::Mark mark;
  std::string text;
  bool is_error = true;  ///< else it is a warning
};

/// What a rule makes in a direction, for people: "longitudinal_velocity = 0.25 * speed_kmh". Empty: nothing.
[[nodiscard]] std::string to_string(const MapRule& rule, MapDirection direction);
/// All of a mapping, a line each.
[[nodiscard]] std::vector<std::string> in_lines(const FieldMapping& mapping, MapDirection direction);

}  // namespace trestle::messages
