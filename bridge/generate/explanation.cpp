#include "bridge/generate/explanation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <utility>

#include "bridge/describe/model_source.hpp"
#include "bridge/describe/protection.hpp"
#include "bridge/describe/raise.hpp"
#include "bridge/describe/refused.hpp"
#include "bridge/documents/problems.hpp"
#include "bridge/documents/section.hpp"
#include "bridge/messages/convert/service_plans.hpp"
#include "bridge/messages/types/type_library.hpp"
#include "bridge/messages/values/message_values.hpp"

namespace trestle::generate {
namespace {

using describe::ByteRange;
using describe::Layout;
using describe::LoweredMember;
using describe::Model;
using describe::Payload;
using describe::Protection;
using describe::Value;

/// One part of what was asked for.
struct Part {
  std::string element;
  std::string name;
  Payload payload{};
  Protection e2e{};
  describe::E2eUse use = describe::E2eUse::sent_event;
  std::string type{};         ///< the ROS message of its values; empty: there is none
  std::string why_no_type{};  ///< then
  messages::MessageRules rules{};
  std::string argument{};                            ///< as LoweredMember::argument
  std::shared_ptr<const describe::Lowered> alone{};  ///< of a type: what it is without services
};

/// Fields of an E2E header, in order: docs/e2e.md.
struct HeaderField {
  const char* name;
  std::size_t bytes;
};

std::vector<HeaderField> header_fields(std::string_view profile) {
  const HeaderField method{"message type, result, source", 4};
  if (profile == "1" || profile == "11" || profile == "2" || profile == "22") {
    return {{"CRC", 1}, {"counter", 1}};
  }
  if (profile == "5") {
    return {{"CRC", 2}, {"counter", 1}};
  }
  if (profile == "6") {
    return {{"CRC", 2}, {"length", 2}, {"counter", 1}};
  }
  std::vector<HeaderField> fields;
  if (profile.starts_with("4")) {
    fields = {{"length", 2}, {"counter", 2}, {"data id", 4}, {"CRC", 4}};
  } else if (profile.starts_with("7")) {
    fields = {{"CRC", 8}, {"length", 4}, {"counter", 4}, {"data id", 4}};
  } else if (profile.starts_with("8")) {
    fields = {{"CRC", 4}, {"length", 4}, {"counter", 4}, {"data id", 4}};
  }
  if (!fields.empty() && profile.ends_with("m")) {
    fields.push_back(method);
  }
  return fields;
}

class Search {
 public:
  Search(const describe::System& system, std::string_view wanted) : system_{system}, wanted_{wanted} {}

  /// @return the parts of what is wanted, none where there is no such element; or why it is not clear what is
  /// meant.
  tl::expected<std::vector<Part>, std::string> run() {
    const Model& model = system_.model;
    const describe::Service* in = nullptr;
    for (const describe::NamedService& named : describe::ServiceNames{model}.find(wanted_)) {
      const describe::Service& service = model.services[named.service];
      for (const describe::NamedMember& member : describe::named_members(service, named.rest)) {
        if (in != nullptr && in != &service) {
          return tl::unexpected{describe::several_services(*in, service)};
        }
        in = &service;
        add(service, named.service, member);
      }
    }
    if (found_.empty()) {
      types();
    }
    return std::move(found_);
  }

 private:
  using MemberPart = describe::NamedMember::Part;

  void add(const describe::Service& service, std::size_t at, const describe::NamedMember& member) {
    const std::string name = service.name + ".";
    switch (member.kind) {
      case LoweredMember::Kind::event: {
        const describe::Event& event = service.events[member.index];
        add(name + describe::member_key(event.name, event.selector), "payload", at, member, event.payload,
            event.e2e, describe::E2eUse::sent_event);
        return;
      }
      case LoweredMember::Kind::method: {
        const describe::Method& method = service.methods[member.index];
        const std::string full = name + describe::member_key(method.name, method.selector);
        if (member.part != MemberPart::response) {
          add(full, "request", at, member, method.request, method.e2e, describe::E2eUse::called);
        }
        if (member.part != MemberPart::request && !method.fire_and_forget) {
          add(full, "response", at, member, describe::response_of(system_.model, method), method.e2e,
              describe::E2eUse::served);
        }
        return;
      }
      case LoweredMember::Kind::field: {
        // All parts of a field carry the same, in a protection of their own.
        const describe::Field& field = service.fields[member.index];
        const char* const part = member.part == MemberPart::getter     ? "get"
                                 : member.part == MemberPart::setter   ? "set"
                                 : member.part == MemberPart::notifier ? "notify"
                                                                       : "payload";
        add(name + field.name, part, at, member, field.payload,
            member.part == MemberPart::getter   ? field.getter_e2e
            : member.part == MemberPart::setter ? field.setter_e2e
                                                : field.e2e,
            member.part == MemberPart::getter || member.part == MemberPart::setter
                ? describe::E2eUse::called
                : describe::E2eUse::sent_event);
        return;
      }
    }
  }

