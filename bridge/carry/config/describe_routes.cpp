#include "bridge/carry/config/describe_routes.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "bridge/carry/config/load.hpp"
#include "bridge/describe/marks.hpp"
#include "bridge/describe/raise.hpp"
#include "bridge/describe/ros_names.hpp"
#include "bridge/describe/sources/sources.hpp"
#include "bridge/documents/document.hpp"
#include "bridge/documents/problems.hpp"

namespace trestle::carry {
namespace {

namespace fs = std::filesystem;
using describe::Service;

/// "moved" of "/car/door/moved".
std::string last_part(const std::string& name) {
  return name.substr(name.rfind('/') + 1);
}

/// "/car/door/moved" of "/car/door/instance_2/moved", if that is the instance: `generate` puts it there where
/// a service has several.
std::string without_instance(std::string name, someip::InstanceId instance) {
  const std::string part = fmt::format("/instance_{}/", someip::value(instance));
  if (const std::size_t at = name.find(part); at != std::string::npos) {
    name.erase(at, part.size() - 1);
  }
  return name;
}

/// "Door" of "/car/door/moved"; of "/points" it is "PointsService".
std::string service_part(const std::string& name) {
  const std::size_t end = name.rfind('/');
  const std::string before = end == std::string::npos ? std::string{} : name.substr(0, end);
  return before.empty() ? describe::ros_type_name(last_part(name)) + "Service"
                        : describe::ros_type_name(last_part(before));
}

/// The parts of an action belong to the service of its own name.
std::string name_beside_action(const std::string& name) {
  const std::size_t at = name.find("/_action/");
  return at == std::string::npos ? name : name.substr(0, at) + "/" + last_part(name);
}

/// Undefined where there is none.
YAML::Node child(const YAML::Node& node, const char* key) {
  const YAML::Node found =
      node.IsDefined() && node.IsMap() ? node[key] : YAML::Node{YAML::NodeType::Undefined};
  return found.IsDefined() ? found : YAML::Node{YAML::NodeType::Undefined};
}
/// The text of a scalar, else empty.
std::string text_of(const YAML::Node& node) {
  return node.IsDefined() && node.IsScalar() ? node.Scalar() : std::string{};
}

/// The keys of a mapping, in the one list that Protection has.
void put_protection(const YAML::Node& node, describe::Protection& protection) {
  for (const auto& pair : node) {
    const std::string key = pair.first.Scalar();
    std::string value = text_of(pair.second);
    if (pair.second.IsMap()) {
      put_protection(pair.second, protection);  // state_machine
      continue;
    }
    if (pair.second.IsSequence()) {  // data_id_list
      for (const YAML::Node& one : pair.second) {
        value += (value.empty() ? "" : " ") + text_of(one);
      }
      protection.words.emplace(key, value);
      continue;
    }
    char* end = nullptr;
    const std::uint64_t number = std::strtoull(value.c_str(), &end, 0);
    if (key == "profile") {
      protection.profile = value;
    } else if (!value.empty() && *end == '\0') {
      protection.numbers.emplace(key, number);
    } else if (!value.empty()) {
      protection.words.emplace(key, value);
    }
  }
}

/// "e2e" of a route as it stands in the file: the same keys as Protection.
describe::Protection protection_of(const YAML::Node& node) {
  describe::Protection protection;
  if (node.IsDefined() && node.IsMap()) {
    put_protection(node, protection);
  }
  return protection;
}

class RouteFile {
 public:
  RouteFile(const BridgeConfig& config, const std::set<someip::ServiceId>& described, const YAML::Node& root)
      : config_{config}, library_{messages::TypeLibrary::in(config.types)}, described_{described} {
    for (const char* list : {"routes", "methods", "fields", "actions"}) {
      const YAML::Node elements = child(root, list);
      if (elements.IsDefined() && elements.IsSequence()) {
        for (const YAML::Node& element : elements) {
          elements_[{element.Mark().line + 1, element.Mark().column + 1}] = element;
        }
      }
    }
  }

