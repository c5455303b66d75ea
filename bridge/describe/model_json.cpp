#include "bridge/describe/model_json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <utility>

#include "bridge/describe/instance_index.hpp"
#include "bridge/documents/format.hpp"
#include "bridge/documents/problems.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::describe {
namespace {

using Json = nlohmann::ordered_json;

/// Types without a name stand where they are used, down to this depth; deeper ones are named by their index.
/// Bounds what types that go round can make.
constexpr int max_inline_depth = 6;

template <typename Id>
Json id_json(Id id) {
  return fmt::format("0x{:04x}", someip::value(id));
}
template <typename Id>
Json id_json(const std::optional<Id>& id) {
  return id ? id_json(*id) : Json{};
}

const char* to_text(std::endian order) {
  return order == std::endian::big ? "big" : "little";
}
const char* to_text(someip::StringEncoding encoding) {
  switch (encoding) {
    case someip::StringEncoding::utf8:
      return "utf8";
    case someip::StringEncoding::utf16le:
      return "utf16le";
    case someip::StringEncoding::utf16be:
      return "utf16be";
  }
  return "";
}
std::size_t bits(someip::FieldWidth width) {
  return someip::bytes(width) * 8;
}

bool has_length(Kind kind) {
  return kind != Kind::primitive && kind != Kind::enumeration && kind != Kind::alias;
}

/// The rules that the kind needs, where they are not the default.
Json wire_json(Kind kind, const Wire& wire) {
  const Wire usual = default_wire(kind);
  Json json = Json::object();
  const auto put = [&](bool needed, const char* key, auto value, auto usual_value) {
    if (needed && value != usual_value) {
      json[key] = value;
    }
  };
  put(has_length(kind), "length", bits(wire.length), bits(usual.length));
  put(kind == Kind::choice, "selector", bits(wire.selector), bits(usual.selector));
  put(kind == Kind::choice, "length_first", wire.length_first, usual.length_first);
  put(kind == Kind::string, "encoding", std::string{to_text(wire.encoding)},
      std::string{to_text(usual.encoding)});
  put(kind == Kind::string, "bom", wire.bom, usual.bom);
  put(kind == Kind::string, "terminator", wire.terminator, usual.terminator);
  put(kind == Kind::string || kind == Kind::choice, "fixed_bytes", wire.fixed_bytes, 0U);
  put(kind == Kind::primitive || kind == Kind::enumeration, "bits", unsigned{wire.bits}, 0U);
  if (wire.byte_order) {
    json["byte_order"] = to_text(*wire.byte_order);
  }
  return json;
}

class ModelWriter {
 public:
  ModelWriter(const Model& model, const std::vector<std::string>& labels, bool with_places)
      : model_{model}, labels_{labels}, with_places_{with_places}, instances_{model} {}

  [[nodiscard]] Json type(const Type& type, int depth = 0) const;
  [[nodiscard]] Json constant(const Constant& constant) const;
  [[nodiscard]] Json collection(const TypeCollection& collection) const;
  [[nodiscard]] Json service(const Service& service) const;
  [[nodiscard]] Json instance(const Instance& instance, bool names_its_service) const;
  [[nodiscard]] Json machine(const Machine& machine) const;
  [[nodiscard]] bool is_inline(const Type& type) const {
    return type.name.empty() && type.kind != Kind::structure && type.kind != Kind::choice &&
           type.kind != Kind::enumeration;
  }
  [[nodiscard]] bool has_service(const Instance& instance) const {
    return instances_.service_of(instance) != nullptr;
  }
  [[nodiscard]] Json reference(TypeIndex index, int depth) const;
  /// The labels of all types with a name that a service's payloads are made of, in alphabetical order.
  [[nodiscard]] std::set<std::string> types_of(const Service& service) const;

