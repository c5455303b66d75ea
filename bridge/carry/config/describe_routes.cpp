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

namespace trestle::carry {
namespace {

namespace fs = std::filesystem;
using describe::Service;

/// "moved" of "/car/door/moved".
std::string last_part(const std::string& name) {
  return name.substr(name.rfind('/') + 1);
}

/// "Door" of "/car/door/moved"; of "/points" it is "PointsService".
std::string service_part(const std::string& name) {
  const std::size_t end = name.rfind('/');
  const std::string before = end == std::string::npos ? std::string{} : name.substr(0, end);
  return before.empty() ? describe::ros_type_name(last_part(name)) + "Service"
                        : describe::ros_type_name(last_part(before));
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

/// "e2e" of a route as it stands in the file: the same keys as Protection.
describe::Protection protection_of(const YAML::Node& node) {
  describe::Protection protection;
  if (!node.IsDefined() || !node.IsMap()) {
    return protection;
  }
  for (const auto& pair : node) {
    const std::string key = pair.first.Scalar();
    const std::string value = text_of(pair.second);
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
      service.minor = minor == any_minor ? 0 : minor;
      service.has_version = true;
      service.place = {0, mark};
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
    const std::size_t at = service_of(route.service, route.major, route.minor, is_offered,
                                      name_beside_action(route.topic), route.mark);
    Service& service = services_[at];
    describe::Instance& instance = instance_of(at, route.instance, is_offered, route.mark);
    if (is_offered && route.port != 0) {
      (route.transport == Transport::tcp ? instance.tcp_port : instance.udp_port) = route.port;
    }
    if (route.multicast && std::ranges::find(instance.multicast, route.eventgroup,
                                             &describe::Multicast::eventgroup) == instance.multicast.end()) {
      instance.multicast.push_back({.eventgroup = route.eventgroup,
                                    .group = route.multicast->group,
                                    .threshold = static_cast<std::uint32_t>(route.multicast->threshold)});
    }
    if (std::ranges::find(service.eventgroups, route.eventgroup, &describe::Eventgroup::id) ==
        service.eventgroups.end()) {
      service.eventgroups.push_back(
          {.name = fmt::format("eventgroup_{:04x}", someip::value(route.eventgroup)),
           .id = route.eventgroup});
    }
    const auto tree = library_.resolve(route.type);
    if (!tree) {
      error(route.mark, to_string(tree.error()));
      return;
    }
    const YAML::Node element = element_at(route.mark);
    if (is_field(element)) {
      describe::Field& field = field_of(at, route.mark, route.topic);
      if (field.notifier || field.payload.values.empty()) {
        field.payload = payload(*tree, route.rules, route.mark);
      }
      field.has_notifier = true;
      field.notifier = route.event;
      field.eventgroups = {route.eventgroup};
      field.notifier_transfer = transfer(route.transport, route.tp, element);
      field.e2e = protection_of(child(child(element, "e2e"), "event"));
      if (route.getter) {
        field.has_getter = true;
        field.getter = route.getter->id;
        field.getter_transfer.transport = route.transport;
        field.getter_e2e = protection_of(child(child(element, "e2e"), "getter"));
      }
      return;
    }
    if (const auto same = std::ranges::find(service.events, std::optional{route.event}, &describe::Event::id);
        same != service.events.end()) {
      return;  // of another instance
    }
    describe::Event event{.name = free_name(service, last_part(route.topic)),
                          .id = route.event,
                          .payload = payload(*tree, route.rules, route.mark),
                          .eventgroups = {route.eventgroup},
                          .transfer = transfer(route.transport, route.tp, element)};
    event.e2e = protection_of(child(element, "e2e"));
    unwrap(service, event.name, "", event.payload);
    event.ros_name = route.topic;
    event.place = {0, route.mark};
    service.events.push_back(std::move(event));
  }

  void method(const MethodRoute& route) {
    if (described_.contains(route.service)) {
      return;
    }
    const bool is_offered = route.server == Server::ros;
    const YAML::Node element = element_at(route.mark);
    const std::size_t at = service_of(
        route.service, route.major, route.minor, is_offered,
        is_field(element) ? text_of(child(element, "topic")) : name_beside_action(route.ros_service),
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
      describe::Field& field = field_of(at, route.mark, route.ros_service);
      if (field.payload.values.empty()) {
        field.payload = payload(*tree, route.rules, route.mark);
      }
      const bool is_getter = route.access == messages::FieldAccess::get;
      (is_getter ? field.has_getter : field.has_setter) = true;
      (is_getter ? field.getter : field.setter) = route.method;
      (is_getter ? field.getter_transfer : field.setter_transfer) = transfer(transport, route.tp, element);
      (is_getter ? field.getter_e2e : field.setter_e2e) =
          protection_of(child(child(element, "e2e"), is_getter ? "getter" : "setter"));
      return;
    }
    if (std::ranges::find(service.methods, std::optional{route.method}, &describe::Method::id) !=
        service.methods.end()) {
      return;  // of another instance
    }
    const auto types = library_.resolve_service(route.type);
    if (!types) {
      error(route.mark, to_string(types.error()));
      return;
    }
    std::vector<std::string> without;
    describe::Method method =
        raise(reading_.model, *types, route.rules, free_name(service, last_part(route.ros_service)), without);
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
    method.e2e = protection_of(child(element, "e2e"));
    unwrap(service, method.name, "_Request", method.request);
    unwrap(service, method.name, "_Response", method.response);
    take_error(types->response.root(), method);
    method.ros_name = route.ros_service;
    method.place = {0, route.mark};
    service.methods.push_back(std::move(method));
  }

  /// Parts of one field have one place.
  describe::Field& field_of(std::size_t service, documents::Mark mark, const std::string& name) {
    const auto [at, is_new] = fields_.try_emplace({service, mark.line, mark.column});
    describe::Field& field = at->second;
    if (is_new) {
      const YAML::Node element = element_at(mark);
      const std::string of_field = text_of(child(element, "topic"));
      const std::string topic = of_field.empty() ? name : of_field;
      field.name = free_name(services_[service], last_part(topic));
      field.ros_name = topic;
      field.has_getter = field.has_setter = field.has_notifier = false;
      field.place = {0, mark};
    }
    return field;
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
    if (type.kind == describe::Kind::structure && is_made && value.wire.length == someip::FieldWidth::none &&
        (service.scope.empty() || service.scope == type.scope)) {
      service.scope = type.scope;
      payload.values = std::vector<describe::Value>{type.members};
    }
  }

  /// A first value of the answer that is marked as the error of the method is that.
  static void take_error(const messages::MessageDefinition& response, describe::Method& method) {
    std::vector<describe::Value>& values = method.response.values;
    if (values.empty() || response.fields.empty() || values.front().name != response.fields.front().name) {
      return;
    }
    const std::string& mark = response.fields.front().mark;
    if (mark.substr(0, mark.find(' ')) == describe::marks::error) {
      method.error = values.front().type;
      values.erase(values.begin());
    }
  }

  describe::Payload payload(const messages::TypeTree& tree, const messages::MessageRules& rules,
                            documents::Mark mark) {
    std::vector<std::string> without;
    describe::Payload payload = raise(reading_.model, tree, rules, "data", without);
    tell(without, mark);
    return payload;
  }

  /// Of the settings only what stands in the file.
  static describe::Transfer transfer(Transport transport, const TpSettings& tp, const YAML::Node& element) {
    describe::Transfer transfer{.transport = transport};
    const YAML::Node written = child(element, "tp");
    if (child(written, "segment_bytes").IsDefined()) {
      transfer.segment_bytes = static_cast<std::uint32_t>(tp.segment_bytes);
    }
    if (child(written, "separation").IsDefined()) {
      transfer.separation = std::chrono::duration_cast<std::chrono::microseconds>(tp.separation);
    }
    return transfer;
  }

  [[nodiscard]] describe::Machine machine_of() const {
    describe::Machine machine{.name = "bridge", .address = config_.someip.address};
    const SdSettings usual;
    if (config_.someip.sd.multicast != usual.multicast) {
      machine.sd_multicast = config_.someip.sd.multicast;
    }
    if (config_.someip.sd.port != usual.port) {
      machine.sd_port = config_.someip.sd.port;
    }
    return machine;
  }

  /// The parts of an action belong to the service of its own name.
  static std::string name_beside_action(const std::string& name) {
    const std::size_t at = name.find("/_action/");
    return at == std::string::npos ? name : name.substr(0, at) + "/" + last_part(name);
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

  using InstanceKey = std::tuple<std::optional<someip::ServiceId>, std::uint8_t, someip::InstanceId>;

  const BridgeConfig& config_;
  messages::TypeLibrary library_;
  const std::set<someip::ServiceId>& described_;
  describe::Reading reading_;
  std::vector<Service> services_;
  std::map<std::pair<someip::ServiceId, std::uint8_t>, std::size_t> by_id_;
  std::map<InstanceKey, describe::Instance> instances_;
  std::map<InstanceKey, std::size_t> instance_services_;
  std::map<std::tuple<std::size_t, int, int>, describe::Field> fields_;
  std::map<std::pair<int, int>, YAML::Node> elements_;  ///< by their places
  std::map<someip::ServiceId, std::set<std::string>> names_;
};

/// The interfaces that the file names, from its folder.
describe::Reading interfaces_of(const YAML::Node& root, const std::string& file) {
  const YAML::Node list = child(root, "interfaces");
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
  if (paths.empty()) {
    return {};
  }
  std::vector<documents::Problem> problems;
  const auto texts = describe::load_sources(paths, problems);
  describe::Reading reading = describe::read_sources(texts, describe::file_loader());
  reading.problems.insert(reading.problems.begin(), problems.begin(), problems.end());
  return reading;
}

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
  describe::Reading reading = interfaces_of(root, file);
  if (!reading.ok()) {
    return reading;
  }
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

}  // namespace trestle::carry