  describe::Reading read() {
    reading_.model.files = {config_.file};
    for (const Route& route : config_.routes) {
      event(route);
    }
    for (const MethodRoute& route : config_.methods) {
      method(route);
    }
    for (const TopicPattern& pattern : config_.patterns) {
      lost(pattern.mark,
           fmt::format("topics: {}: only topics that the lock file has are described", pattern.topics));
    }
    for (auto& [key, field] : fields_) {
      Service& service = services_[std::get<0>(key)];
      unwrap(service, field.name, "", field.payload);
      service.fields.push_back(std::move(field));
    }
    const describe::Machine machine = machine_of();
    for (auto& [key, instance] : instances_) {
      const Service& of = services_[instance_services_[key]];
      instance.service = describe::full_name(of.scope, of.name);
      reading_.model.instances.push_back(std::move(instance));
    }
    if (machine.sd_multicast || machine.sd_port) {
      reading_.model.machines.push_back(machine);
    }
    for (Service& service : services_) {
      std::ranges::sort(service.eventgroups, {}, &describe::Eventgroup::id);
      reading_.model.services.push_back(std::move(service));
    }
    return std::move(reading_);
  }

 private:
  /// Where a value of a route stands, if it is there.
  static describe::Place place_of(const YAML::Node& element, const char* key) {
    return place_of(child(element, key)).value_or(describe::Place{});
  }
  static std::optional<describe::Place> place_of(const YAML::Node& node) {
    return node.IsDefined() ? std::optional{describe::Place{0, documents::to_mark(node.Mark())}}
                            : std::nullopt;
  }

  /// The service of a route, made when it is the first one of it.
  std::size_t service_of(someip::ServiceId id, std::uint8_t major, std::uint32_t minor, bool is_offered,
                         const std::string& name, documents::Mark mark) {
    const auto [at, is_new] = by_id_.try_emplace({id, major}, services_.size());
    if (is_new) {
      Service service;
      service.name = describe::first_free(service_part(name), "", [&](const std::string& one) {
        return std::ranges::find(services_, one, &Service::name) != services_.end();
      });
      service.id = id;
      service.major = major;
      service.minor = minor == sd::any_minor ? 0 : minor;
      service.has_version = true;
      service.place = {0, mark};
      service.id_place = place_of(element_at(mark), "service");
      services_.push_back(std::move(service));
    }
    services_[at->second].from_ros = services_[at->second].from_ros || is_offered;
    return at->second;
  }

  describe::Instance& instance_of(std::size_t service, someip::InstanceId id, bool is_offered,
                                  documents::Mark mark) {
    const auto [at, is_new] = instances_.try_emplace({services_[service].id, services_[service].major, id});
    if (is_new) {
      instance_services_[at->first] = service;
      describe::Instance& instance = at->second;
      instance.service_id = services_[service].id;
      instance.id = id;
      instance.major = services_[service].major;
      instance.place = {0, mark};
      if (is_offered) {
        instance.address = config_.someip.address;
      }
    }
    return at->second;
  }