 private:
  void notes(const Notes& notes, Json& json) const;
  void place(const Place& place, Json& json) const;
  [[nodiscard]] Json value(const Value& value, int depth) const;
  [[nodiscard]] Json values(const std::vector<Value>& all, int depth) const;
  [[nodiscard]] Json payload(const Payload& payload) const;
  [[nodiscard]] Json enumerators(const std::vector<Enumerator>& all) const;
  [[nodiscard]] Json event(const Event& event) const;
  [[nodiscard]] Json method(const Method& method) const;
  [[nodiscard]] Json field(const Field& field) const;
  using Members = std::map<someip::EventgroupId, std::vector<std::string>>;
  [[nodiscard]] static Members members_of_eventgroups(const Service& service);
  [[nodiscard]] Json eventgroup(const Members& members, const Eventgroup& eventgroup) const;
  static void transfer(const Transfer& transfer, const char* prefix, Json& json);
  static void protection(const Protection& protection, Json& json, const char* key = "e2e");
  void collect(TypeIndex index, std::set<std::size_t>& seen) const;

  const Model& model_;
  const std::vector<std::string>& labels_;
  bool with_places_;
  InstanceIndex instances_;
};

void ModelWriter::notes(const Notes& notes, Json& json) const {
  if (!notes.description.empty()) {
    json["description"] = notes.description;
  }
  if (!notes.unit.empty()) {
    json["unit"] = notes.unit;
  }
  if (!notes.others.empty()) {
    json["annotations"] = notes.others;
  }
}

void ModelWriter::place(const Place& place, Json& json) const {
  if (with_places_ && place.file < model_.files.size() && place.mark.line > 0) {
    json["place"] = fmt::format("{}:{}:{}", model_.files[place.file], place.mark.line, place.mark.column);
  }
}

Json ModelWriter::reference(TypeIndex index, int depth) const {
  const auto at = static_cast<std::size_t>(index);
  if (at >= model_.types.size()) {
    return nullptr;
  }
  const Type& type = model_.types[at];
  return is_inline(type) && depth < max_inline_depth ? this->type(type, depth + 1) : Json(labels_[at]);
}

Json ModelWriter::value(const Value& value, int depth) const {
  Json json = Json::object();
  if (!value.name.empty()) {
    json["name"] = value.name;
  }
  json["type"] = reference(value.type, depth);
  if (static_cast<std::size_t>(value.type) < model_.types.size()) {
    if (Json wire = wire_json(resolved(model_, value.type).kind, value.wire); !wire.empty()) {
      json["wire"] = std::move(wire);
    }
  }
  if (value.tag) {
    json["tag"] = static_cast<unsigned>(*value.tag);
  }
  if (value.optional) {
    json["optional"] = true;
  }
  if (!value.default_value.empty()) {
    json["default"] = value.default_value;
  }
  notes(value.notes, json);
  place(value.place, json);
  return json;
}

Json ModelWriter::values(const std::vector<Value>& all, int depth) const {
  Json json = Json::array();
  for (const Value& one : all) {
    json.push_back(value(one, depth));
  }
  return json;
}

Json ModelWriter::enumerators(const std::vector<Enumerator>& all) const {
  Json json = Json::array();
  for (const Enumerator& enumerator : all) {
    Json one{{"name", enumerator.name}, {"value", enumerator.value}};
    notes(enumerator.notes, one);
    place(enumerator.place, one);
    json.push_back(std::move(one));
  }
  return json;
}

Json ModelWriter::type(const Type& type, int depth) const {
  Json json = Json::object();
  if (!type.name.empty()) {
    json["name"] = type.name;
    json["scope"] = type.scope;
  }
  json["kind"] = to_string(type.kind);
  const bool is_number = type.kind == Kind::primitive || type.kind == Kind::enumeration;
  if (is_number) {
    json["primitive"] = messages::to_string(type.primitive);
  }
  if (type.backing) {
    json["backing"] = messages::to_string(*type.backing);
  }
  if (!type.ros_name.empty()) {
    json["ros_name"] = type.ros_name;
  }
  const auto put = [&json](const char* key, const auto& number) {
    if (number) {
      json[key] = *number;
    }
  };
  put("invalid_value", type.invalid_value);
  put("minimum", type.minimum);
  put("maximum", type.maximum);
  // The rules of a type without a name are those of its use.
  if (Json wire = wire_json(type.kind, type.wire); !type.name.empty() && !wire.empty()) {
    json["wire"] = std::move(wire);
  }
  if (type.base != no_type) {
    json["base"] = reference(type.base, max_inline_depth);
  }
  switch (type.kind) {
    case Kind::structure:
    case Kind::choice:
      json["members"] = values(type.members, depth);
      if (!type.selectors.empty()) {
        json["selectors"] = type.selectors;
      }
      break;
    case Kind::enumeration:
      json["enumerators"] = enumerators(type.enumerators);
      break;
    case Kind::map:
      json["key"] = value(type.key, depth);
      json["element"] = value(type.element, depth);
      break;
    case Kind::array:
    case Kind::alias:
      json["element"] = value(type.element, depth);
      break;
    case Kind::primitive:
    case Kind::string:
    case Kind::bytes:
      break;
  }
  if (type.polymorphic) {
    json["polymorphic"] = true;
  }
  if (type.min_size != 0) {
    json["min_size"] = type.min_size;
  }
  if (type.max_size != 0) {
    json["max_size"] = type.max_size;
  }
  if (type.fixed_size) {
    json["fixed_size"] = true;
  }
  notes(type.notes, json);
  place(type.place, json);
  // A type that is nothing but its kind is a word.
  if (type.name.empty() && json.size() == (is_number ? 2U : 1U) && type.kind != Kind::enumeration) {
    return is_number ? json["primitive"] : json["kind"];
  }
  return json;
}

Json ModelWriter::payload(const Payload& payload) const {
  Json json = Json::object();
  json["values"] = values(payload.values, 0);
  if (!payload.known) {
    json["known"] = false;
  }
  const Payload usual;
  if (payload.byte_order != usual.byte_order) {
    json["byte_order"] = to_text(payload.byte_order);
    json["length_order"] = payload.length_fields_always_big ? "big" : "as_payload";
  }
  if (payload.alignment != usual.alignment) {
    json["alignment"] = unsigned{payload.alignment};
  }
  if (payload.tagged_length != usual.tagged_length) {
    json["tagged_length"] = bits(payload.tagged_length);
  }
  if (payload.smallest_tagged_length) {
    json["tagged_lengths"] = "smallest";
  }
  if (payload.crc_bytes != 0) {
    json["crc_bytes"] = unsigned{payload.crc_bytes};
  }
  return json;
}

void ModelWriter::transfer(const Transfer& transfer, const char* prefix, Json& json) {
  const auto key = [prefix](const char* name) { return std::string{prefix} + name; };
  json[key("transport")] = transfer.transport == Transport::tcp ? "tcp" : "udp";
  if (transfer.segment_bytes != 0 || transfer.separation.count() != 0) {
    json[key("tp")] = Json{{"segment_bytes", transfer.segment_bytes},
                           {"separation", documents::to_string(Duration{transfer.separation})}};
  }
  if (transfer.debounce.count() != 0 || transfer.retention.count() != 0) {
    json[key("npdu")] = Json{{"debounce", documents::to_string(Duration{transfer.debounce})},
                             {"retention", documents::to_string(Duration{transfer.retention})}};
  }
}

Json settings_json(const Protection& protection) {
  Json e2e = Json::object();
  e2e["profile"] = nullptr;
  if (!protection.profile.empty()) {
    e2e["profile"] = protection.profile;
  }
  for (const auto& [key, number] : protection.numbers) {
    e2e[key] = number;
  }
  for (const auto& [key, word] : protection.words) {
    e2e[key] = word;
  }
  return e2e;
}

void ModelWriter::protection(const Protection& protection, Json& json, const char* name) {
  if (protection.empty()) {
    return;
  }
  Json e2e = settings_json(protection);
  for (const auto& [instance, its] : protection.of_instances) {
    e2e["instances"][id_json(instance).get<std::string>()] = settings_json(its);
  }
  json[name] = std::move(e2e);
}

template <typename Ids>
Json ids_json(const Ids& ids) {
  Json json = Json::array();
  for (const auto id : ids) {
    json.push_back(id_json(id));
  }
  return json;
}

Json ModelWriter::event(const Event& event) const {
  Json json{{"name", event.name}, {"id", id_json(event.id)}};
  json["eventgroups"] = ids_json(event.eventgroups);
  json["payload"] = payload(event.payload);
  transfer(event.transfer, "", json);
  if (event.selective) {
    json["selective"] = true;
  }
  if (!event.selector.empty()) {
    json["selector"] = event.selector;
  }
  if (event.cycle) {
    json["cycle"] = documents::to_string(Duration{*event.cycle});
  }
  if (event.observed_bytes) {
    json["observed_bytes"] = *event.observed_bytes;
  }
  protection(event.e2e, json);
  if (!event.ros_name.empty()) {
    json["ros_name"] = event.ros_name;
  }
  notes(event.notes, json);
  place(event.place, json);
  return json;
}

Json ModelWriter::method(const Method& method) const {
  Json json{{"name", method.name}, {"id", id_json(method.id)}};
  json["fire_and_forget"] = method.fire_and_forget;
  json["request"] = payload(method.request);
  transfer(method.request_transfer, "request_", json);
  if (!method.fire_and_forget) {
    json["response"] = payload(method.response);
    transfer(method.response_transfer, "response_", json);
  }
  if (!method.inout.empty()) {
    json["inout"] = method.inout;
  }
  if (method.error != no_type) {
    json["error"] = reference(method.error, 0);
  }
  if (!method.application_errors.empty()) {
    json["application_errors"] = method.application_errors;
  }
  if (!method.selector.empty()) {
    json["selector"] = method.selector;
  }
  if (method.timeout) {
    json["timeout"] = documents::to_string(Duration{*method.timeout});
  }
  if (method.observed_bytes) {
    json["observed_bytes"] = *method.observed_bytes;
  }
  protection(method.e2e, json);
  if (!method.ros_name.empty()) {
    json["ros_name"] = method.ros_name;
  }
  if (!method.ros_type.empty()) {
    json["ros_type"] = method.ros_type;
  }
  notes(method.notes, json);
  place(method.place, json);
  return json;
}

Json ModelWriter::field(const Field& field) const {
  Json json{{"name", field.name}};
  const auto part = [&json](bool there, const char* name, const std::optional<someip::MethodId>& id,
                            const Transfer& transfer) {
    if (there) {
      json[name] = id_json(id);
      ModelWriter::transfer(transfer, (std::string{name} + "_").c_str(), json);
    }
  };
  part(field.has_getter, "getter", field.getter, field.getter_transfer);
  part(field.has_setter, "setter", field.setter, field.setter_transfer);
  part(field.has_notifier, "notifier", field.notifier, field.notifier_transfer);
  json["eventgroups"] = ids_json(field.eventgroups);
  json["payload"] = payload(field.payload);
  if (field.cycle) {
    json["cycle"] = documents::to_string(Duration{*field.cycle});
  }
  if (field.observed_bytes) {
    json["observed_bytes"] = *field.observed_bytes;
  }
  protection(field.e2e, json);
  protection(field.getter_e2e, json, "getter_e2e");
  protection(field.setter_e2e, json, "setter_e2e");
  if (!field.ros_name.empty()) {
    json["ros_name"] = field.ros_name;
  }
  notes(field.notes, json);
  place(field.place, json);
  return json;
}

/// The names of events and fields, in this order.
ModelWriter::Members ModelWriter::members_of_eventgroups(const Service& service) {
  Members members;
  const auto add = [&](const auto& one) {
    for (const someip::EventgroupId id : std::set(one.eventgroups.begin(), one.eventgroups.end())) {
      members[id].push_back(one.name);
    }
  };
  std::ranges::for_each(service.events, add);
  std::ranges::for_each(service.fields, add);
  return members;
}

Json ModelWriter::eventgroup(const Members& members, const Eventgroup& eventgroup) const {
  Json json{{"name", eventgroup.name}, {"id", id_json(eventgroup.id)}};
  if (eventgroup.id_is_chosen) {
    json["id_is_chosen"] = true;
  }
  const auto found = members.find(eventgroup.id);
  json["events"] = found == members.end() ? Json::array() : Json(found->second);
  place(eventgroup.place, json);
  return json;
}

void ModelWriter::collect(TypeIndex index, std::set<std::size_t>& seen) const {
  std::vector<TypeIndex> open{index};
  while (!open.empty()) {
    const auto at = static_cast<std::size_t>(open.back());
    open.pop_back();
    if (at >= model_.types.size() || !seen.insert(at).second) {
      continue;
    }
    const Type& type = model_.types[at];
    for (const Value& member : type.members) {
      open.push_back(member.type);
    }
    open.insert(open.end(), {type.base, type.element.type, type.key.type});
  }
}

std::set<std::string> ModelWriter::types_of(const Service& service) const {
  std::set<std::size_t> seen;
  const auto add = [&](const Payload& payload) {
    for (const Value& value : payload.values) {
      collect(value.type, seen);
    }
  };
  for (const Event& event : service.events) {
    add(event.payload);
  }
  for (const Method& method : service.methods) {
    add(method.request);
    add(method.response);
    collect(method.error, seen);
  }
  for (const Field& field : service.fields) {
    add(field.payload);
  }
  std::set<std::string> labels;
  for (const std::size_t at : seen) {
    if (!is_inline(model_.types[at])) {
      labels.insert(labels_[at]);
    }
  }
  return labels;
}

Json ModelWriter::service(const Service& service) const {
  Json json{{"name", service.name}, {"scope", service.scope}, {"id", id_json(service.id)}};
  json["major"] = unsigned{service.major};
  json["minor"] = service.minor;
  if (service.id_is_chosen) {
    json["id_is_chosen"] = true;
  }
  if (!service.chosen_ids.empty()) {
    json["chosen_ids"] = ids_json(service.chosen_ids);
  }
  if (!service.base.empty()) {
    json["base"] = service.base;
  }
  if (!service.manages.empty()) {
    json["manages"] = service.manages;
  }
  if (service.from_ros) {
    json["from_ros"] = true;
  }
  if (!service.namespaces.empty()) {
    json["namespaces"] = service.namespaces;
  }
  const auto each = [&json](const char* key, const auto& all, const auto& to_json) {
    Json& list = json[key] = Json::array();
    for (const auto& one : all) {
      list.push_back(to_json(one));
    }
  };
  Json& instances = json["instances"] = Json::array();
  for (const Instance* one : instances_.of(service)) {
    instances.push_back(instance(*one, false));
  }
  each("methods", service.methods, [&](const Method& one) { return method(one); });
  each("events", service.events, [&](const Event& one) { return event(one); });
  each("fields", service.fields, [&](const Field& one) { return field(one); });
  const Members members = members_of_eventgroups(service);
  each("eventgroups", service.eventgroups, [&](const Eventgroup& one) { return eventgroup(members, one); });
  json["types"] = types_of(service);
  notes(service.notes, json);
  place(service.place, json);
  return json;
}

Json timing_json(const sd::Timing& timing) {
  return Json{
      {"initial_delay_min", documents::to_string(timing.initial_delay_min)},
      {"initial_delay_max", documents::to_string(timing.initial_delay_max)},
      {"repetitions_base_delay", documents::to_string(timing.repetitions_base_delay)},
      {"repetitions_max", unsigned{timing.repetitions_max}},
      {"cyclic_offer_delay", documents::to_string(timing.cyclic_offer_delay)},
      {"request_response_delay_min", documents::to_string(timing.request_response_delay_min)},
      {"request_response_delay_max", documents::to_string(timing.request_response_delay_max)},
      {"ttl", timing.ttl_s},
  };
}

Json ModelWriter::instance(const Instance& instance, bool names_its_service) const {
  Json json{{"name", instance.name}, {"id", id_json(instance.id)}};
  if (instance.id_is_chosen) {
    json["id_is_chosen"] = true;
  }
  json["role"] = instance.role == Instance::Role::provided ? "provided" : "required";
  if (names_its_service) {
    json["service"] = instance.service;
    json["service_id"] = id_json(instance.service_id);
  }
  const auto put = [&json](const char* key, const auto& number) {
    if (number) {
      json[key] = static_cast<std::uint64_t>(*number);
    }
  };
  put("major", instance.major);
  put("minor", instance.minor);
  if (instance.address) {
    json["address"] = someip::to_string(*instance.address);
  }
  put("udp_port", instance.udp_port);
  put("tcp_port", instance.tcp_port);
  if (!instance.multicast.empty()) {
    Json& list = json["multicast"] = Json::array();
    for (const Multicast& one : instance.multicast) {
      list.push_back(Json{{"eventgroup", id_json(one.eventgroup)},
                          {"address", someip::to_string(one.group.address)},
                          {"port", one.group.port},
                          {"threshold", one.threshold}});
    }
  }
  if (!instance.eventgroups.empty()) {
    json["eventgroups"] = ids_json(instance.eventgroups);
  }
  if (instance.timing) {
    json["timing"] = timing_json(*instance.timing);
  }
  put("priority", instance.priority);
  put("weight", instance.weight);
  if (!instance.configuration.empty()) {
    json["configuration"] = instance.configuration;
  }
  if (!instance.machine.empty()) {
    json["machine"] = instance.machine;
  }
  notes(instance.notes, json);
  place(instance.place, json);
  return json;
}

Json ModelWriter::machine(const Machine& machine) const {
  Json json{{"name", machine.name}};
  if (machine.address) {
    json["address"] = someip::to_string(*machine.address);
  }
  if (machine.sd_multicast) {
    json["sd_multicast"] = someip::to_string(*machine.sd_multicast);
  }
  if (machine.sd_port) {
    json["sd_port"] = *machine.sd_port;
  }
  place(machine.place, json);
  return json;
}

Json ModelWriter::collection(const TypeCollection& collection) const {
  Json json{{"scope", collection.scope}};
  if (collection.major != 1) {
    json["major"] = collection.major;
  }
  if (collection.minor != 0) {
    json["minor"] = collection.minor;
  }
  notes(collection.notes, json);
  place(collection.place, json);
  return json;
}

Json ModelWriter::constant(const Constant& constant) const {
  Json json{{"name", constant.name}, {"scope", constant.scope}};
  json["type"] = reference(constant.type, 0);
  json["value"] = constant.value;
  notes(constant.notes, json);
  place(constant.place, json);
  return json;
}

/// All but services and types.
void write_others(const Model& model, const ModelWriter& writer, Json& json) {
  Json& instances = json["instances"] = Json::array();
  for (const Instance& instance : model.instances) {
    if (!writer.has_service(instance)) {
      instances.push_back(writer.instance(instance, true));
    }
  }
  Json& machines = json["machines"] = Json::array();
  for (const Machine& machine : model.machines) {
    machines.push_back(writer.machine(machine));
  }
  Json& constants = json["constants"] = Json::array();
  for (const Constant& constant : model.constants) {
    constants.push_back(writer.constant(constant));
  }
  Json& collections = json["collections"] = Json::array();
  for (const TypeCollection& collection : model.collections) {
    collections.push_back(writer.collection(collection));
  }
}

std::string dump(const Json& json, int indent) {
  return documents::printable_json(json.dump(indent, ' ', false, Json::error_handler_t::replace));
}

}  // namespace