  void add(std::string element, std::string part, std::size_t service_at, const describe::NamedMember& member,
           Payload payload, const Protection& e2e, describe::E2eUse use) {
    const bool is_response = part == "response";
    Part made{.element = std::move(element),
              .name = std::move(part),
              .payload = std::move(payload),
              .e2e = e2e,
              .use = use};
    if (const LoweredMember* const lowered = system_.lowered.member(member.kind, service_at, member.index)) {
      made.type = lowered->type;
      if (member.kind == LoweredMember::Kind::method) {
        made.type += messages::service_suffixes[is_response ? 1 : 0];
      }
      made.rules = is_response ? lowered->response : lowered->rules;
      made.argument = lowered->argument;
    } else {
      const describe::Service& service = system_.model.services[service_at];
      made.why_no_type = describe::why_not_carried(
          system_.lowered, service, std::string_view{made.element}.substr(service.name.size() + 1));
    }
    found_.push_back(std::move(made));
  }

  void types() {
    types([this](const describe::Type& type) {
      return (!type.name.empty() &&
              (wanted_ == type.name || wanted_ == describe::full_name(type.scope, type.name))) ||
             (!type.ros_name.empty() && (wanted_ == type.ros_name || wanted_ == short_name(type.ros_name)));
    });
    if (found_.empty()) {  // "Door.Mode" of "car.Door.Mode"
      types([this](const describe::Type& type) {
        const std::string full = describe::full_name(type.scope, type.name);
        return !type.name.empty() && (full.ends_with("." + wanted_) || full.ends_with("/" + wanted_));
      });
    }
  }

  template <typename IsWanted>
  void types(const IsWanted& is_wanted) {
    const Model& model = system_.model;
    for (std::size_t at = 0; at < model.types.size(); ++at) {
      const describe::Type& type = model.types[at];
      if (!is_wanted(type)) {
        continue;
      }
      Part made{.element = std::string{wanted_}, .name = "type"};
      made.payload.values = {value_of(model, describe::TypeIndex{static_cast<std::uint32_t>(at)}, {})};
      // The values of a type alone, as an event would carry it.
      Model alone = model;
      alone.services = {{.name = "Type"}};
      describe::Event event{.name = "value"};
      event.payload = made.payload;
      event.payload.values[0].name = "value";
      alone.services[0].events.push_back(std::move(event));
      made.alone = std::make_shared<describe::Lowered>(describe::lower(alone));
      if (!made.alone->members.empty()) {
        const LoweredMember& lowered = made.alone->members[0];
        made.type = lowered.type;
        made.rules = lowered.rules;
        made.argument = lowered.argument;
      } else {
        made.why_no_type = describe::why_not_carried(*made.alone, alone.services[0], "value");
      }
      found_.push_back(std::move(made));
      return;
    }
  }

  /// "sensor_msgs/PointCloud2"
  static std::string short_name(const std::string& name) {
    const std::size_t at = name.find("/msg/");
    return at == std::string::npos ? name : name.substr(0, at) + name.substr(at + 4);
  }