  void event(const Route& route) {
    if (described_.contains(route.service)) {
      return;
    }
    const bool is_offered = route.direction == Direction::dds_to_someip;
    const std::size_t at =
        service_of(route.service, route.major, route.minor, is_offered,
                   name_beside_action(without_instance(route.topic, route.instance)), route.mark);
    Service& service = services_[at];
    describe::Instance& instance = instance_of(at, route.instance, is_offered, route.mark);
    if (is_offered && route.port != 0) {
      (route.transport == Transport::tcp ? instance.tcp_port : instance.udp_port) = route.port;
    }
    if (route.multicast && std::ranges::find(instance.multicast, route.eventgroup,
                                             &describe::Multicast::eventgroup) == instance.multicast.end()) {
      instance.multicast.push_back({.eventgroup = route.eventgroup,
                                    .group = route.multicast->group,
                                    .threshold = static_cast<std::uint32_t>(route.multicast->threshold),
                                    .group_at = describe::Place{0, route.mark}});
    }
    if (std::ranges::find(service.eventgroups, route.eventgroup, &describe::Eventgroup::id) ==
        service.eventgroups.end()) {
      service.eventgroups.push_back(
          {.name = fmt::format("eventgroup_{:04x}", someip::value(route.eventgroup)),
           .id = route.eventgroup});
    }
    const auto tree = library_.resolve(route.mapping ? route.mapping->payload.text : route.type);
    if (!tree) {
      error(route.mark, to_string(tree.error()));
      return;
    }
    const YAML::Node element = element_at(route.mark);
    if (is_field(element)) {
      describe::Field& field = field_of(at, route.mark, without_instance(route.topic, route.instance));
      const describe::Protection e2e = protection_of(child(child(element, "e2e"), "event"));
      const describe::Protection getter_e2e = protection_of(child(child(element, "e2e"), "getter"));
      if (field.has_notifier) {  // of another instance
        field.e2e.set(route.instance, e2e);
        if (route.getter && field.has_getter) {
          field.getter_e2e.set(route.instance, getter_e2e);
        }
        return;
      }
      field.payload = payload(*tree, route.rules, route.mark);
      field.has_notifier = true;
      field.notifier = route.event;
      field.notifier_place = place_of(element, "event");
      field.eventgroups = {route.eventgroup};
      field.notifier_transfer = transfer(route.transport, route.tp, element);
      field.e2e = e2e;
      if (route.getter && !field.has_getter) {
        field.has_getter = true;
        field.getter = route.getter->id;
        field.getter_place = place_of(element, "getter");
        field.getter_transfer.transport = route.transport;
        field.getter_e2e = getter_e2e;
      }
      return;
    }
    const std::string topic = without_instance(route.topic, route.instance);
    if (const auto same = std::ranges::find(service.events, std::optional{route.event}, &describe::Event::id);
        same != service.events.end()) {  // of another instance
      same->e2e.set(route.instance, protection_of(e2e_at(element, topic)));
      return;
    }
    describe::Event event{.name = free_name(service, last_part(topic)),
                          .id = route.event,
                          .payload = payload(*tree, route.rules, route.mark),
                          .eventgroups = {route.eventgroup},
                          .transfer = transfer(route.transport, route.tp, element)};
    event.e2e = protection_of(e2e_at(element, topic));
    unwrap(service, event.name, "", event.payload);
    event.ros_name = topic;
    event.place = {0, route.mark};
    event.id_place = place_of(element, "event");
    service.events.push_back(std::move(event));
  }

  void method(const MethodRoute& route) {
    if (described_.contains(route.service)) {
      return;
    }
    const bool is_offered = route.server == Server::ros;
    const YAML::Node element = element_at(route.mark);
    const std::string ros_service = without_instance(route.ros_service, route.instance);
    const std::size_t at =
        service_of(route.service, route.major, route.minor, is_offered,
                   is_field(element) ? without_instance(text_of(child(element, "topic")), route.instance)
                                     : name_beside_action(ros_service),
                   route.mark);
    Service& service = services_[at];
    describe::Instance& instance = instance_of(at, route.instance, is_offered, route.mark);
    const Transport transport = route.transport.value_or(Transport::udp);
    if (is_offered && route.port != 0) {
      (transport == Transport::tcp ? instance.tcp_port : instance.udp_port) = route.port;
    }
    if (route.access != messages::FieldAccess::none) {
      const auto tree = library_.resolve(route.value_type);
      if (!tree) {
        error(route.mark, to_string(tree.error()));
        return;
      }
      describe::Field& field = field_of(at, route.mark, ros_service);
      const bool is_getter = route.access == messages::FieldAccess::get;
      const describe::Protection e2e =
          protection_of(child(child(element, "e2e"), is_getter ? "getter" : "setter"));
      if (is_getter ? field.has_getter : field.has_setter) {  // of another instance
        (is_getter ? field.getter_e2e : field.setter_e2e).set(route.instance, e2e);
        return;
      }
      if (field.payload.values.empty()) {
        field.payload = payload(*tree, route.rules, route.mark);
      }
      (is_getter ? field.has_getter : field.has_setter) = true;
      (is_getter ? field.getter : field.setter) = route.method;
      (is_getter ? field.getter_place : field.setter_place) =
          place_of(element, is_getter ? "getter" : "setter");
      (is_getter ? field.getter_transfer : field.setter_transfer) = transfer(transport, route.tp, element);
      (is_getter ? field.getter_e2e : field.setter_e2e) = e2e;
      return;
    }
    if (const auto same =
            std::ranges::find(service.methods, std::optional{route.method}, &describe::Method::id);
        same != service.methods.end()) {  // of another instance
      same->e2e.set(route.instance, protection_of(e2e_at(element, ros_service)));
      return;
    }
    const auto types = library_.resolve_service(route.type);
    if (!types) {
      error(route.mark, to_string(types.error()));
      return;
    }
    std::vector<std::string> without;
    describe::Method method =
        raise(types_, *types, route.rules, free_name(service, last_part(ros_service)), without);
    tell(without, route.mark);
    method.id = route.method;
    method.fire_and_forget = route.fire_and_forget;
    method.timeout = std::chrono::duration_cast<std::chrono::milliseconds>(route.timeout);
    if (route.timeout == MethodRoute{}.timeout) {
      method.timeout.reset();
    }
    // One setting for both ways.
    method.request_transfer = transfer(transport, route.tp, element);
    method.response_transfer =
        method.fire_and_forget ? describe::Transfer{.transport = transport} : method.request_transfer;
    method.e2e = protection_of(e2e_at(element, ros_service));
    unwrap(service, method.name, "_Request", method.request);
    unwrap(service, method.name, "_Response", method.response);
    take_error(types->response.root(), method);
    method.ros_name = ros_service;
    method.place = {0, route.mark};
    method.id_place = place_of(element, "method");
    service.methods.push_back(std::move(method));
  }

