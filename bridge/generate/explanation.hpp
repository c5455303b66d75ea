#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/describe/layout.hpp"
#include "bridge/describe/load_e2e.hpp"
#include "bridge/describe/system.hpp"

namespace trestle::generate {

/// What the bytes of one kind of message are.
struct Explanation {
  /// A type in it whose values have names.
  struct Enumeration {
    std::string name;  ///< of the type; of the value where the type has none
    std::vector<describe::Enumerator> enumerators{};
    bool is_unsigned = false;
  };
  std::string element;  ///< "Door.open"
  std::string part;     ///< "request", "response", "payload"; of a type: "type"
  describe::Layout layout{};
  std::vector<std::byte> bytes{};  ///< with values: the payload, in which the E2E header is zeros
  std::vector<Enumeration> enumerations{};
};

/// Explains an element: an event, method or field ("Door.open", "car.Door.open", "Door.open.response"), or a
/// type ("Obstacle", "org.example.Obstacle", "sensor_msgs/msg/PointCloud2").
/// @param values  YAML or JSON, in the words of the description or of its ROS message; empty: none, and the
///                layout is a table of what may be there. Of a method they are those of the request, unless
///                the element ends in ".response".
/// @param values_name  of the file with the values, for errors: "NAME:2:7: opening: expected …".
/// @return a method has two parts; or what is wrong, with the names that there are.
[[nodiscard]] tl::expected<std::vector<Explanation>, std::string> explain(
    const describe::System& system, std::string_view element, std::string_view values,
    std::string_view values_name = "values");

/// Puts the header of a protection into a layout, and zeros for it into the bytes. Where the protection
/// cannot be done, the layout says why.
/// @param bytes  null: the layout is one without values.
void add_header(const describe::Protection& e2e, describe::E2eUse use, describe::Layout& layout,
                std::vector<std::byte>* bytes = nullptr);

/// As a table for people.
[[nodiscard]] std::string to_text(const Explanation& explanation);
/// An object: docs/describe.md.
[[nodiscard]] std::string to_json_text(const std::vector<Explanation>& explanations);

}  // namespace trestle::generate
