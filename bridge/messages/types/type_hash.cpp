#include "bridge/messages/types/type_hash.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "bridge/documents/sha256.hpp"

namespace trestle::messages {
namespace {

/// The numbers of type_description_interfaces/msg/FieldType.
constexpr int nested_type_id = 1;
constexpr int uint8_id = 3;
constexpr int fixed_array_offset = 48;
constexpr int bounded_sequence_offset = 96;
constexpr int unbounded_sequence_offset = 144;

int type_id(Primitive primitive, bool bounded, bool is_idl) {
  if (primitive == Primitive::character) {  // rosidl makes uint8 of the char of .msg files
    return is_idl ? 13 : uint8_id;
  }
  constexpr std::array ids{std::pair{Primitive::boolean, 15}, std::pair{Primitive::byte, 16},
                           std::pair{Primitive::int8, 2},     std::pair{Primitive::uint8, uint8_id},
                           std::pair{Primitive::int16, 4},    std::pair{Primitive::uint16, 5},
                           std::pair{Primitive::int32, 6},    std::pair{Primitive::uint32, 7},
                           std::pair{Primitive::int64, 8},    std::pair{Primitive::uint64, 9},
                           std::pair{Primitive::float32, 10}, std::pair{Primitive::float64, 11},
                           std::pair{Primitive::string, 17},  std::pair{Primitive::wstring, 18}};
  constexpr int bounded_string_offset = 4;
  return std::ranges::find(ids, primitive, &decltype(ids)::value_type::first)->second +
         (bounded ? bounded_string_offset : 0);
}

int array_offset(ArrayKind kind) {
  return kind == ArrayKind::fixed       ? fixed_array_offset
         : kind == ArrayKind::bounded   ? bounded_sequence_offset
         : kind == ArrayKind::unbounded ? unbounded_sequence_offset
                                        : 0;
}

/// Names hold letters, digits, '_' and '/' only, so nothing has to be escaped.
std::string described_field(std::string_view name, int id, std::uint32_t capacity,
                            std::uint32_t string_capacity, std::string_view nested) {
  return fmt::format(
      R"({{"name": "{}", "type": {{"type_id": {}, "capacity": {}, "string_capacity": {}, "nested_type_name": "{}"}}}})",
      name, id, capacity, string_capacity, nested);
}

std::string described(std::string_view name, const std::vector<std::string>& fields) {
  return fmt::format(R"({{"type_name": "{}", "fields": [{}]}})", name, fmt::join(fields, ", "));
}

std::string described(const MessageDefinition& message) {
  std::vector<std::string> fields;
  for (const Field& field : message.fields) {
    const FieldType& type = field.type;
    const int id =
        type.primitive ? type_id(*type.primitive, type.string_bound != 0, message.is_idl) : nested_type_id;
    fields.push_back(described_field(field.name, id + array_offset(type.array), type.array_size,
                                     type.string_bound, type.message));
  }
  if (fields.empty()) {
    fields.push_back(described_field("structure_needs_at_least_one_member", uint8_id, 0, 0, ""));
  }
  return described(message.name, fields);
}

/// A service or an action: its parts, as if they were fields.
std::string described_parts(const std::string& name,
                            std::span<const std::pair<std::string_view, std::string_view>> parts) {
  std::vector<std::string> fields;
  for (const auto& [field, suffix] : parts) {
    fields.push_back(described_field(field, nested_type_id, 0, 0, name + std::string{suffix}));
  }
  return described(name, fields);
}

std::string described_service(const std::string& name) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 3> parts{
      {{"request_message", "_Request"}, {"response_message", "_Response"}, {"event_message", "_Event"}}};
  return described_parts(name, parts);
}

std::string described_action(const std::string& name) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 6> parts{
      {{"goal", "_Goal"},
       {"result", "_Result"},
       {"feedback", "_Feedback"},
       {"send_goal_service", "_SendGoal"},
       {"get_result_service", "_GetResult"},
       {"feedback_message", "_FeedbackMessage"}}};
  return described_parts(name, parts);
}

/// Descriptions by their type's name.
using Descriptions = std::map<std::string, std::string>;

tl::expected<void, TypeError> add_messages(TypeLibrary& library, const std::string& name, Descriptions& to) {
  const auto tree = library.resolve(name);
  if (!tree) {
    return tl::unexpected{tree.error()};
  }
  for (const MessageDefinition& message : tree->messages) {
    to.emplace(message.name, described(message));
  }
  return {};
}

}  // namespace

tl::expected<std::string, TypeError> hashed_description(TypeLibrary& library, std::string_view name) {
  const auto parts = interface_name(name);
  const std::string full = parts ? parts->full() : std::string{name};
  Descriptions descriptions;
  std::vector<std::string> roots;
  if (!parts || defining_interface(*parts)) {
    roots = {full};
  } else if (parts->kind == InterfaceKind::action &&
             std::ranges::none_of(action_services,
                                  [&](std::string_view suffix) { return full.ends_with(suffix); })) {
    descriptions = {{full, described_action(full)}};
    roots = {full + "_FeedbackMessage"};
    for (const std::string_view suffix : action_services) {
      const std::string service = full + std::string{suffix};
      descriptions.emplace(service, described_service(service));
      roots.push_back(service + "_Event");
    }
  } else {
    descriptions = {{full, described_service(full)}};
    roots = {full + "_Event"};
  }
  for (const std::string& root : roots) {
    if (auto added = add_messages(library, root, descriptions); !added) {
      return tl::unexpected{std::move(added.error())};
    }
  }
  const auto itself = descriptions.extract(full);
  std::vector<std::string_view> referenced;
  std::ranges::transform(descriptions, std::back_inserter(referenced), &Descriptions::value_type::second);
  return fmt::format(R"({{"type_description": {}, "referenced_type_descriptions": [{}]}})", itself.mapped(),
                     fmt::join(referenced, ", "));
}

tl::expected<std::string, TypeError> type_hash(TypeLibrary& library, std::string_view name) {
  const auto description = hashed_description(library, name);
  if (!description) {
    return tl::unexpected{description.error()};
  }
  const std::string digest = documents::sha256(*description);
  if (digest.empty()) {
    return tl::unexpected{TypeError{{}, 0, 0, "SHA-256 cannot be computed: OpenSSL refuses it"}};
  }
  return "RIHS01_" + digest;
}

}  // namespace trestle::messages