  /// Parts of one field have one place. A field that has an id of another one is that of another instance.
  describe::Field& field_of(std::size_t service, documents::Mark mark, const std::string& name) {
    const FieldKey key{service, mark.line, mark.column};
    if (const auto same = same_fields_.find(key); same != same_fields_.end()) {
      return fields_[same->second];
    }
    const YAML::Node element = element_at(mark);
    FieldKey first = key;
    std::vector<FieldId> ids;
    for (const char* part : {"event", "getter", "setter"}) {
      const std::string text = text_of(child(element, part));
      if (!text.empty()) {
        ids.emplace_back(service, part, std::strtoul(text.c_str(), nullptr, 0));
        if (const auto known = field_ids_.find(ids.back()); known != field_ids_.end() && first == key) {
          first = known->second;
        }
      }
    }
    for (const FieldId& id : ids) {
      field_ids_.try_emplace(id, first);
    }
    same_fields_[key] = first;
    describe::Field& field = fields_[first];
    if (first == key) {
      const std::string of_field = text_of(child(element, "topic"));
      const std::string topic = of_field.empty() ? name : without_instance(of_field, instance_at(element));
      field.name = free_name(services_[service], last_part(topic));
      field.ros_name = topic;
      field.has_getter = field.has_setter = field.has_notifier = false;
      field.place = {0, mark};
    }
    return field;
  }
  static someip::InstanceId instance_at(const YAML::Node& element) {
    return someip::InstanceId{
        static_cast<std::uint16_t>(std::strtoul(text_of(child(element, "instance")).c_str(), nullptr, 0))};
  }

  /// What `generate --to msg` made of several values, or of one that is no message, is these values again: a
  /// message that is named after the service and the member. Its package is that of the service.
  void unwrap(Service& service, const std::string& member, const char* end, describe::Payload& payload) {
    if (payload.values.size() != 1) {
      return;
    }
    const describe::Value& value = payload.values.front();
    const describe::Type& type = reading_.model.at(value.type);
    const std::string of_service = describe::ros_type_name(service.name);
    // "CarAny" of "any_value", which was "any": a topic cannot have that name.
    const bool is_made =
        type.name == of_service + describe::ros_type_name(member) + end ||
        (type.name.starts_with(of_service) && type.name.ends_with(end) &&
         type.name.size() > of_service.size() + std::string_view{end}.size() &&
         describe::ros_field_name(type.name.substr(
             of_service.size(), type.name.size() - of_service.size() - std::string_view{end}.size())) ==
             member);
    const bool is_of_action = type.ros_name.find("/action/") != std::string::npos;
    if (type.kind == describe::Kind::structure && is_made && !is_of_action &&
        value.wire.length == someip::FieldWidth::none &&
        (service.scope.empty() || service.scope == type.scope)) {
      service.scope = type.scope;
      payload.values = std::vector<describe::Value>{type.members};
    }
  }

  /// A first value of the answer that is marked as the error of the method is that.
  void take_error(const messages::MessageDefinition& response, describe::Method& method) {
    std::vector<describe::Value>& values = method.response.values;
    if (values.empty() || response.fields.empty() || values.front().name != response.fields.front().name) {
      return;
    }
    const std::string_view mark = describe::marks::parse(response.fields.front().mark).what;
    if (mark.substr(0, mark.find(' ')) == describe::marks::error) {
      method.error = behind_aliases(types_.model(), values.front().type);
      values.erase(values.begin());
    }
  }