std::vector<std::string> type_labels(const Model& model) {
  std::vector<std::string> labels;
  std::map<std::string, int> uses;
  for (std::size_t at = 0; at < model.types.size(); ++at) {
    const Type& type = model.types[at];
    if (type.name.empty()) {
      labels.push_back(type.kind == Kind::primitive ? messages::to_string(type.primitive)
                       : type.kind == Kind::string || type.kind == Kind::bytes
                           ? to_string(type.kind)
                           : fmt::format("{}#{}", to_string(type.kind), at));
      continue;
    }
    std::string label = full_name(type.scope, type.name);
    const int use = ++uses[label];
    labels.push_back(use == 1 ? std::move(label) : fmt::format("{}#{}", label, use));
  }
  return labels;
}

Json to_json(const Model& model, bool with_places) {
  const std::vector<std::string> labels = type_labels(model);
  const ModelWriter writer{model, labels, with_places};
  Json json = Json::object();
  Json& services = json["services"] = Json::array();
  for (const Service& service : model.services) {
    services.push_back(writer.service(service));
  }
  Json& types = json["types"] = Json::array();
  for (std::size_t at = 0; at < model.types.size(); ++at) {
    if (writer.is_inline(model.types[at])) {
      continue;
    }
    Json type = Json::object();
    type["label"] = labels[at];
    if (const auto of = static_cast<std::size_t>(model.types[at].variant_of); of < labels.size()) {
      type["variant_of"] = labels[of];
    }
    type.update(writer.type(model.types[at]));
    types.push_back(std::move(type));
  }
  write_others(model, writer, json);
  return json;
}

