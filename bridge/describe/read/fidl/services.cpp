#include "bridge/describe/read/fidl/services.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "bridge/describe/contradictions.hpp"
#include "bridge/describe/id_faults.hpp"
#include "bridge/describe/join.hpp"
#include "bridge/describe/join_instances.hpp"
#include "bridge/describe/read/fidl/keys.hpp"
#include "bridge/documents/format.hpp"
#include "bridge/documents/problems.hpp"

namespace trestle::describe::fidl {
namespace {

constexpr std::int64_t most_id = 0xffff;
constexpr std::int64_t most_number = std::numeric_limits<std::int32_t>::max();

class Maker {
 public:
  Maker(Model& model, Names& names, Types& types, Problems& findings)
      : model_{model}, names_{names}, types_{types}, findings_{findings} {}

  void service(const Collection& collection);
  void instance(const Node& node);
  void check_heirs();

 private:
  struct Deployment {
    const Node* node = nullptr;
    int version = 2;
  };
  void members(Service& service, const Collection& from, const Collection& whole);
  [[nodiscard]] Field field(const AttributeTree& tree, const Collection& from, Deployment deployment);
  [[nodiscard]] Method method(const MethodTree& tree, const Collection& from, Deployment deployment);
  [[nodiscard]] Event event(const BroadcastTree& tree, const Collection& from, Deployment deployment);
  /// That of the interface itself, else that of the one that it extends.
  [[nodiscard]] static Deployment deployment(const char* tag, const std::string& name,
                                             const std::string& selector, const Collection& from,
                                             const Collection& whole);
  void payload(Payload& into, const std::vector<Variable>& variables, const Collection& from,
               const Node* arguments, int version);
  void find_inout(Method& method, const MethodTree& tree);
  void rules(Payload& into, const Node* node, const char* stem);
  template <typename Member, typename Same>
  void tell_apart(std::vector<Member>& members, const Same& same, const char* what);
  void check_names(const Service& service);
  void check_targets(const Collection& collection);
  void refuse_polymorphic(const Payload& payload, Place place, const std::string& name);

  /// @param place  set to where it stands.
  template <typename Id>
  std::optional<Id> id(const Node* node, const char* key, Place& place) {
    const Setting* setting = node == nullptr ? nullptr : node->setting(key);
    const auto number = setting == nullptr ? std::nullopt : number_of(*setting, 0, most_id, findings_);
    if (!number) {
      return std::nullopt;
    }
    place = setting->values.front().place;
    return Id{static_cast<std::uint16_t>(*number)};
  }
  std::optional<someip::MethodId> member_id(const Node* node, const char* key, const std::string& name,
                                            Place& place);
  std::vector<someip::EventgroupId> eventgroups(const Node* node, std::initializer_list<const char*> keys);
  [[nodiscard]] bool is_true(const Node* node, const char* key) {
    const Setting* setting = node == nullptr ? nullptr : node->setting(key);
    return setting != nullptr && truth_of(*setting, findings_).value_or(false);
  }
  [[nodiscard]] std::optional<std::int64_t> number(const Node* node, const std::string& key,
                                                   std::int64_t min = 0) {
    const Setting* setting = node == nullptr ? nullptr : node->setting(key);
    return setting == nullptr ? std::nullopt : number_of(*setting, min, most_number, findings_);
  }
  /// Whether a member goes over TCP, and where that is said; nothing: nobody says.
  struct Reliable {
    bool is = false;
    std::optional<Place> at{};
  };
  /// @param keys  of which one that is true is enough.
  Reliable reliable(const Node* node, std::initializer_list<const char*> keys);
  Transfer transfer(const Node* node, const Reliable& reliable, const std::string& segment,
                    const std::string& separation, const std::string& debounce, const std::string& retention,
                    std::int64_t retention_ms);
  static void keep(Notes& notes, const Node* node, std::initializer_list<const char*> keys);