  const describe::System& system_;
  std::string wanted_;
  std::vector<Part> found_;
};

/// All members of all services, for errors.
std::vector<std::string> names_of(const Model& model) {
  std::vector<std::string> names;
  for (const describe::Service& service : model.services) {
    for (const std::string& member : describe::member_names(service)) {
      names.push_back(service.name + "." + member);
    }
  }
  return names;
}

tl::expected<std::vector<std::byte>, std::string> bytes_of(const describe::System& system, const Part& part,
                                                           std::string_view values,
                                                           std::string_view values_name) {
  if (part.payload.values.empty() && describe::crc_fault(part.payload).empty()) {
    return std::vector<std::byte>{};
  }
  if (part.type.empty()) {
    return tl::unexpected{fmt::format("values of {} cannot be given: {}", part.element, part.why_no_type)};
  }
  const describe::Lowered& lowered = part.alone ? *part.alone : system.lowered;
  auto library =
      messages::TypeLibrary::of({std::make_shared<describe::ModelSource>(lowered, "the interfaces")});
  auto tree = library.resolve(part.type);
  if (!tree) {
    return tl::unexpected{to_string(tree.error())};
  }
  // In the words of the description, as `trestle call` has them; or in those of ROS, whose unions differ.
  const messages::TypeTree ros_tree = *tree;
  // Those of a method are of both its messages.
  const messages::MessageRules rules = messages::rules_for(ros_tree, part.rules);
  messages::Words words{.name = part.element, .argument = part.argument};
  for (const messages::MessageDefinition& message : tree->messages) {
    const auto found = lowered.words.find(message.name);
    words.messages.push_back(found == lowered.words.end() ? messages::MessageWords{} : found->second);
  }
  const auto made = messages::MessageValues::make(std::move(*tree), rules, std::move(words));
  if (!made) {
    return tl::unexpected{made.error()};
  }
  auto bytes = made->parse(values, messages::ValueForm::yaml);
  if (bytes) {
    return std::move(*bytes);
  }
  if (const auto by_ros = messages::MessageValues::make(ros_tree, rules)) {
    if (auto again = by_ros->parse(values, messages::ValueForm::yaml)) {
      return std::move(*again);
    }
  }
  return tl::unexpected{fmt::format("{}:{}{}", values_name, bytes.error().place.line == 0 ? " " : "",
                                    to_string(bytes.error()))};
}

/// The enumerations of a payload, each once, those of its first values first: with the value that has it
/// first.
std::vector<Value> with_enumerations(const Model& model, const Payload& payload) {
  std::vector<Value> all;
  std::set<describe::TypeIndex> seen;
  std::vector<Value> open{payload.values.rbegin(), payload.values.rend()};
  const auto look_at = [&](const Value& value, const std::string& name) {
    open.push_back(value);
    open.back().name = value.name.empty() ? name : value.name;
  };
  while (!open.empty()) {
    const Value value = std::move(open.back());
    open.pop_back();
    if (static_cast<std::size_t>(value.type) >= model.types.size() || !seen.insert(value.type).second) {
      continue;
    }
    const describe::Type& type = model.at(value.type);
    if (type.kind == describe::Kind::enumeration) {
      all.push_back(value);
    }
    look_at(type.element, value.name);
    look_at(type.key, value.name);
    const std::vector<Value> members = describe::all_members(model, type);
    std::for_each(members.rbegin(), members.rend(), [&](const Value& one) { look_at(one, value.name); });
  }
  return all;
}

std::vector<Explanation::Enumeration> enumerations_of(const Model& model, const Payload& payload) {
  std::vector<Explanation::Enumeration> all;
  for (const Value& value : with_enumerations(model, payload)) {
    const describe::Type& type = model.at(value.type);
    all.push_back({type.name.empty() ? value.name : type.name, describe::all_enumerators(model, type),
                   type.primitive == messages::Primitive::uint64});
  }
  return all;
}

/// A model in which enumerations of the payload that have the same name are called by their full names.
/// @return nothing where there are none.
std::optional<Model> told_apart(const Model& model, const Payload& payload) {
  std::map<std::string, std::vector<describe::TypeIndex>> by_name;
  for (const Value& value : with_enumerations(model, payload)) {
    if (const std::string& name = model.at(value.type).name; !name.empty()) {
      by_name[name].push_back(value.type);
    }
  }
  std::optional<Model> apart;
  for (const auto& [name, types] : by_name) {
    for (const describe::TypeIndex index : types) {
      if (types.size() > 1) {
        if (!apart) {
          apart = model;
        }
        describe::Type& type = apart->types[static_cast<std::size_t>(index)];
        type.name = describe::full_name(type.scope, name);
      }
    }
  }
  return apart;
}

std::string text_of(const Explanation::Enumeration& enumeration, const describe::Enumerator& one) {
  return enumeration.is_unsigned ? std::to_string(static_cast<std::uint64_t>(one.value))
                                 : std::to_string(one.value);
}

/// "  Side: LEFT = 0, RIGHT = 1", in several lines if need be.
std::string line_of(const Explanation::Enumeration& enumeration) {
  constexpr std::size_t widest = 100;
  std::string text = "  " + enumeration.name + ":";
  std::size_t begin = 0;
  for (std::size_t i = 0; i < enumeration.enumerators.size(); ++i) {
    const describe::Enumerator& one = enumeration.enumerators[i];
    const std::string piece = fmt::format("{} = {}", one.name, text_of(enumeration, one));
    text += i == 0 ? "" : ",";
    if (i > 0 && text.size() - begin + piece.size() > widest) {
      begin = text.size() + 1;
      text += "\n   ";
    }
    text += " " + piece;
  }
  return text + "\n";
}

std::string hex_of(const std::vector<std::byte>& bytes, std::size_t at, std::size_t size, std::size_t most) {
  std::string text;
  for (std::size_t i = at; i < at + std::min(size, most) && i < bytes.size(); ++i) {
    text += fmt::format("{}{:02x}", i == at ? "" : " ", static_cast<unsigned>(bytes[i]));
  }
  return size > most ? text + " …" : text;
}

}  // namespace

void add_header(const Protection& e2e, describe::E2eUse use, Layout& layout, std::vector<std::byte>* bytes) {
  const bool has_bytes = bytes != nullptr;
  const auto place_of_header = describe::protection_header(e2e);
  const std::vector<HeaderField> fields = header_fields(e2e.profile);
  const std::string fault = describe::e2e_fault(e2e, use);
  const std::string others = describe::other_instances(e2e);
  const std::string rule =
      (e2e.profile.empty()
           ? std::string{"none"}
           : fmt::format("profile {}, {}{}", e2e.profile,
                         fault.empty() ? "written when it is sent" : "which cannot be done: ", fault)) +
      (others.empty() ? "" : "; " + others);
  if (!place_of_header || fields.empty()) {
    if (!fault.empty() || !others.empty()) {
      layout.ranges.insert(
          layout.ranges.begin(),
          {.offset_text = "?", .size_text = "?", .path = "(E2E header)", .type = "header", .rule = rule});
    }
    return;
  }
  const std::size_t at = place_of_header->at;
  std::size_t size = 0;
  std::vector<ByteRange> header;
  for (const HeaderField& field : fields) {
    header.push_back({.offset = at + size,
                      .offset_text = fmt::to_string(at + size),
                      .bytes = field.bytes,
                      .size_text = fmt::to_string(field.bytes),
                      .path = fmt::format("(E2E {})", field.name),
                      .type = "header",
                      .rule = rule});
    size += field.bytes;
  }
  auto place = layout.ranges.begin();
  while (place != layout.ranges.end() && (place->depth > 0 || (place->offset && *place->offset < at))) {
    ++place;
  }
  for (auto range = place; range != layout.ranges.end(); ++range) {
    // Parts of elements count from these, where the layout is without bytes; of a CRC ("?") nobody
    // knows.
    if ((range->depth == 0 || has_bytes) && range->offset_text != "?") {
      const std::size_t digits = range->offset_text.find_first_not_of("0123456789");
      const std::size_t before = range->offset ? *range->offset : std::stoul(range->offset_text);
      range->offset_text = fmt::to_string(before + size) +
                           (digits == std::string::npos ? std::string{} : range->offset_text.substr(digits));
      if (range->offset) {
        range->offset = before + size;
      }
    }
  }
  for (describe::LayoutError& error : layout.errors) {
    error.offset += error.offset >= at ? size : 0;
  }
  layout.ranges.insert(place, header.begin(), header.end());
  if (has_bytes) {
    bytes->insert(bytes->begin() + static_cast<std::ptrdiff_t>(std::min(at, bytes->size())), size,
                  std::byte{0});
  }
}

tl::expected<std::vector<Explanation>, std::string> explain(const describe::System& system,
                                                            std::string_view element, std::string_view values,
                                                            std::string_view values_name) {
  auto found = Search{system, element}.run();
  if (!found) {
    return tl::unexpected{found.error()};
  }
  std::vector<Part> parts = std::move(*found);
  if (parts.empty()) {
    std::string text = fmt::format("there is no element or type {}", documents::quote(std::string{element}));
    const std::vector<std::string> names = names_of(system.model);
    if (const std::string likely = documents::nearest(std::string{element}, names); !likely.empty()) {
      text += fmt::format("; did you mean {}?", documents::quote(likely));
    } else if (!names.empty()) {
      constexpr std::size_t most = 30;
      text += "; there are: ";
      for (std::size_t i = 0; i < std::min(names.size(), most); ++i) {
        text += (i == 0 ? "" : ", ") + names[i];
      }
      text += names.size() > most ? ", …" : "";
    }
    return tl::unexpected{std::move(text)};
  }
  if (!values.empty() && parts.size() > 1) {
    parts.resize(1);  // a method's request
  }
  std::vector<Explanation> all;
  for (const Part& part : parts) {
    Explanation one{.element = part.element, .part = part.name};
    const std::optional<Model> apart = told_apart(system.model, part.payload);
    const Model& model = apart ? *apart : system.model;
    one.enumerations = enumerations_of(model, part.payload);
    if (values.empty()) {
      one.layout = describe::layout(model, part.payload);
    } else {
      auto bytes = bytes_of(system, part, values, values_name);
      if (!bytes) {
        return tl::unexpected{bytes.error()};
      }
      one.bytes = std::move(*bytes);
      one.layout = describe::layout(model, part.payload, one.bytes);
    }
    add_header(part.e2e, part.use, one.layout, values.empty() ? nullptr : &one.bytes);
    all.push_back(std::move(one));
  }
  return all;
}

std::string to_text(const Explanation& explanation) {
  constexpr std::size_t columns = 7;
  constexpr std::size_t bytes_shown = 8;
  const bool has_bytes = !explanation.bytes.empty();
  std::vector<std::array<std::string, columns>> rows{
      {"offset", "size", "bytes", "field", "type", "value", "rule"}};
  for (const ByteRange& one : explanation.layout.ranges) {
    const std::string indent(static_cast<std::size_t>(one.depth) * 2, ' ');
    rows.push_back({indent + (one.depth > 0 && !has_bytes ? "+" : "") + one.offset_text, one.size_text,
                    has_bytes && one.offset
                        ? hex_of(explanation.bytes, *one.offset, one.bytes.value_or(0), bytes_shown)
                        : std::string{},
                    one.path, one.type, one.value, one.rule});
  }
  std::array<std::size_t, columns> widths{};
  const auto width = [](const std::string& text) {
    return static_cast<std::size_t>(std::ranges::count_if(
        text, [](char one) { return (static_cast<unsigned char>(one) & 0xc0U) != 0x80U; }));
  };
  for (const auto& row : rows) {
    for (std::size_t i = 0; i < columns; ++i) {
      widths[i] = std::max(widths[i], std::min<std::size_t>(width(row[i]), 40));
    }
  }
  std::string text = fmt::format("{} {}:", explanation.element, explanation.part);
  text += explanation.layout.ranges.empty() ? " no bytes\n" : "\n";
  for (const auto& row : rows) {
    std::string line = " ";
    for (std::size_t i = 0; i < columns && !explanation.layout.ranges.empty(); ++i) {
      if (!has_bytes && (i == 2 || i == 5)) {
        continue;
      }
      line += " " + row[i] + std::string(widths[i] - std::min(widths[i], width(row[i])), ' ');
    }
    line.resize(line.find_last_not_of(' ') + 1);
    text += line.empty() ? "" : line + "\n";
  }
  for (const Explanation::Enumeration& enumeration : explanation.enumerations) {
    text += line_of(enumeration);
  }
  for (const describe::LayoutError& error : explanation.layout.errors) {
    text += fmt::format("  at byte {}{}: {}\n", error.offset, error.path.empty() ? "" : ", " + error.path,
                        error.text);
  }
  return text;
}

std::string to_json_text(const std::vector<Explanation>& explanations) {
  using Json = nlohmann::ordered_json;
  Json all = Json::array();
  for (const Explanation& one : explanations) {
    Json json{{"element", one.element}, {"part", one.part}};
    if (!one.bytes.empty()) {
      std::string hex;
      for (const std::byte byte : one.bytes) {
        hex += fmt::format("{:02x}", static_cast<unsigned>(byte));
      }
      json["bytes"] = hex;
    }
    json["ranges"] = Json::array();
    for (const ByteRange& range : one.layout.ranges) {
      Json entry{{"offset", range.offset_text}, {"size", range.size_text}, {"depth", range.depth},
                 {"field", range.path},         {"type", range.type},      {"rule", range.rule}};
      if (range.offset && range.bytes) {
        entry["at"] = *range.offset;
        entry["bytes"] = *range.bytes;
      }
      if (!range.value.empty()) {
        entry["value"] = range.value;
      }
      json["ranges"].push_back(std::move(entry));
    }
    for (const Explanation::Enumeration& enumeration : one.enumerations) {
      Json named{{"type", enumeration.name}};
      for (const describe::Enumerator& enumerator : enumeration.enumerators) {
        named["enumerators"].push_back({{"name", enumerator.name}, {"value", enumerator.value}});
      }
      json["enumerations"].push_back(std::move(named));
    }
    for (const describe::LayoutError& error : one.layout.errors) {
      json["errors"].push_back({{"at", error.offset}, {"field", error.path}, {"text", error.text}});
    }
    all.push_back(std::move(json));
  }
  return documents::printable_json(all.dump(2, ' ', false, Json::error_handler_t::replace)) + "\n";
}

}  // namespace trestle::generate
