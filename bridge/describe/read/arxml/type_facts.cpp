#include "bridge/describe/read/arxml/type_facts.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "bridge/describe/read/arxml/values.hpp"

namespace trestle::describe::arxml {

using messages::Primitive;

namespace {

/// The names of types that everybody knows, in lower case, without "_t" and "std_".
struct Standard {
  std::string_view name;
  Primitive primitive;
};
constexpr std::array standard_types{
    Standard{"bool", Primitive::boolean},    Standard{"boolean", Primitive::boolean},
    Standard{"double", Primitive::float64},  Standard{"float", Primitive::float32},
    Standard{"float32", Primitive::float32}, Standard{"float64", Primitive::float64},
    Standard{"int16", Primitive::int16},     Standard{"int32", Primitive::int32},
    Standard{"int64", Primitive::int64},     Standard{"int8", Primitive::int8},
    Standard{"sint16", Primitive::int16},    Standard{"sint32", Primitive::int32},
    Standard{"sint64", Primitive::int64},    Standard{"sint8", Primitive::int8},
    Standard{"uint16", Primitive::uint16},   Standard{"uint32", Primitive::uint32},
    Standard{"uint64", Primitive::uint64},   Standard{"uint8", Primitive::uint8},
};

}  // namespace

std::string plain(std::string_view name) {
  std::string out{name};
  std::ranges::transform(out, out.begin(), [](char letter) {
    return letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter - 'A' + 'a') : letter;
  });
  for (const std::string_view prefix : {"std_", "idt_", "adt_"}) {
    if (out.starts_with(prefix)) {
      out.erase(0, prefix.size());
    }
  }
  if (out.ends_with("_t")) {
    out.erase(out.size() - 2);
  }
  return out;
}

std::optional<Primitive> standard_primitive(std::string_view name) {
  const std::string wanted = plain(name);
  const auto* const found = std::ranges::find(standard_types, std::string_view{wanted}, &Standard::name);
  return found == standard_types.end() ? std::nullopt : std::optional{found->primitive};
}

bool is_standard(std::string_view path) {
  const std::string_view name = last_name(path);
  const std::string simple = plain(name);
  if (standard_primitive(name) || is_standard_string(simple) || is_standard_bytes(simple) ||
      simple == "byte") {
    return true;
  }
  const std::optional<StandardArray> array = standard_array(path);
  return array && is_standard(array->element);
}

bool is_standard_string(std::string_view simple) noexcept {
  return simple == "string" || simple == "utf-8" || simple == "utf-16";
}

bool is_standard_bytes(std::string_view simple) noexcept {
  return simple == "bytebuffer" || simple == "bytearray" || simple == "bytevectortype";
}

std::optional<StandardArray> standard_array(std::string_view path) {
  constexpr std::string_view vector = "vector";
  constexpr std::string_view array = "array";
  const std::string lower = plain(path);
  if (lower.size() != path.size() || lower.find("stdtypes/") == std::string::npos) {
    return std::nullopt;
  }
  if (lower.ends_with(vector)) {
    return StandardArray{std::string{path.substr(0, path.size() - vector.size())}};
  }
  const std::size_t digits = lower.find_last_not_of("0123456789") + 1;
  const std::string_view stem = std::string_view{lower}.substr(0, digits);
  constexpr std::size_t most_digits = 6;
  if (!stem.ends_with(array) || digits == lower.size() || lower.size() - digits > most_digits) {
    return std::nullopt;
  }
  const auto elements = integer(path.substr(digits));
  return StandardArray{std::string{path.substr(0, digits - array.size())},
                       static_cast<std::uint32_t>(elements.value_or(0))};
}

std::string_view last_name(std::string_view path) noexcept {
  return path.substr(path.rfind('/') + 1);
}

const Node* properties_of(const Node& node) {
  const Node* const all = node.child("SW-DATA-DEF-PROPS"_tag);
  if (all == nullptr) {
    return nullptr;
  }
  // Before R4.0.3, and in files made by hand, they stand there directly.
  const Node* const inner = all->down("SW-DATA-DEF-PROPS-VARIANTS"_tag, "SW-DATA-DEF-PROPS-CONDITIONAL"_tag);
  return inner == nullptr ? all : inner;
}

bool is_application(const Node& node) noexcept {
  return to_string(node.tag).starts_with("APPLICATION-");
}

bool is_variable_size(const Node& node) {
  return node.child_text("ARRAY-SIZE-SEMANTICS"_tag) == "VARIABLE-SIZE";
}

bool is_integer(Primitive primitive) noexcept {
  return primitive >= Primitive::int8 && primitive <= Primitive::uint64;
}

std::uint32_t size_of(const Node* node, Problems& problems) {
  if (node == nullptr) {
    return 0;
  }
  const std::optional<std::int64_t> size = integer(node->text);
  if (!size || *size < 0 || *size > std::numeric_limits<std::uint32_t>::max()) {
    problems.error(node->place(), std::string{to_string(node->tag)} + " is \"" + std::string{node->text} +
                                      "\", and a number of elements was expected");
    return 0;
  }
  return static_cast<std::uint32_t>(*size);
}

}  // namespace trestle::describe::arxml