  Model& model_;
  Names& names_;
  Types& types_;
  Problems& findings_;
  std::map<std::string, std::optional<someip::ServiceId>, std::less<>> ids_;  ///< of services by name
  std::map<someip::EventgroupId, Place> groups_;  ///< of the service that is being made
  IdFaults id_faults_{model_, findings_};
};

std::vector<someip::EventgroupId> Maker::eventgroups(const Node* node,
                                                     std::initializer_list<const char*> keys) {
  std::vector<someip::EventgroupId> groups;
  for (const char* key : keys) {
    const Setting* setting = node == nullptr ? nullptr : node->setting(key);
    if (setting != nullptr) {
      for (const std::int64_t number : numbers_of(*setting, 0, most_id, findings_)) {
        const someip::EventgroupId group{static_cast<std::uint16_t>(number)};
        if (std::ranges::find(groups, group) == groups.end()) {
          groups.push_back(group);
        }
        const auto at = std::ranges::find(setting->values, number, &SettingValue::number);
        groups_.try_emplace(group, at->place);
      }
      break;
    }
  }
  return groups;
}

Maker::Reliable Maker::reliable(const Node* node, std::initializer_list<const char*> keys) {
  Reliable found;
  for (const char* key : keys) {
    const Setting* setting = node == nullptr ? nullptr : node->setting(key);
    if (setting != nullptr && !found.is) {
      found = {is_true(node, key), setting->key.place};
    }
  }
  return found;
}

/// 0 is reserved; other tools' files have it where nobody has chosen one yet.
std::optional<someip::MethodId> Maker::member_id(const Node* node, const char* key, const std::string& name,
                                                 Place& place) {
  const auto found = id<someip::MethodId>(node, key, place);
  if (found != someip::MethodId{}) {
    return found;
  }
  findings_.warning(
      std::exchange(place, {}),
      fmt::format("the {} of {} is 0, which is reserved; it is taken for none", key, documents::quote(name)));
  return std::nullopt;
}

/// @param retention_ms  of version 2 when nothing is said; there is none in version 1, and without a
/// deployment
Transfer Maker::transfer(const Node* node, const Reliable& reliable, const std::string& segment,
                         const std::string& separation, const std::string& debounce,
                         const std::string& retention, std::int64_t retention_ms) {
  Transfer transfer;
  transfer.transport = reliable.is ? Transport::tcp : Transport::udp;
  transfer.transport_at = reliable.at;
  const auto said_at = [&](const std::string& key) {
    const Setting* setting = node == nullptr || key.empty() ? nullptr : node->setting(key);
    return setting == nullptr ? std::nullopt : std::optional{setting->key.place};
  };
  transfer.segment_bytes_at = said_at(segment);
  transfer.retention_at = said_at(retention);
  const auto time = [&](const std::string& key, std::int64_t otherwise) {
    return std::chrono::milliseconds{key.empty() ? otherwise : number(node, key).value_or(otherwise)};
  };
  if (const auto bytes = segment.empty() ? std::nullopt : number(node, segment)) {
    if (*bytes % 16 != 0) {
      findings_.error(*transfer.segment_bytes_at,
                      fmt::format("{} is {}; expected a multiple of 16 bytes, as segments of SOME/IP-TP have "
                                  "it: {}",
                                  segment, *bytes, std::max<std::int64_t>(*bytes / 16 * 16, 16)));
    }
    transfer.segment_bytes = static_cast<std::uint32_t>(*bytes);  // 0: as nobody says it
  }
  transfer.separation = time(separation, 0);
  transfer.debounce = time(debounce, 0);
  transfer.retention = time(retention, node != nullptr && node->version == 2 ? retention_ms : 0);
  return transfer;
}

void Maker::keep(Notes& notes, const Node* node, std::initializer_list<const char*> keys) {
  for (const char* key : keys) {
    if (const Setting* setting = node == nullptr ? nullptr : node->setting(key)) {
      notes.others[key] = written(*setting);
    }
  }
}

void Maker::service(const Collection& collection) {
  const CollectionTree& tree = *collection.scope.in;
  Service service;
  service.name = tree.name.in_model();
  service.scope = collection.scope.source->tree.package;
  service.place = tree.name.place;
  service.notes = tree.notes;
  groups_.clear();
  service.id = id<someip::ServiceId>(collection.node, "SomeIpServiceID", service.id_place);
  if (service.id == someip::ServiceId{}) {
    // Reserved by the specification; other tools' files have it where nobody has chosen one yet.
    findings_.warning(collection.node->setting("SomeIpServiceID")->key.place,
                      fmt::format("the SomeIpServiceID of {} is 0, which no service can have; it is taken "
                                  "for none",
                                  documents::quote(service.name)));
    service.id.reset();
    service.id_place = {};
  }
  service.has_version = tree.has_version;
  if (!tree.has_version) {
    if (!tree.name.text.empty()) {  // else its name was missed already
      findings_.warning(
          tree.name.place,
          fmt::format("{} has no version, for which CommonAPI's generators refuse it; 1.0 is taken",
                      documents::quote(tree.name.text)));
    }
  } else if (tree.major < 0 || tree.major > 0xff) {
    findings_.error(tree.name.place,
                    fmt::format("the major version of {} is {}; expected a number from 0 to 255, as the "
                                "header of a message has it",
                                documents::quote(tree.name.text), tree.major));
  } else if (tree.minor < 0 || tree.minor > std::numeric_limits<std::uint32_t>::max()) {
    findings_.error(tree.name.place, fmt::format("the minor version of {} has more than 32 bits",
                                                 documents::quote(tree.name.text)));
  } else {
    service.major = static_cast<std::uint8_t>(tree.major);
    service.minor = static_cast<std::uint32_t>(tree.minor);
  }
  keep(service.notes, collection.node, {"DefaultTimeout", "DefaultEnumBackingType"});
  if (collection.line.size() > 1) {
    service.base = collection.line[collection.line.size() - 2]->scope.model;
  }
  for (const Name& name : tree.manages) {
    if (const Collection* other = names_.interface(name, collection.scope)) {
      service.manages.push_back(other->scope.model);
    }
  }
  for (const Collection* from : collection.line) {
    members(service, *from, collection);
  }
  const auto same = [](const Payload& one, const Payload& other) {
    return std::ranges::equal(one.values, other.values, {}, &Value::type, &Value::type);
  };
  tell_apart(
      service.methods,
      [&](const Method& one, const Method& other) {
        return same(one.request, other.request) && same(one.response, other.response);
      },
      "method");
  tell_apart(
      service.events, [&](const Event& one, const Event& other) { return same(one.payload, other.payload); },
      "broadcast");
  std::ignore = eventgroups(collection.node, {"SomeIpEventGroups"});
  for (const auto& [group, place] : groups_) {
    service.eventgroups.push_back({.id = group, .place = place});
  }
  check_names(service);
  check_targets(collection);
  id_faults_.tell_same(service);
  ids_[collection.scope.model] = service.id;
  model_.services.push_back(std::move(service));
}

Maker::Deployment Maker::deployment(const char* tag, const std::string& name, const std::string& selector,
                                    const Collection& from, const Collection& whole) {
  const std::string target = selector.empty() ? name : name + ":" + selector;
  for (const Collection* collection : {&whole, &from}) {
    if (collection->node == nullptr) {
      continue;
    }
    if (const Node* node = collection->node->child(tag, target)) {
      return {node, node->version};
    }
  }
  return {nullptr, from.version};
}

void Maker::members(Service& service, const Collection& from, const Collection& whole) {
  const CollectionTree& tree = *from.scope.in;
  for (const AttributeTree& attribute : tree.attributes) {
    service.fields.push_back(
        field(attribute, from, deployment("attribute", attribute.value.name.text, "", from, whole)));
  }
  for (const MethodTree& one : tree.methods) {
    service.methods.push_back(
        method(one, from, deployment("method", one.name.text, one.selector, from, whole)));
  }
  for (const BroadcastTree& one : tree.broadcasts) {
    service.events.push_back(
        event(one, from, deployment("broadcast", one.name.text, one.selector, from, whole)));
  }
}

void Maker::refuse_polymorphic(const Payload& payload, Place place, const std::string& name) {
  for (const Value& value : payload.values) {
    const std::string found = types_.polymorphic_in(value.type);
    if (!found.empty()) {
      findings_.warning(
          place, fmt::format("{} uses the {} {}: SOME/IP has no form for one, so it can be described but not "
                             "carried",
                             documents::quote(name), found == "undefined" ? "type" : "polymorphic struct",
                             documents::quote(found)));
      return;
    }
  }
}

/// Byte order and CRC.
void Maker::rules(Payload& into, const Node* node, const char* stem) {
  if (node == nullptr) {
    return;
  }
  if (const Setting* order = node->setting(fmt::format("SomeIp{}Endianess", stem))) {
    into.byte_order = word_of(*order, {"be", "le"}, findings_) == 1 ? std::endian::little : std::endian::big;
  }
  if (const Setting* crc = node->setting(fmt::format("SomeIp{}CRCWidth", stem))) {
    const std::size_t width = word_of(*crc, {"zero", "one", "four"}, findings_);
    into.crc_bytes = width == 2 ? 4 : static_cast<std::uint8_t>(width);
  }
}

void Maker::payload(Payload& into, const std::vector<Variable>& variables, const Collection& from,
                    const Node* arguments, int version) {
  std::set<std::string, std::less<>> names;
  for (const Variable& variable : variables) {
    if (!names.insert(variable.name.text).second) {
      findings_.error(variable.name.place,
                      fmt::format("the argument {} is declared twice", documents::quote(variable.name.text)));
      continue;
    }
    const Node* node = arguments == nullptr ? nullptr : arguments->child("", variable.name.text);
    Value value = types_.use(variable, from.scope, layers_of(node, User::argument), version);
    if (value.type != no_type) {
      into.values.push_back(std::move(value));
    }
  }
  if (arguments != nullptr) {
    for (const Node& child : arguments->children) {
      if (child.tag.empty() && !names.contains(child.target.text)) {
        findings_.error(child.place,
                        fmt::format("there is no argument {}{}", documents::quote(child.target.text),
                                    hint(child.target.text, {names.begin(), names.end()})));
      }
    }
  }
}

Field Maker::field(const AttributeTree& tree, const Collection& from, Deployment deployment) {
  const Node* node = deployment.node;
  Field field;
  field.name = tree.value.name.in_model();
  field.notes = tree.value.notes;
  field.place = tree.value.name.place;
  // "length fields follow the byte order" is CommonAPI's, which is what FIDL is of.
  Value value = types_.use(tree.value, from.scope, layers_of(node, User::attribute), deployment.version);
  value.notes = {.unit = std::exchange(field.notes.unit, {})};
  if (value.type != no_type) {
    field.payload.values.push_back(std::move(value));
  }
  rules(field.payload, node, "Attribute");
  field.has_getter = !tree.no_read;
  field.has_setter = !tree.readonly;
  field.has_notifier = !tree.no_subscriptions;
  // An id of 0 means that there is none.
  const auto part = [&](const char* key, bool& there, Place& place) -> std::optional<someip::MethodId> {
    auto found = id<someip::MethodId>(node, key, place);
    if (found == someip::MethodId{}) {
      there = false;
    }
    return there ? found : std::nullopt;
  };
  field.getter = part("SomeIpGetterID", field.has_getter, field.getter_place);
  field.setter = part("SomeIpSetterID", field.has_setter, field.setter_place);
  field.notifier = part("SomeIpNotifierID", field.has_notifier, field.notifier_place);
  field.eventgroups = eventgroups(node, {"SomeIpNotifierEventGroups", "SomeIpEventGroups"});
  const auto reliable_part = [&](const char* key) {
    return reliable(node, {"SomeIpAttributeReliable", key});
  };
  field.getter_transfer = transfer(node, reliable_part("SomeIpGetterReliable"),
                                   "SomeIpGetterSegmentLengthResponse", "SomeIpGetterSeparationTimeResponse",
                                   "SomeIpGetterRequestDebounceTime", "SomeIpGetterMaxRetentionTime", 5);
  field.setter_transfer = transfer(node, reliable_part("SomeIpSetterReliable"), "SomeIpSetterSegmentLength",
                                   "SomeIpSetterSeparationTime", "SomeIpSetterRequestDebounceTime",
                                   "SomeIpSetterMaxRetentionTime", 5);
  field.notifier_transfer = transfer(node, reliable_part("SomeIpNotifierReliable"),
                                     "SomeIpNotifierSegmentLength", "SomeIpNotifierSeparationTime",
                                     "SomeIpNotifierDebounceTime", "SomeIpNotifierMaxRetentionTime", 5);
  keep(field.notes, node,
       {"AttributeSetterTimeout", "AttributeGetterTimeout", "AttributeNotifierTimeout",
        "AttributeNotifierUpdateMode", "SomeIpGetterPriority", "SomeIpSetterPriority",
        "SomeIpNotifierPriority", "SomeIpNotifierMulticast", "SomeIpGetterResponseMaxRetentionTime",
        "SomeIpSetterResponseMaxRetentionTime", "SomeIpGetterResponseDebounceTime",
        "SomeIpSetterResponseDebounceTime"});
  if (const Setting* timeout = node == nullptr ? nullptr : node->setting("Timeout")) {
    field.notes.others["AttributeGetterTimeout"] = written(*timeout);
    field.notes.others["AttributeSetterTimeout"] = written(*timeout);
  }
  refuse_polymorphic(field.payload, field.place, field.name);
  return field;
}

Method Maker::method(const MethodTree& tree, const Collection& from, Deployment deployment) {
  const Node* node = deployment.node;
  Method method;
  method.name = tree.name.in_model();
  method.selector = tree.selector;
  method.notes = tree.notes;
  method.place = tree.name.place;
  method.fire_and_forget = tree.fire_and_forget;
  method.id = member_id(node, "SomeIpMethodID", method.name, method.id_place);
  payload(method.request, tree.in, from, node == nullptr ? nullptr : node->child("in", ""),
          deployment.version);
  payload(method.response, tree.out, from, node == nullptr ? nullptr : node->child("out", ""),
          deployment.version);
  for (const Variable& variable : tree.out) {
    if (std::ranges::any_of(tree.in,
                            [&](const Variable& in) { return in.name.text == variable.name.text; })) {
      findings_.warning(variable.name.place,
                        fmt::format("the argument {} is in 'in', too: Franca refuses one name in both",
                                    documents::quote(variable.name.text)));
    }
  }
  find_inout(method, tree);
  rules(method.request, node, "Method");
  rules(method.response, node, "Method");
  if (tree.own_error != nullptr) {
    method.error = types_.own_error(*tree.own_error, from.scope, from.version);
  } else if (!tree.error.empty()) {
    Declared* error = names_.type(tree.error, from.scope);
    method.error = error == nullptr ? no_type : types_.type(*error);
    if (method.error != no_type && resolved(model_, method.error).kind != Kind::enumeration) {
      findings_.error(tree.error.place, fmt::format("{} is no enumeration; only one can be an error",
                                                    documents::quote(tree.error.text)));
      method.error = no_type;
    }
  }
  if (tree.fire_and_forget && (!tree.out.empty() || tree.own_error != nullptr || !tree.error.empty())) {
    findings_.error(
        tree.name.place,
        fmt::format("{} is called without waiting (fireAndForget), so it has no 'out' and no 'error'",
                    documents::quote(tree.name.text)));
  }
  const Reliable is_reliable = reliable(node, {"SomeIpReliable"});
  method.request_transfer =
      transfer(node, is_reliable, "SomeIpMethodSegmentLength", "SomeIpMethodSeparationTime",
               "SomeIpMethodRequestDebounceTime", "SomeIpMethodMaxRetentionTime", 5);
  method.response_transfer =
      transfer(node, is_reliable, "SomeIpMethodSegmentLengthResponse", "SomeIpMethodSeparationTimeResponse",
               "SomeIpMethodResponseDebounceTime", "SomeIpMethodResponseMaxRetentionTime", 0);
  for (const char* key : {"MethodTimeout", "Timeout"}) {
    if (const auto timeout = number(node, key, -1); timeout && *timeout > 0) {
      method.timeout = std::chrono::milliseconds{*timeout};
    }
  }
  keep(method.notes, node, {"Errors", "SomeIpPriority"});
  refuse_polymorphic(method.request, method.place, method.name);
  refuse_polymorphic(method.response, method.place, method.name);
  return method;
}

/// Arguments that are in both, by an annotation of the one in `out`.
void Maker::find_inout(Method& method, const MethodTree& tree) {
  for (const Variable& variable : tree.out) {
    if (!variable.is_inout) {
      continue;
    }
    const std::string& name = variable.name.in_model();
    const auto in = std::ranges::find(method.request.values, name, &Value::name);
    const auto out = std::ranges::find(method.response.values, name, &Value::name);
    if (in != method.request.values.end() && out != method.response.values.end() && types_.same(*in, *out)) {
      method.inout.push_back(name);
    } else {
      findings_.warning(variable.name.place,
                        fmt::format("{} is not also in (inout), as its annotation tells: there is no {} in "
                                    "'in', or one of another type",
                                    documents::quote(variable.name.text), documents::quote(name)));
    }
  }
}

Event Maker::event(const BroadcastTree& tree, const Collection& from, Deployment deployment) {
  const Node* node = deployment.node;
  Event event;
  event.name = tree.name.in_model();
  event.selector = tree.selector;
  event.selective = tree.selective;
  event.notes = tree.notes;
  event.place = tree.name.place;
  event.id = member_id(node, "SomeIpEventID", event.name, event.id_place);
  payload(event.payload, tree.out, from, node == nullptr ? nullptr : node->child("out", ""),
          deployment.version);
  rules(event.payload, node, "Broadcast");
  event.eventgroups = eventgroups(node, {"SomeIpEventGroups"});
  event.transfer = transfer(node, reliable(node, {"SomeIpReliable"}), "SomeIpBroadcastSegmentLength",
                            "SomeIpBroadcastSeparationTime", "SomeIpBroadcastDebounceTime",
                            "SomeIpBroadcastMaxRetentionTime", 5);
  keep(event.notes, node, {"BroadcastType", "ErrorName", "SomeIpPriority", "SomeIpMulticast"});
  refuse_polymorphic(event.payload, event.place, event.name);
  return event;
}

void Maker::instance(const Node& node) {
  Instance instance;
  instance.place = node.place;
  const Collection* service = names_.interface(node.target, {});
  if (service == nullptr) {
    return;
  }
  instance.service = service->scope.model;
  Place id_place;
  instance.id = id<someip::InstanceId>(&node, "SomeIpInstanceID", id_place);
  if (instance.id && !someip::names_an_instance(*instance.id)) {
    findings_.warning(id_place,
                      fmt::format("the SomeIpInstanceID 0x{:04x} cannot be that of an instance: it is "
                                  "left open",
                                  someip::value(*instance.id)));
    instance.id.reset();
  }
  if (const auto known = ids_.find(instance.service); known != ids_.end()) {
    instance.service_id = known->second;
  }
  const auto text = [&](const char* key) {
    const Setting* setting = node.setting(key);
    const auto texts = setting == nullptr ? std::vector<std::string>{} : texts_of(*setting, findings_);
    return texts.empty() ? std::string{} : texts.front();
  };
  const auto said = [&](std::string_view setting, std::string_view key) {
    if (const Setting* const found = node.setting(key)) {
      instance.said_at[setting] = found->key.place;
    }
  };
  instance.name = text("InstanceId");
  said("name", "InstanceId");
  said("id", "SomeIpInstanceID");
  const documents::Format<IpAddress> format = documents::ip_address();
  if (const std::string address = text("SomeIpUnicastAddress"); !address.empty() && address != "0.0.0.0") {
    said("address", "SomeIpUnicastAddress");
    instance.address = format.read(address);
    if (!instance.address) {
      findings_.error(
          node.setting("SomeIpUnicastAddress")->values.front().place,
          fmt::format("{} is no address; expected one as 192.168.0.2 or fd00::2", documents::quote(address)));
    }
  }
  const auto port = [&](const char* key) -> std::optional<std::uint16_t> {
    const Setting* setting = node.setting(key);
    const auto number = setting == nullptr ? std::nullopt : number_of(*setting, 0, most_id, findings_);
    return number.value_or(0) == 0 ? std::nullopt : std::optional{static_cast<std::uint16_t>(*number)};
  };
  instance.tcp_port = port("SomeIpReliableUnicastPort");
  instance.udp_port = port("SomeIpUnreliableUnicastPort");
  for (const std::string_view setting : {"tcp_port", "udp_port"}) {
    said(setting, "SomeIpUnicastPort");
  }
  said("tcp_port", "SomeIpReliableUnicastPort");
  said("udp_port", "SomeIpUnreliableUnicastPort");
  if (const auto both = port("SomeIpUnicastPort")) {
    instance.tcp_port = node.setting("SomeIpReliableUnicastPort") == nullptr ? both : instance.tcp_port;
    instance.udp_port = node.setting("SomeIpUnreliableUnicastPort") == nullptr ? both : instance.udp_port;
  }
  const auto numbers = [&](const char* key, std::int64_t most) {
    const Setting* setting = node.setting(key);
    return setting == nullptr ? std::vector<std::int64_t>{} : numbers_of(*setting, 0, most, findings_);
  };
  const auto groups = numbers("SomeIpMulticastEventGroups", most_id);
  const auto ports = numbers("SomeIpMulticastPorts", most_id);
  const auto thresholds = numbers("SomeIpMulticastThreshold", most_number);
  const Setting* addresses = node.setting("SomeIpMulticastAddresses");
  const auto address_texts =
      addresses == nullptr ? std::vector<std::string>{} : texts_of(*addresses, findings_);
  if (groups.empty() && !address_texts.empty()) {
    findings_.warning(
        addresses->key.place,
        "no SomeIpMulticastEventGroups tells which events go to the multicast addresses, which are left "
        "out");
  } else if (groups.size() != ports.size() || groups.size() != address_texts.size() ||
             (!thresholds.empty() && thresholds.size() != groups.size())) {
    findings_.error(
        node.place,
        fmt::format("the lists SomeIpMulticastEventGroups, -Addresses, -Ports and -Threshold belong "
                    "together, and have {}, {}, {} and {} values",
                    groups.size(), address_texts.size(), ports.size(), thresholds.size()));
  } else {
    const Setting* const threshold_key = node.setting("SomeIpMulticastThreshold");
    const auto said_threshold =
        threshold_key == nullptr ? std::nullopt : std::optional{threshold_key->key.place};
    for (std::size_t i = 0; i < groups.size(); ++i) {
      const auto address = documents::multicast_address().read(address_texts[i]);
      if (!address) {
        findings_.error(addresses->values[i].place,
                        fmt::format("{} is no multicast address; expected one as 224.244.224.245",
                                    documents::quote(address_texts[i])));
        continue;
      }
      // Version 1 has no threshold: there a multicast address was always used.
      const std::int64_t threshold = thresholds.empty() ? (node.version == 1 ? 1 : 0) : thresholds[i];
      instance.multicast.push_back({someip::EventgroupId{static_cast<std::uint16_t>(groups[i])},
                                    {*address, static_cast<std::uint16_t>(ports[i])},
                                    static_cast<std::uint32_t>(threshold),
                                    addresses->key.place,
                                    said_threshold});
    }
  }
  keep(instance.notes, &node,
       {"Domain", "Variant", "Year", "PreregisteredProperties", "DefaultTimeout", "CodeArtifactName"});
  // A deployment of CommonAPI's core says more of an instance, and does not know its id.
  const auto same = std::ranges::find_if(model_.instances, [&](const Instance& one) {
    return one.service == instance.service && one.name == instance.name && !one.name.empty() &&
           !(one.id && instance.id);
  });
  Contradictions contradictions{
      model_, [this](const Place& place, std::string found) { findings_.error(place, std::move(found)); },
      [this](const Place& place, std::string found) { findings_.warning(place, std::move(found)); }};
  if (same == model_.instances.end()) {
    if (const auto other = std::ranges::find_if(model_.instances,
                                                [&](const Instance& one) {
                                                  return one.service == instance.service &&
                                                         one.name == instance.name;
                                                });
        other != model_.instances.end() && !instance.name.empty()) {
      const auto id_of = [](const Instance& one) {
        return SaidValue{fmt::format("0x{:04x}", someip::value(*one.id)),
                         one.said_at.contains("id") ? one.said_at.at("id") : one.place};
      };
      contradictions.compare(
          fmt::format("instance {} of {}", documents::quote(instance.name), instance.service),
          "the SomeIpInstanceID", id_of(*other), id_of(instance));
    }
    model_.instances.push_back(std::move(instance));
    return;
  }
  if (!same->id) {
    std::swap(*same, instance);
  }
  add_instance(*same, instance, contradictions);
}

/// Franca takes members of one name that differ in their arguments alone. Here each needs a name of its own,
/// so they get selectors.
/// @param same  whether two members have the same arguments.
template <typename Member, typename Same>
void Maker::tell_apart(std::vector<Member>& members, const Same& same, const char* what) {
  std::map<std::string, std::vector<const Member*>, std::less<>> without;
  for (Member& one : members) {
    if (!one.selector.empty()) {
      continue;
    }
    std::vector<const Member*>& others = without[one.name];
    const bool is_twin = std::ranges::any_of(others, [&](const Member* other) { return same(*other, one); });
    if (is_twin || others.size() >= 100) {
      continue;  // refused below
    }
    others.push_back(&one);
    if (others.size() > 1) {
      one.selector = fmt::format("overload{}", others.size());
      findings_.warning(one.place,
                        fmt::format("the {} {} is there twice without a selector; this one is called {}:{}",
                                    what, documents::quote(one.name), one.name, one.selector));
    }
  }
}

void Maker::check_names(const Service& service) {
  std::set<std::string, std::less<>> fields;
  std::set<std::string, std::less<>> methods;
  std::set<std::string, std::less<>> events;
  const auto once = [&](std::set<std::string, std::less<>>& names, std::string name, Place place,
                        const char* what) {
    if (!names.insert(name).second) {
      findings_.error(place, fmt::format("{} has the {} {} twice", documents::quote(service.name), what,
                                         documents::quote(name)));
    }
  };
  const auto named = [](const std::string& name, const std::string& selector) {
    return selector.empty() ? name : name + ":" + selector;
  };
  for (const Field& field : service.fields) {
    once(fields, field.name, field.place, "attribute");
  }
  for (const Method& method : service.methods) {
    once(methods, named(method.name, method.selector), method.place, "method");
  }
  for (const Event& event : service.events) {
    once(events, named(event.name, event.selector), event.place, "broadcast");
  }
}

/// What is deployed has to be there.
void Maker::check_targets(const Collection& collection) {
  if (collection.node == nullptr) {
    return;
  }
  // Each with the interface that declares it.
  std::map<std::string_view, std::map<std::string, const Collection*, std::less<>>> known{
      {"attribute", {}}, {"method", {}}, {"broadcast", {}}};
  const auto named = [](const Name& name, const std::string& selector) {
    return selector.empty() ? name.text : name.text + ":" + selector;
  };
  for (const Collection* from : collection.line) {
    for (const AttributeTree& attribute : from->scope.in->attributes) {
      known["attribute"].insert_or_assign(attribute.value.name.text, from);
    }
    for (const MethodTree& method : from->scope.in->methods) {
      known["method"].insert_or_assign(named(method.name, method.selector), from);
    }
    for (const BroadcastTree& broadcast : from->scope.in->broadcasts) {
      known["broadcast"].insert_or_assign(named(broadcast.name, broadcast.selector), from);
    }
  }
  for (const Node& child : collection.node->children) {
    const auto names = known.find(child.tag);
    if (names == known.end()) {
      static const std::vector<std::string> tags{"attribute", "method",      "broadcast", "array",  "struct",
                                                 "union",     "enumeration", "map",       "typedef"};
      if (std::ranges::find(tags, child.tag) == tags.end()) {
        findings_.error(child.place,
                        fmt::format("there is {}; expected one of {}{}", documents::quote(child.tag),
                                    fmt::join(tags, ", "), hint(child.tag, tags)));
      }
      continue;
    }
    const auto member = names->second.find(child.target.text);
    if (member == names->second.end()) {
      std::vector<std::string> all;
      std::ranges::transform(names->second, std::back_inserter(all),
                             [](const auto& one) { return one.first; });
      findings_.error(child.place,
                      fmt::format("{} has no {} {}{}", documents::quote(collection.scope.name), child.tag,
                                  documents::quote(child.target.text), hint(child.target.text, all)));
    } else if (member->second->scope.model != collection.scope.model) {
      findings_.warning(
          child.place,
          fmt::format("{} inherits the {} {}, which {} declares: Franca takes its deployment "
                      "there alone; write it there",
                      documents::quote(collection.scope.name), child.tag, documents::quote(child.target.text),
                      documents::quote(member->second->scope.name)));
    }
  }
}

/// Who offers an interface may do so under the id of one that it extends.
void Maker::check_heirs() {
  std::map<std::string, const Service*> by_name;
  for (const Service& service : model_.services) {
    by_name.emplace(full_name(service.scope, service.name), &service);
  }
  for (const Service& service : model_.services) {
    auto base = by_name.find(service.base);
    for (std::size_t steps = 0; base != by_name.end() && steps < max_type_nesting; ++steps) {
      const Service& other = *base->second;
      if (service.id && service.id == other.id && service.major == other.major) {
        findings_.warning(place_of_id(service.id_place, service.place),
                          fmt::format("{} has the service id 0x{:04x} of {}, which it extends, at {}",
                                      documents::quote(service.name), someip::value(*service.id),
                                      documents::quote(other.name),
                                      to_string(model_, place_of_id(other.id_place, other.place))));
        break;
      }
      base = by_name.find(other.base);
    }
  }
}

}  // namespace

void make_services(Model& model, Names& names, Types& types, Problems& findings) {
  Maker maker{model, names, types, findings};
  for (const Collection& collection : names.collections()) {
    if (collection.scope.in->is_interface) {
      maker.service(collection);
    }
  }
  for (const Node* node : names.instances()) {
    maker.instance(*node);
  }
  maker.check_heirs();
}

}  // namespace trestle::describe::fidl