  describe::Payload payload(const messages::TypeTree& tree, const messages::MessageRules& rules,
                            documents::Mark mark) {
    std::vector<std::string> without;
    describe::Payload payload = raise(types_, tree, rules, "data", without);
    tell(without, mark);
    return payload;
  }

  /// Of the settings only what stands in the file.
  static describe::Transfer transfer(Transport transport, const TpSettings& tp, const YAML::Node& element) {
    describe::Transfer transfer{.transport = transport};
    transfer.transport_at = place_of(child(element, "transport"));
    const YAML::Node written = child(element, "tp");
    if (const YAML::Node bytes = child(written, "segment_bytes"); bytes.IsDefined()) {
      transfer.segment_bytes = static_cast<std::uint32_t>(tp.segment_bytes);
      transfer.segment_bytes_at = place_of(bytes);
    }
    if (child(written, "separation").IsDefined()) {
      transfer.separation = std::chrono::duration_cast<std::chrono::microseconds>(tp.separation);
    }
    return transfer;
  }

  [[nodiscard]] describe::Machine machine_of() const {
    describe::Machine machine{.name = "bridge", .address = config_.someip.address};
    const sd::NodeConfig usual{};
    if (config_.someip.multicast != usual.multicast) {
      machine.sd_multicast = config_.someip.multicast;
    }
    if (config_.someip.port != usual.port) {
      machine.sd_port = config_.someip.port;
    }
    return machine;
  }

  std::string free_name(const Service& service, const std::string& wanted) {
    auto& taken = names_[*service.id];
    std::string name =
        describe::first_free(wanted, "_", [&](const std::string& one) { return taken.contains(one); });
    taken.insert(name);
    return name;
  }

  [[nodiscard]] YAML::Node element_at(documents::Mark mark) const {
    const auto found = elements_.find({mark.line, mark.column});
    return found == elements_.end() ? YAML::Node{} : found->second;
  }
  /// Of a route or method, or of a part of an action.
  static YAML::Node e2e_at(const YAML::Node& element, const std::string& name) {
    const YAML::Node e2e = child(element, "e2e");
    return child(element, "action").IsDefined() ? child(e2e, last_part(name).c_str()) : e2e;
  }
  static bool is_field(const YAML::Node& element) {
    const auto has = [&](const char* key) { return child(element, key).IsDefined(); };
    return has("getter") || has("setter") || (has("event") && has("server"));
  }

  void tell(const std::vector<std::string>& without, documents::Mark mark) {
    for (const std::string& one : without) {
      lost(mark, one);
    }
  }
  void lost(documents::Mark mark, const std::string& what) {
    reading_.problems.push_back({.severity = documents::Problem::Severity::warning,
                                 .file = config_.file,
                                 .mark = mark,
                                 .text = "not described: " + what});
  }
  void error(documents::Mark mark, std::string text) {
    reading_.problems.push_back({.file = config_.file, .mark = mark, .text = std::move(text)});
  }

  using FieldKey = std::tuple<std::size_t, int, int>;                   ///< its service and its place
  using FieldId = std::tuple<std::size_t, std::string, std::uint64_t>;  ///< its service, which part, its id
  using InstanceKey = std::tuple<std::optional<someip::ServiceId>, std::uint8_t, someip::InstanceId>;

