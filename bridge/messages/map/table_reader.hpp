#pragma once
#include <string>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

#include "bridge/messages/map/map_compiler.hpp"
#include "bridge/messages/map/number_map.hpp"

namespace trestle::messages {

/// The bits of a number as the configuration writes it: 22, 0x16, true, -1.5, or the name of a constant of
/// the message that has the field.
/// @return or what was expected, in one line.
[[nodiscard]] tl::expected<std::uint64_t, std::string> number_of(const std::string& text, Primitive type,
                                                                 const MessageDefinition& holder);

/// Reads the table of a rule, in one of the directions.
class TableReader {
 public:
  /// @param payload, ros  the messages that have the fields.
  TableReader(const MapRule& rule, const MessageDefinition& payload, const MessageDefinition& ros)
      : rule_{rule}, payload_{payload}, ros_{ros} {}

  /// @param map  its types are known, its table is to be filled.
  void read_forth(NumberMap& map);
  void read_back(NumberMap& map);
  [[nodiscard]] std::vector<MapProblem> take() { return std::move(problems_); }

 private:
  void read(const std::vector<TableEntry>& entries, const MessageDefinition& from,
            const MessageDefinition& to, bool is_backwards, NumberMap& map);

  const MapRule& rule_;
  const MessageDefinition& payload_;
  const MessageDefinition& ros_;
  std::vector<MapProblem> problems_;
};

}  // namespace trestle::messages