bool is_model(std::span<const std::string_view> names) {
  return std::ranges::all_of(
      std::array{"services", "types", "instances", "machines"},
      [&](std::string_view one) { return std::ranges::find(names, one) != names.end(); });
}

std::string to_json_text(const Model& model, bool with_places) {
  return dump(to_json(model, with_places), 2) + "\n";
}

namespace {

/// Labels that depend on what types are, not on where they stand: types that are alike have one label.
/// Begins with the kinds, and looks at what types are made of until nothing new is told apart.
std::vector<std::string> labels_by_meaning(const Model& model) {
  std::vector<std::string> labels(model.types.size());
  std::size_t told_apart = 0;
  for (std::size_t round = 0; round <= model.types.size(); ++round) {
    const ModelWriter writer{model, labels, false};
    std::map<std::string, std::set<std::string>> meanings;  // by name
    std::vector<std::string> meaning(model.types.size());
    for (std::size_t at = 0; at < model.types.size(); ++at) {
      meaning[at] = dump(writer.type(model.types[at]), -1);
      meanings[full_name(model.types[at].scope, model.types[at].name)].insert(meaning[at]);
    }
    std::size_t now = 0;
    for (const auto& [name, all] : meanings) {
      now += all.size();
    }
    for (std::size_t at = 0; at < model.types.size(); ++at) {
      const std::string name = full_name(model.types[at].scope, model.types[at].name);
      const auto& all = meanings[name];
      const auto rank = std::distance(all.begin(), all.find(meaning[at]));
      labels[at] = rank == 0 ? name : fmt::format("{}#{}", name, rank + 1);
    }
    if (now == told_apart) {
      break;
    }
    told_apart = now;
  }
  return labels;
}

void sort_list(Json& list) {
  std::ranges::sort(list.get_ref<Json::array_t&>(), {}, [](const Json& one) { return dump(one, -1); });
}

}  // namespace

std::string canonical(const Model& model) {
  const std::vector<std::string> labels = labels_by_meaning(model);
  const ModelWriter writer{model, labels, false};
  Json json = Json::object();
  Json& services = json["services"] = Json::array();
  for (const Service& service : model.services) {
    Json one = writer.service(service);
    for (const char* list : {"instances", "methods", "events", "fields", "eventgroups"}) {
      sort_list(one[list]);
    }
    for (Json& eventgroup : one["eventgroups"]) {
      sort_list(eventgroup["events"]);
    }
    services.push_back(std::move(one));
  }
  std::map<std::string, Json> types;
  for (std::size_t at = 0; at < model.types.size(); ++at) {
    if (!writer.is_inline(model.types[at])) {
      types[labels[at]] = writer.type(model.types[at]);
    }
  }
  json["types"] = types;
  write_others(model, writer, json);
  for (const char* list : {"services", "instances", "machines", "constants", "collections"}) {
    sort_list(json[list]);
  }
  return dump(json, 2) + "\n";
}

}  // namespace trestle::describe
