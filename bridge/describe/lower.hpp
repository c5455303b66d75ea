#pragma once
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/describe/model.hpp"
#include "bridge/messages/convert/message_rules.hpp"
#include "bridge/messages/types/message_definition.hpp"
#include "bridge/messages/values/words.hpp"

/// From a model of interfaces to ROS 2 definitions with wire rules, and back: docs/describe_types.md says by
/// which rules.
namespace trestle::describe {

/// An event, method or field of a service in terms of ROS.
struct LoweredMember {
  enum class Kind : std::uint8_t { event, method, field };
  Kind kind = Kind::event;
  std::size_t service = 0;  ///< index of Model::services
  std::size_t member = 0;   ///< index of its events, methods or fields
  /// "pkg/msg/Type" of what an event or a field carries, "pkg/srv/Name" of a method.
  std::string type{};
  /// Of that type, or of the method's request. Those of the response have the same `types`.
  messages::MessageRules rules{};
  messages::MessageRules response{};  ///< methods; the same as `rules` where both are configured alike
  /// Where the type is that of a single value, of an event or field, the value's name; else the values are
  /// the fields of the type.
  std::string argument{};
};

struct Lowered {
  /// Messages that others are made of stand before these. Those of the method "pkg/srv/Name" are
  /// "pkg/srv/Name_Request" and "pkg/srv/Name_Response".
  std::vector<messages::MessageDefinition> definitions{};
  std::map<std::string, std::size_t, std::less<>> by_name{};  ///< index of `definitions`
  std::vector<LoweredMember> members{};                       ///< by service; events, methods, fields
  /// By the ROS name what it was in the description: "pkg/msg/Type" -> "org.example.Type",
  /// "pkg/msg/Type.field_name" -> "fieldName", "pkg/msg/Type.STATE_ON" -> "State.ON", "pkg/srv/Name" ->
  /// "org.example.Service.method".
  std::map<std::string, std::string, std::less<>> sources{};
  /// The names of fields, enumerators and members as the description has them, for texts.
  messages::WordsOfTypes words{};
  /// What people wrote, by the same names as `sources`.
  std::map<std::string, Notes, std::less<>> notes{};
  /// Enumerations whose enumerators have other names as constants: for readers of the `.msg` files.
  std::vector<NotCarried> renamed{};
  /// What could not be expressed. Members without a form in ROS are named here, and not in `members`.
  std::vector<NotCarried> not_carried{};

  [[nodiscard]] const messages::MessageDefinition* definition(std::string_view name) const;
  [[nodiscard]] const LoweredMember* member(LoweredMember::Kind kind, std::size_t service,
                                            std::size_t index) const;
  /// The ROS names of "org.example.Type", sorted; several if its variants have different fields.
  [[nodiscard]] std::vector<std::string> ros_names(std::string_view source) const;
};

/// Constants of all messages, made of the enumerators of what they have in them.
inline constexpr std::size_t max_lowered_constants = 2'000'000;

struct LowerOptions {
  /// Of all types that are not bound to a ROS type; empty: the last part of the scope of each.
  std::string package{};
  std::string package_without_scope = "interfaces";
  std::size_t max_constants = max_lowered_constants;
};

/// Maps in maps: messages of all of them together, and of one member. A map of two maps of two maps … has
/// twice as many at each level.
inline constexpr std::size_t max_nested_maps = 100'000;
inline constexpr std::size_t max_nested_maps_of_member = 1000;

/// Makes ROS definitions of all types and members. The same model gives the same names.
/// What is beyond the limits above is not carried, and named.
/// Never throws; models of any content are allowed, types that contain themselves among them.
[[nodiscard]] Lowered lower(const Model& model, const LowerOptions& options = {});

/// The text of a `.msg` file.
/// @param lowered  for the comments.
[[nodiscard]] std::string msg_text(const Lowered& lowered, const messages::MessageDefinition& definition);
/// The text of the `.srv` file of "pkg/srv/Name"; empty if there is none. Constants that both messages have
/// stand in the request.
[[nodiscard]] std::string srv_text(const Lowered& lowered, std::string_view service);

}  // namespace trestle::describe
