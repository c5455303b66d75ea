#pragma once
#include <optional>
#include <string>
#include <vector>

#include "bridge/messages/map/field_map.hpp"
#include "bridge/messages/map/field_mapping.hpp"
#include "bridge/messages/types/message_definition.hpp"
#include "bridge/messages/types/type_library.hpp"

namespace trestle::messages {

/// What became of the rules.
struct CompiledMap {
  std::optional<FieldMap> map;       ///< nothing: there are errors
  std::vector<MapProblem> problems;  ///< in no order
};

/// Compiles a mapping for one direction. All of it is checked, also what concerns the other direction alone.
/// @param payload  the type on the SOME/IP side.
[[nodiscard]] CompiledMap compile_map(const TypeTree& payload, const TypeTree& ros,
                                      const FieldMapping& mapping, MapDirection direction);

/// The same, of types by their names.
[[nodiscard]] std::vector<MapProblem> check_map(const std::string& ros_type, const FieldMapping& mapping,
                                                MapDirection direction, const TypePlaces& places);

}  // namespace trestle::messages
