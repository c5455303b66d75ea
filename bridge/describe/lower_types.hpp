#pragma once
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bridge/describe/lower.hpp"
#include "bridge/describe/ros_names.hpp"

/// The parts of lower(): types become shapes, a shape gives a definition and, for each payload, rules.
/// Constants are made in lower_constants.cpp, rules in lower_rules.cpp.
namespace trestle::describe {

/// A message of one type, or of one payload, with all that its wire rules are made of.
struct Shape {
  /// One field of it.
  struct Use {
    messages::Field field{};
    std::string source{};
    messages::FieldWords words{};
    std::optional<Wire> array{};   ///< of an array: the wire of the array itself
    std::optional<Wire> string{};  ///< of a string, or of the strings in an array
    std::optional<Wire> nested{};  ///< of a message, or of the messages in an array
    std::size_t shape = 0;         ///< of these, in TypeLowering::shapes()
    std::uint8_t bits = 0;
    std::optional<std::endian> byte_order{};
    std::optional<someip::DataId> tag{};
    const Notes* notes = nullptr;
    std::string unit{};  ///< also where the type says it
  };
  messages::MessageDefinition definition{};
  messages::TypeRules::Form form = messages::TypeRules::Form::structure;
  bool is_wrapper = false;  ///< of an array, between it and what has room for a single message only
  std::vector<std::uint32_t> selectors{};
  std::vector<Use> uses{};
  std::string source{};
  std::map<std::string, std::string> constants{};    ///< by their ROS names what they were
  std::map<std::string, Notes> constant_notes{};     ///< by their ROS names
  std::map<std::string, std::size_t> constant_at{};  ///< index of definition.constants by name
  FreeNames constant_names{};
  /// Enumerations whose enumerators are constants already, by what these begin with.
  std::set<std::pair<const Type*, std::string>> enumerations{};
  bool has_optional_array = false;  ///< also of what it is made of: that may be missing
};

/// Makes shapes of types. Two types whose definitions are equal share a name.
class TypeLowering {
 public:
  TypeLowering(const Model& model, const LowerOptions& options, Lowered& into);

  /// The shape of a structure, choice or map entry; nothing: it has none, and not_carried says why.
  std::optional<std::size_t> shape_of(TypeIndex type);

  /// The shape of a message that is made of these values.
  /// @param name  "pkg/msg/Name"; if it is taken by another definition, a number is put behind it.
  /// @param begins_with_error  the first value is Method::error.
  std::optional<std::size_t> shape_of(const std::vector<Value>& values, const std::string& name,
                                      const std::string& source, bool begins_with_error = false);

  [[nodiscard]] const std::vector<Shape>& shapes() const { return shapes_; }
  [[nodiscard]] std::string package_of(const std::string& scope, Place place = {});
  /// "pkg/msg/Name", whose last part is made short enough for a file; where it is not, that is told.
  [[nodiscard]] std::string fit(const std::string& name, const std::string& source, Place place = {});
  void complain(std::string element, std::string what, Place place = {});
  /// Puts the values of scopes that belong to no ROS type into messages with nothing else.
  void add_constants();

 private:
  struct Owner {
    std::string name;    ///< "pkg/msg/Type"
    std::string source;  ///< "org.example.Type"
  };

  std::optional<std::size_t> structure(const Type& type, const Owner& owner);
  std::optional<std::size_t> made(Shape shape, const Owner& owner, bool is_fixed);
  [[nodiscard]] const Type& resolved_element(const Type& type) const;
  bool add_uses(Shape& shape, const std::vector<Value>& values, const Owner& owner, bool is_choice,
                bool keeps_names);
  std::optional<Shape::Use> use_of(const Value& value, const Owner& owner, const std::string& name,
                                   bool is_single);
  bool element(Shape::Use& use, const Value& value, const Owner& owner);
  bool array(Shape::Use& use, const Type& type, const Value& value, const std::string& what);
  std::optional<std::size_t> wrapper(const Value& value, const Owner& owner, const std::string& name);
  std::optional<std::size_t> entry(const Type& map, const Owner& owner, const std::string& name);
  std::optional<std::size_t> new_entry(const Type& map, const Owner& owner, const std::string& name);
  void add_enumerators(Shape& shape, Shape::Use& use, const Value& value);
  void add_names(messages::Field& field, const Value& value, const std::string& what);
  std::shared_ptr<const messages::Enumerators> enumerators_of(const Type& type);
  void constants_of(Shape& shape, std::string_view scope, bool keeps_names);
  /// @return the name that it got.
  const std::string& add_constant(Shape& shape, messages::Constant constant, std::string source,
                                  const Notes& notes);
  [[nodiscard]] std::string free_name(const Shape& shape);

  const Model& model_;
  const LowerOptions& options_;
  Lowered& into_;
  std::vector<Shape> shapes_;
  std::map<const Type*, std::shared_ptr<const messages::Enumerators>> enumerators_;
  std::set<const Type*> enumerations_told_;  ///< whose new names were told
  std::set<std::pair<const Type*, std::string>> enumerators_told_;
  std::map<TypeIndex, std::optional<std::size_t>> known_;
  std::set<TypeIndex> open_;                                 ///< types whose shapes are being made
  std::map<std::string, std::size_t, std::less<>> defined_;  ///< by name: the shape with its definition
  std::map<std::string, std::map<std::string, std::string>> alike_;  ///< by wanted name, by fields: the name
  std::map<std::string, unsigned> next_numbers_;                     ///< by wanted name: lower ones are taken
  std::map<std::string, std::vector<const Constant*>, std::less<>> constants_;  ///< by scope
  std::set<std::string, std::less<>> shortened_{};                              ///< names that were told
  std::map<TypeIndex, std::optional<std::size_t>> entries_;                     ///< of maps with names
  std::size_t depth_ = 0;
  std::size_t entry_depth_ = 0;
  std::size_t nested_maps_ = 0;
  std::size_t nested_maps_of_member_ = 0;
  std::size_t constant_count_ = 0;
};

/// The rules of one payload.
/// @param roots  its shape; of a method those of request and response, which share `types`.
/// @param wires  of the payload as a whole, where that is a structure
[[nodiscard]] messages::MessageRules rules_of(
    const std::vector<Shape>& shapes, const std::vector<std::pair<std::size_t, std::optional<Wire>>>& roots,
    const Payload& payload);

}  // namespace trestle::describe
