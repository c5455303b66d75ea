// What is known of data types and their elements without reading others.
#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "bridge/describe/read/arxml/tree.hpp"

namespace trestle::describe::arxml {

/// In lower case, without "std_", "idt_", "adt_" and "_t".
[[nodiscard]] std::string plain(std::string_view name);
/// uint8, UInt8, std_uint8_t, float … of AUTOSAR's platform and of its tools.
[[nodiscard]] std::optional<messages::Primitive> standard_primitive(std::string_view name);
/// Whether a type that no file has is known by its name, as those of the platform are.
[[nodiscard]] bool is_standard(std::string_view path);
/// Of a name as plain() has it.
[[nodiscard]] bool is_standard_string(std::string_view simple) noexcept;
[[nodiscard]] bool is_standard_bytes(std::string_view simple) noexcept;
struct StandardArray {
  std::string element;         ///< its path
  std::uint32_t elements = 0;  ///< 0: any number of them
};
/// franca_ara_tools has a vector of each basic type, /ara/stdtypes/UInt8Vector, and arrays,
/// /ara/stdtypes/UInt8Array10.
[[nodiscard]] std::optional<StandardArray> standard_array(std::string_view path);
[[nodiscard]] std::string_view last_name(std::string_view path) noexcept;
/// SW-DATA-DEF-PROPS-CONDITIONAL of a type or element, or nothing.
[[nodiscard]] const Node* properties_of(const Node& node);
[[nodiscard]] bool is_application(const Node& node) noexcept;
[[nodiscard]] bool is_variable_size(const Node& node);
[[nodiscard]] bool is_integer(messages::Primitive primitive) noexcept;
/// The number of elements or characters that `node`, which may be nothing, says; 0: none.
[[nodiscard]] std::uint32_t size_of(const Node* node, Problems& problems);

}  // namespace trestle::describe::arxml