  const BridgeConfig& config_;
  messages::TypeLibrary library_;
  const std::set<someip::ServiceId>& described_;
  describe::Reading reading_;
  describe::RaisedTypes types_{reading_.model};
  std::vector<Service> services_;
  std::map<std::pair<someip::ServiceId, std::uint8_t>, std::size_t> by_id_;
  std::map<InstanceKey, describe::Instance> instances_;
  std::map<InstanceKey, std::size_t> instance_services_;
  std::map<FieldKey, describe::Field> fields_;
  std::map<FieldKey, FieldKey> same_fields_;  ///< of each, the first that has one of its ids
  std::map<FieldId, FieldKey> field_ids_;
  std::map<std::pair<int, int>, YAML::Node> elements_;  ///< by their places
  std::map<someip::ServiceId, std::set<std::string>> names_;
};

/// The paths of a list, or of a single one, seen from where the working directory is.
std::vector<std::string> paths_of(const YAML::Node& list, const std::string& file) {
  std::vector<std::string> paths;
  const auto add = [&](const YAML::Node& one) {
    if (one.IsScalar()) {
      paths.push_back((fs::path{file}.parent_path() / one.Scalar()).lexically_normal().string());
    }
  };
  if (list.IsDefined() && list.IsSequence()) {
    std::ranges::for_each(list, add);
  } else if (list.IsDefined()) {
    add(list);
  }
  return paths;
}

/// The interfaces that the file names, from its folder.
describe::Reading interfaces_of(const YAML::Node& root, const BridgeConfig& config) {
  const std::vector<std::string> paths = paths_of(child(root, "interfaces"), config.file);
  if (paths.empty()) {
    return {};
  }
  std::vector<documents::Problem> problems;
  const auto texts = describe::load_sources(paths, problems);
  describe::Reading reading =
      describe::read_sources(texts, describe::file_loader(), {.type_folders = config.types.folders});
  reading.problems.insert(reading.problems.begin(), problems.begin(), problems.end());
  return reading;
}

/// Gives services of interfaces, and their members, the ids that routes have for them, where the interfaces
/// say none: `generate` has chosen those. Otherwise each such service would be there twice.
class ChosenIds {
 public:
  explicit ChosenIds(describe::Model& model) : model_{model} {
    for (Service& service : model_.services) {
      if (!service.id) {
        candidates_[describe::ros_type_name(service.name)].push_back({&service});
      }
    }
    // Those that were made of ROS types have members whose topics are fixed: "/go/_action/feedback".
    for (auto& [name, candidates] : candidates_) {
      for (Candidate& one : candidates) {
        const auto add = [&](const auto& members) {
          for (const auto& member : members) {
            if (!member.ros_name.empty()) {
              by_ros_name_[member.ros_name].insert(&one);
            }
          }
        };
        add(one.service->events);
        add(one.service->fields);
        add(one.service->methods);
      }
    }
  }

  void take(const BridgeConfig& config) {
    if (candidates_.empty()) {
      return;
    }
    for (const Route& route : config.routes) {
      const std::string topic = without_instance(route.topic, route.instance);
      Candidate* const of = candidate(topic, route.service, route.instance);
      if (of == nullptr) {
        continue;
      }
      if (describe::Event* const event = find(of->events, topic)) {
        set(event->id, route.event);
        join(*of->service, event->eventgroups, route.eventgroup);
      } else if (describe::Field* const field = find(of->fields, topic)) {
        set(field->notifier, route.event);
        join(*of->service, field->eventgroups, route.eventgroup);
        if (route.getter) {
          set(field->getter, route.getter->id);
        }
      }
    }
    for (const MethodRoute& route : config.methods) {
      std::string name = without_instance(route.ros_service, route.instance);
      const bool is_field = route.access != messages::FieldAccess::none;
      if (is_field) {
        name = name.substr(0, name.rfind('/'));  // without /get or /set
      }
      Candidate* const of = candidate(name, route.service, route.instance);
      if (of == nullptr) {
        continue;
      }
      if (describe::Field* const field = is_field ? find(of->fields, name) : nullptr) {
        set(route.access == messages::FieldAccess::get ? field->getter : field->setter, route.method);
      } else if (describe::Method* const method = is_field ? nullptr : find(of->methods, name)) {
        set(method->id, route.method);
      }
    }
  }

 private:
  /// A service, and its members by the names of their topics and ROS services.
  struct Candidate {
    Service* service = nullptr;
    std::map<std::string, describe::Event*> events{};
    std::map<std::string, describe::Field*> fields{};
    std::map<std::string, describe::Method*> methods{};
  };

  template <typename Element>
  static Element* find(const std::map<std::string, Element*>& elements, const std::string& name) {
    const auto found = elements.find(last_part(name));
    return found == elements.end() ? nullptr : found->second;
  }
  static void set(std::optional<someip::MethodId>& id, someip::MethodId value) { id = id.value_or(value); }
  static void join(Service& service, std::vector<someip::EventgroupId>& groups, someip::EventgroupId group) {
    if (!groups.empty()) {
      return;
    }
    groups = {group};
    if (std::ranges::find(service.eventgroups, group, &describe::Eventgroup::id) ==
        service.eventgroups.end()) {
      service.eventgroups.push_back({.id = group});
      std::ranges::sort(service.eventgroups, {}, &describe::Eventgroup::id);
    }
  }

  /// The service that a topic or ROS service is of; null: none of those without an id, or several. Its id is
  /// that of the route then.
  Candidate* candidate(const std::string& name, someip::ServiceId id, someip::InstanceId instance) {
    if (const auto known = known_.find(id); known != known_.end()) {
      return known->second;
    }
    Candidate* found = nullptr;
    bool has_scope = false;
    std::size_t count = 0;
    if (const auto fixed = by_ros_name_.find(name); fixed != by_ros_name_.end()) {
      for (Candidate* const one : fixed->second) {
        if (!one->service->id) {
          found = one;
          ++count;
        }
      }
    }
    for (Candidate& one : candidates_[count == 0 ? service_part(name) : std::string{}]) {
      // Where several have one name, that of the topic begins with the scope.
      const std::string with_scope = "/" + describe::ros_field_name(one.service->scope) + "/" +
                                     describe::ros_field_name(one.service->name) + "/";
      const bool is_in_scope = name.find(with_scope) != std::string::npos;
      if (!one.service->id && (is_in_scope || !has_scope)) {
        count = is_in_scope == has_scope ? count + 1 : 1;
        has_scope = is_in_scope;
        found = &one;
      }
    }
    found = count == 1 ? found : nullptr;
    known_.emplace(id, found);
    if (found != nullptr) {
      take_over(*found, id, instance);
    }
    return found;
  }

  void take_over(Candidate& one, someip::ServiceId id, someip::InstanceId instance) {
    Service& service = *one.service;
    service.id = id;
    const std::string full = describe::full_name(service.scope, service.name);
    if (std::ranges::find(model_.instances, full, &describe::Instance::service) == model_.instances.end()) {
      model_.instances.push_back(
          {.service = full, .service_id = id, .id = instance, .place = {service.place.file, {}}});
    }
    // In this order they have got their names.
    describe::FreeNames topics;
    describe::FreeNames calls;
    for (describe::Event& event : service.events) {
      one.events.emplace(topics.take(describe::ros_field_name(event.name), "_"), &event);
    }
    for (describe::Field& field : service.fields) {
      one.fields.emplace(topics.take(describe::ros_field_name(field.name), "_"), &field);
    }
    for (describe::Method& method : service.methods) {
      one.methods.emplace(calls.take(describe::ros_field_name(method.name), "_"), &method);
    }
  }

  describe::Model& model_;
  std::map<std::string, std::vector<Candidate>, std::less<>> candidates_{};  ///< by what topics call them
  std::map<std::string, std::set<Candidate*>> by_ros_name_{};                ///< of members
  std::map<someip::ServiceId, Candidate*> known_{};
};

}  // namespace

describe::Reading describe_routes(const std::string& file) {
  auto loaded = load_config(file);
  if (!loaded) {
    describe::Reading reading;
    reading.problems = std::move(loaded.error());
    return reading;
  }
  YAML::Node root;
  if (const auto text = documents::read_text_file(file)) {
    root = YAML::Load(*text);  // it is good: it was loaded before
  }
  describe::Reading reading = interfaces_of(root, loaded->config);
  if (!reading.ok()) {
    return reading;
  }
  ChosenIds{reading.model}.take(loaded->config);
  std::set<someip::ServiceId> described;
  for (const Service& service : reading.model.services) {
    if (service.id) {
      described.insert(*service.id);
    }
  }
  describe::Reading routes = RouteFile{loaded->config, described, root}.read();
  append(reading.model, std::move(routes.model));
  reading.problems.insert(reading.problems.end(), routes.problems.begin(), routes.problems.end());
  return reading;
}

describe::TypeOrigins types_of_routes(const std::string& file) {
  const auto text = documents::read_text_file(file);
  documents::Problems problems{file};
  const YAML::Node root = text ? documents::parse_document(*text, "a route file", problems) : YAML::Node{};
  return {.folders = paths_of(child(child(root, "types"), "paths"), file),
          .interfaces = paths_of(child(root, "interfaces"), file)};
}

}  // namespace trestle::carry
