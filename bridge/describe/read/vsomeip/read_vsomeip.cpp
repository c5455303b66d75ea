#include "bridge/describe/read/vsomeip/read_vsomeip.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <set>
#include <utility>

#include "bridge/describe/read/vsomeip/json_tree.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::describe {
namespace {

using documents::Mark;
using namespace std::chrono_literals;

constexpr std::size_t max_problems = 100;
/// What vsomeip does when its configuration says nothing.
constexpr sd::Timing vsomeip_timing{.initial_delay_min = 0ms,
                                    .initial_delay_max = 3000ms,
                                    .repetitions_base_delay = 10ms,
                                    .repetitions_max = 3,
                                    .cyclic_offer_delay = 1000ms,
                                    .request_response_delay_min = 0ms,
                                    .request_response_delay_max = 2000ms,
                                    .ttl_s = 0xff'ffff};
constexpr std::uint32_t vsomeip_segment_bytes = 1392;
constexpr std::uint16_t first_event_id = 0x8000;

std::optional<std::uint64_t> whole(std::string_view text) {
  const bool is_hex = text.starts_with("0x") || text.starts_with("0X");
  const std::string_view digits = text.substr(is_hex ? 2 : 0);
  std::uint64_t number = 0;
  const auto [end, error] =
      std::from_chars(digits.data(), digits.data() + digits.size(), number, is_hex ? 16 : 10);
  if (error != std::errc{} || end != digits.data() + digits.size()) {
    return std::nullopt;
  }
  return number;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t");
  return begin == std::string_view::npos ? std::string_view{}
                                         : text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

/// Gathers what has to be known of all files before instances are complete.
struct Settings {
  std::optional<IpAddress> address{};
  std::optional<IpAddress> sd_multicast{};
  std::optional<std::uint16_t> sd_port{};
  bool sd = true;
  sd::Timing timing = vsomeip_timing;
  Transfer requests{};  ///< "npdu-default-timings"
  Transfer responses{};
};

class VsomeipReader {
 public:
  explicit VsomeipReader(Model& model) : model_{model} {}

  void read(const JsonNode& root, std::uint32_t file, documents::Problems& problems);
  /// After all files.
  void finish(std::string_view name);

 private:
  struct Protected {
    someip::ServiceId service{};
    someip::MethodId id{};
    Protection e2e;
    Place place;
  };

  // How values are written.
  [[nodiscard]] std::optional<std::uint64_t> number(const JsonNode* node, const std::string& what,
                                                    std::uint64_t min, std::uint64_t max);
  template <typename Id>
  [[nodiscard]] std::optional<Id> id(const JsonNode* node, const std::string& what) {
    const auto number = this->number(node, what, 1, 0xfffe);
    return number ? std::optional{static_cast<Id>(*number)} : std::nullopt;
  }
  [[nodiscard]] std::optional<std::uint16_t> port(const JsonNode* node, const std::string& what);
  [[nodiscard]] bool truth(const JsonNode* node, bool otherwise);
  [[nodiscard]] std::optional<IpAddress> address(const JsonNode* node, const std::string& what);
  [[nodiscard]] std::optional<std::chrono::milliseconds> milliseconds(const JsonNode* node,
                                                                      const std::string& what);
  /// Calls for each element of a list; a single one counts as a list of one, as in vsomeip.
  template <typename Each>
  void each(const JsonNode* node, const std::string& what, JsonNode::Kind kind, const Each& each);
  [[nodiscard]] const JsonNode* object(const JsonNode* node, const std::string& what);

  void error(const JsonNode& node, std::string text);
  void warning(const JsonNode& node, std::string text);
  [[nodiscard]] Place place(const JsonNode& node) const { return {file_, node.mark}; }

  // What the parts of a configuration mean.
  void discovery(const JsonNode& node);
  void npdu_defaults(const JsonNode& node);
  void services(const JsonNode* node);
  void service(const JsonNode& node);
  void event(const JsonNode& node, Service& service, const Instance& instance);
  void eventgroup(const JsonNode& node, const std::optional<Endpoint>& shared, std::size_t service,
                  Instance& instance);
  void multicast(const JsonNode& node, const std::optional<Endpoint>& shared, Multicast& group);
  void in_eventgroup(const JsonNode& node, someip::EventgroupId group, Service& service,
                     const Instance& instance);
  void tp(const JsonNode& node, Service& service, const Instance& instance);
  void tp_of(const JsonNode& node, bool is_request, Service& service, const Instance& instance);
  void debounce(const JsonNode& node, bool is_request, Service& service, const Instance& instance);
  void client(const JsonNode& node);
  void protection(const JsonNode& node);
  void profile(const JsonNode& node, std::string_view name, Protection& e2e);

  std::size_t service_of(someip::ServiceId id, const JsonNode& node);
  [[nodiscard]] Transfer& transfer_of(Service& service, someip::MethodId id, bool is_request,
                                      const Instance& instance, const JsonNode& node);
  Method& method_of(Service& service, someip::MethodId id, const Instance& instance, const JsonNode& node);
  Protection* e2e_of(Service& service, someip::MethodId id);

  using EventPart = std::pair<bool, std::size_t>;  ///< whether it is a field, and which
  using EventKey = std::pair<someip::ServiceId, someip::MethodId>;
  using InstanceKey = std::pair<someip::ServiceId, std::optional<someip::InstanceId>>;
  [[nodiscard]] bool has_event(const Service& service, someip::MethodId id) const {
    return events_.contains({*service.id, id});
  }
  Event& add_event(Service& service, Event event);

  Model& model_;
  // Where things are, because a hostile file can have hundreds of thousands of them.
  std::map<someip::ServiceId, std::size_t> services_;
  std::map<EventKey, EventPart> events_;
  std::map<EventKey, std::size_t> methods_;
  std::map<someip::EventgroupId, std::size_t> multicast_;  ///< of the instance that is being read
  std::set<InstanceKey> provided_;
  std::set<InstanceKey> required_;
  Settings settings_;
  std::vector<Protected> protected_;
  std::uint32_t file_ = 0;
  documents::Problems* problems_ = nullptr;
  std::size_t told_ = 0;
};

void VsomeipReader::error(const JsonNode& node, std::string text) {
  if (told_++ < max_problems) {
    problems_->error(node.mark, std::move(text));
  }
}
void VsomeipReader::warning(const JsonNode& node, std::string text) {
  if (told_++ < max_problems) {
    problems_->warning(node.mark, std::move(text));
  }
}

std::optional<std::uint64_t> VsomeipReader::number(const JsonNode* node, const std::string& what,
                                                   std::uint64_t min, std::uint64_t max) {
  if (node == nullptr) {
    return std::nullopt;
  }
  const auto number = node->is_scalar() ? whole(trimmed(node->text)) : std::nullopt;
  if (!number || *number < min || *number > max) {
    error(*node, fmt::format("expected {}, a whole number from {} to {} such as \"0x12\" or 18, not {}", what,
                             min, max, what_it_is(*node)));
    return std::nullopt;
  }
  return number;
}

/// vsomeip takes 0 for "none".
std::optional<std::uint16_t> VsomeipReader::port(const JsonNode* node, const std::string& what) {
  const auto number = this->number(node, what, 0, 0xffff);
  return number && *number != 0 && *number != 0xffff ? std::optional{static_cast<std::uint16_t>(*number)}
                                                     : std::nullopt;
}

bool VsomeipReader::truth(const JsonNode* node, bool otherwise) {
  if (node == nullptr) {
    return otherwise;
  }
  if (!node->is_scalar() || (node->text != "true" && node->text != "false")) {
    error(*node, "expected true or false, not " + what_it_is(*node));
    return otherwise;
  }
  return node->text == "true";
}

std::optional<IpAddress> VsomeipReader::address(const JsonNode* node, const std::string& what) {
  if (node == nullptr) {
    return std::nullopt;
  }
  if (node->kind == JsonNode::Kind::string) {
    if (const auto address = someip::parse_address(std::string{trimmed(node->text)})) {
      return address;
    }
    if (trimmed(node->text) == "localhost") {
      warning(*node, "vsomeip knows addresses alone: 127.0.0.1 is taken for 'localhost'");
      return IpAddress::v4(127, 0, 0, 1);
    }
    // A template that a script fills in: the rest of the file is worth reading.
    if (node->text.find('@') != std::string::npos || node->text.find('$') != std::string::npos) {
      warning(*node, what + " is still to be filled in: " + documents::quote(node->text));
      return std::nullopt;
    }
  }
  error(*node, "expected " + what + ", an address such as \"192.168.0.1\", not " + what_it_is(*node));
  return std::nullopt;
}

std::optional<std::chrono::milliseconds> VsomeipReader::milliseconds(const JsonNode* node,
                                                                     const std::string& what) {
  const auto number = this->number(node, what + " in milliseconds", 0, 3'600'000);
  return number ? std::optional{std::chrono::milliseconds{*number}} : std::nullopt;
}

const JsonNode* VsomeipReader::object(const JsonNode* node, const std::string& what) {
  if (node != nullptr && node->kind != JsonNode::Kind::object) {
    error(*node, "expected " + what + ", an object, not " + what_it_is(*node));
    return nullptr;
  }
  return node;
}

template <typename Each>
void VsomeipReader::each(const JsonNode* node, const std::string& what, JsonNode::Kind kind,
                         const Each& each) {
  if (node == nullptr) {
    return;
  }
  const auto one = [&](const JsonNode& element) {
    if (kind == JsonNode::Kind::object && element.kind != kind) {
      error(element, "expected " + what + ", an object, not " + what_it_is(element));
    } else {
      each(element);
    }
  };
  if (node->kind == JsonNode::Kind::array) {
    std::ranges::for_each(node->elements, one);
  } else if (!(node->is_scalar() && node->text.empty())) {  // "" is vsomeip's empty list
    one(*node);
  }
}

void VsomeipReader::read(const JsonNode& root, std::uint32_t file, documents::Problems& problems) {
  file_ = file;
  problems_ = &problems;
  told_ = 0;
  if (object(&root, "a vsomeip configuration") == nullptr) {
    return;
  }
  // Of what is said twice vsomeip takes the first.
  if (const auto own = address(root.find("unicast"), "the host's address"); own && !settings_.address) {
    settings_.address = own;
  }
  if (const JsonNode* node = object(root.find("service-discovery"), "settings of service discovery")) {
    discovery(*node);
  }
  if (const JsonNode* node = object(root.find("npdu-default-timings"), "times of nPDUs")) {
    npdu_defaults(*node);
  }
  services(root.find("services"));
  each(root.find("servicegroups"), "a group of services", JsonNode::Kind::object,
       [this](const JsonNode& group) { services(group.find("services")); });
  each(root.find("clients"), "a client", JsonNode::Kind::object,
       [this](const JsonNode& one) { client(one); });
  if (const JsonNode* e2e = object(root.find("e2e"), "settings of E2E")) {
    if (truth(e2e->find("e2e_enabled"), true)) {
      each(e2e->find("protected"), "what is protected", JsonNode::Kind::object,
           [this](const JsonNode& one) { protection(one); });
    }
  }
}

void VsomeipReader::discovery(const JsonNode& node) {
  settings_.sd = truth(node.find("enable"), true);
  if (const auto group = address(node.find("multicast"), "the group of service discovery")) {
    settings_.sd_multicast = group;
  }
  if (const auto port = this->port(node.find("port"), "the port of service discovery")) {
    settings_.sd_port = port;
  }
  sd::Timing& timing = settings_.timing;
  const auto time = [&](const char* key, Duration& to) {
    if (const auto value = milliseconds(node.find(key), key)) {
      to = *value;
    }
  };
  time("initial_delay_min", timing.initial_delay_min);
  time("initial_delay_max", timing.initial_delay_max);
  time("repetitions_base_delay", timing.repetitions_base_delay);
  time("cyclic_offer_delay", timing.cyclic_offer_delay);
  time("request_response_delay", timing.request_response_delay_max);
  if (const auto max = number(node.find("repetitions_max"), "repetitions_max", 0, 0xffff'ffff)) {
    timing.repetitions_max = static_cast<std::uint8_t>(std::min<std::uint64_t>(*max, 255));
  }
  if (const auto ttl = number(node.find("ttl"), "ttl", 0, 0xff'ffff)) {
    timing.ttl_s = *ttl == 0 ? vsomeip_timing.ttl_s : static_cast<std::uint32_t>(*ttl);
  }
}

void VsomeipReader::npdu_defaults(const JsonNode& node) {
  const auto time = [&](const char* key, std::chrono::microseconds& to) {
    if (const auto value = milliseconds(node.find(key), key)) {
      to = *value;
    }
  };
  time("debounce-time-request", settings_.requests.debounce);
  time("max-retention-time-request", settings_.requests.retention);
  time("debounce-time-response", settings_.responses.debounce);
  time("max-retention-time-response", settings_.responses.retention);
}

std::size_t VsomeipReader::service_of(someip::ServiceId id, const JsonNode& node) {
  const auto [found, is_new] = services_.emplace(id, model_.services.size());
  if (is_new) {
    model_.services.push_back(
        {.name = fmt::format("service_{:04x}", someip::value(id)), .id = id, .place = place(node)});
  }
  return found->second;
}

Event& VsomeipReader::add_event(Service& service, Event event) {
  events_[{*service.id, *event.id}] = {false, service.events.size()};
  return service.events.emplace_back(std::move(event));
}

void VsomeipReader::services(const JsonNode* node) {
  each(node, "a service", JsonNode::Kind::object, [this](const JsonNode& one) { service(one); });
}

void VsomeipReader::service(const JsonNode& node) {
  const JsonNode* service_node = node.find("service");
  const JsonNode* instance_node = node.find("instance");
  if (service_node == nullptr || instance_node == nullptr) {
    error(node, std::string{"expected a \""} + (service_node == nullptr ? "service" : "instance") +
                    "\" with its id");
    return;
  }
  const auto service_id = id<someip::ServiceId>(service_node, "a service id");
  const auto instance_id = id<someip::InstanceId>(instance_node, "an instance id");
  if (!service_id || !instance_id) {
    return;
  }
  if (const JsonNode* protocol = node.find("protocol"); protocol != nullptr && protocol->text != "someip") {
    warning(*protocol, "a service of another protocol than \"someip\" is left out");
    return;
  }
  if (!provided_.insert({*service_id, instance_id}).second) {
    warning(node, fmt::format("a second description of instance 0x{:04x} of service 0x{:04x} is left out, "
                              "as vsomeip does",
                              someip::value(*instance_id), someip::value(*service_id)));
    return;
  }
  const std::size_t at = service_of(*service_id, node);
  Instance instance{.name = fmt::format("instance_{:04x}", someip::value(*instance_id)),
                    .service = model_.services[at].name,
                    .service_id = service_id,
                    .id = instance_id,
                    .place = place(node)};
  if (const JsonNode* unicast = node.find("unicast"); unicast != nullptr && unicast->text != "local") {
    instance.address = address(unicast, "the address of the service");
    // A service of another host is told to those who use it without service discovery.
    if (instance.address && settings_.address && instance.address != settings_.address) {
      instance.role = Instance::Role::required;
    }
  }
  const auto endpoint = [this](const JsonNode* reliability, const std::string& what) {
    if (reliability != nullptr && reliability->kind == JsonNode::Kind::array) {
      const JsonNode* first = reliability->elements.empty() ? nullptr : &reliability->elements.front();
      if (reliability->elements.size() > 1) {
        warning(*reliability, "only the first of several ports is used");
      }
      reliability = first;
    }
    return reliability != nullptr && reliability->kind == JsonNode::Kind::object
               ? port(reliability->find("port"), what)
               : port(reliability, what);
  };
  instance.tcp_port = endpoint(node.find("reliable"), "a TCP port");
  instance.udp_port = endpoint(node.find("unreliable"), "a UDP port");

  Service& service = model_.services[at];
  each(node.find("events"), "an event", JsonNode::Kind::object,
       [&](const JsonNode& one) { event(one, service, instance); });
  std::optional<Endpoint> shared;  // of older releases: one group for all eventgroups of the service
  if (const JsonNode* group = object(node.find("multicast"), "a multicast group")) {
    if (const auto group_address = address(group->find("address"), "the address of a group")) {
      shared = Endpoint{*group_address, port(group->find("port"), "the port of a group").value_or(0)};
    }
  }
  multicast_.clear();
  each(node.find("eventgroups"), "an eventgroup", JsonNode::Kind::object,
       [&](const JsonNode& one) { eventgroup(one, shared, at, instance); });
  if (const JsonNode* settings = object(node.find("someip-tp"), "settings of SOME/IP-TP")) {
    tp(*settings, service, instance);
  }
  if (const JsonNode* times = object(node.find("debounce-times"), "times of nPDUs")) {
    for (const bool is_request : {true, false}) {
      if (const JsonNode* part =
              object(times->find(is_request ? "requests" : "responses"), "times by method")) {
        debounce(*part, is_request, service, instance);
      }
    }
  }
  model_.instances.push_back(std::move(instance));
}

Transport usual_transport(const Instance& instance) {
  return !instance.udp_port && instance.tcp_port ? Transport::tcp : Transport::udp;
}

void VsomeipReader::event(const JsonNode& node, Service& service, const Instance& instance) {
  const auto id = this->id<someip::MethodId>(node.find("event"), "an event id");
  if (!id) {
    if (node.find("event") == nullptr) {
      error(node, "expected an \"event\" with its id");
    }
    return;
  }
  if (has_event(service, *id)) {  // of another instance
    return;
  }
  Transfer transfer{.transport = usual_transport(instance)};
  if (const JsonNode* reliable = node.find("is_reliable")) {
    transfer.transport = truth(reliable, false) ? Transport::tcp : Transport::udp;
  }
  std::optional<std::chrono::microseconds> cycle;
  for (const char* key : {"update-cycle", "cycle"}) {
    if (const auto time = milliseconds(node.find(key), "a cycle"); time && time->count() != 0) {
      cycle = *time;
    }
  }
  if (truth(node.find("is_field"), false)) {
    events_[{*service.id, *id}] = {true, service.fields.size()};
    service.fields.push_back({.name = fmt::format("field_{:04x}", someip::value(*id)),
                              .notifier = id,
                              .has_getter = false,
                              .has_setter = false,
                              .notifier_transfer = transfer,
                              .place = place(node)});
    return;
  }
  add_event(service, {.name = fmt::format("event_{:04x}", someip::value(*id)),
                      .id = id,
                      .transfer = transfer,
                      .cycle = cycle,
                      .place = place(node)});
}

void VsomeipReader::multicast(const JsonNode& node, const std::optional<Endpoint>& shared, Multicast& group) {
  const JsonNode* multicast = node.find("multicast");
  if (multicast != nullptr && multicast->kind == JsonNode::Kind::object) {
    if (const auto found = address(multicast->find("address"), "the address of a group")) {
      group.group = {*found, port(multicast->find("port"), "the port of a group").value_or(0)};
    }
  } else if (const auto found = address(multicast, "the address of a group")) {
    group.group.address = *found;
  } else if (shared && truth(node.find("is_multicast"), true)) {
    group.group = *shared;
    group.threshold = 1;
  }
  if (const auto threshold = number(node.find("threshold"), "a threshold", 0, 0xffff'ffff)) {
    group.threshold = static_cast<std::uint32_t>(std::min<std::uint64_t>(*threshold, 255));
  }
}

void VsomeipReader::eventgroup(const JsonNode& node, const std::optional<Endpoint>& shared,
                               std::size_t service, Instance& instance) {
  const auto id = this->id<someip::EventgroupId>(node.find("eventgroup"), "an eventgroup id");
  if (!id) {
    if (node.find("eventgroup") == nullptr) {
      error(node, "expected an \"eventgroup\" with its id");
    }
    return;
  }
  Service& of = model_.services[service];
  const auto by_id = [](const Eventgroup& group, someip::EventgroupId other) {
    return someip::value(group.id) < someip::value(other);
  };
  const auto at = std::lower_bound(of.eventgroups.begin(), of.eventgroups.end(), *id, by_id);
  if (at == of.eventgroups.end() || at->id != *id) {
    of.eventgroups.insert(
        at, {.name = fmt::format("eventgroup_{:04x}", someip::value(*id)), .id = *id, .place = place(node)});
  }
  Multicast group{.eventgroup = *id};
  multicast(node, shared, group);
  if (!group.group.address.is_unspecified()) {
    if (group.group.port == 0) {
      group.group.port = instance.udp_port.value_or(0);
    }
    // Of two eventgroups with one id vsomeip takes the last.
    const auto [found, is_new] = multicast_.emplace(*id, instance.multicast.size());
    if (is_new) {
      instance.multicast.emplace_back();
    }
    instance.multicast[found->second] = group;
  }
  each(node.find("events"), "an event", JsonNode::Kind::string,
       [&](const JsonNode& one) { in_eventgroup(one, *id, of, instance); });
}

void VsomeipReader::in_eventgroup(const JsonNode& node, someip::EventgroupId group, Service& service,
                                  const Instance& instance) {
  // Older files describe the event here.
  const JsonNode* id_node = node.kind == JsonNode::Kind::object ? node.find("event") : &node;
  const auto id = this->id<someip::MethodId>(id_node, "an event id");
  if (!id) {
    if (id_node == nullptr) {
      error(node, "expected an \"event\" with its id");
    }
    return;
  }
  if (!has_event(service, *id)) {
    if (node.kind == JsonNode::Kind::object) {
      event(node, service, instance);
    } else {
      add_event(service, {.name = fmt::format("event_{:04x}", someip::value(*id)),
                          .id = id,
                          .transfer = {.transport = usual_transport(instance)},
                          .place = place(node)});
    }
  }
  const auto [is_field, at] = events_.at({*service.id, *id});
  auto& groups = is_field ? service.fields[at].eventgroups : service.events[at].eventgroups;
  if (std::ranges::find(groups, group) == groups.end()) {
    groups.push_back(group);
  }
}

Method& VsomeipReader::method_of(Service& service, someip::MethodId id, const Instance& instance,
                                 const JsonNode& node) {
  const auto [found, is_new] = methods_.emplace(EventKey{*service.id, id}, service.methods.size());
  if (!is_new) {
    return service.methods[found->second];
  }
  const Transfer transfer{.transport = usual_transport(instance)};
  service.methods.push_back({.name = fmt::format("method_{:04x}", someip::value(id)),
                             .id = id,
                             .request_transfer = transfer,
                             .response_transfer = transfer,
                             .place = place(node)});
  return service.methods.back();
}

Transfer& VsomeipReader::transfer_of(Service& service, someip::MethodId id, bool is_request,
                                     const Instance& instance, const JsonNode& node) {
  if (!is_request && (has_event(service, id) || someip::value(id) >= first_event_id)) {
    if (!has_event(service, id)) {
      add_event(service, {.name = fmt::format("event_{:04x}", someip::value(id)),
                          .id = id,
                          .transfer = {.transport = usual_transport(instance)},
                          .place = place(node)});
    }
    const auto [is_field, at] = events_.at({*service.id, id});
    return is_field ? service.fields[at].notifier_transfer : service.events[at].transfer;
  }
  Method& method = method_of(service, id, instance, node);
  return is_request ? method.request_transfer : method.response_transfer;
}

void VsomeipReader::tp(const JsonNode& node, Service& service, const Instance& instance) {
  each(node.find("client-to-service"), "a method", JsonNode::Kind::string,
       [&](const JsonNode& one) { tp_of(one, true, service, instance); });
  each(node.find("service-to-client"), "a method or event", JsonNode::Kind::string,
       [&](const JsonNode& one) { tp_of(one, false, service, instance); });
}

void VsomeipReader::tp_of(const JsonNode& node, bool is_request, Service& service, const Instance& instance) {
  const bool is_object = node.kind == JsonNode::Kind::object;
  const JsonNode* id_node = is_object ? node.find("method") : &node;
  const auto id = this->id<someip::MethodId>(id_node, "a method or event id");
  if (!id) {
    if (id_node == nullptr) {
      error(node, "expected a \"method\" with its id");
    }
    return;
  }
  Transfer& transfer = transfer_of(service, *id, is_request, instance, node);
  transfer.segment_bytes = vsomeip_segment_bytes;
  if (!is_object) {
    return;
  }
  if (const auto bytes = number(node.find("max-segment-length"), "the bytes of a segment", 16, 0xffff)) {
    transfer.segment_bytes = static_cast<std::uint32_t>(*bytes / 16 * 16);
    if (*bytes % 16 != 0) {
      warning(*node.find("max-segment-length"),
              fmt::format("a segment has a multiple of 16 bytes: {} is used", transfer.segment_bytes));
    }
  }
  if (const auto time = number(node.find("separation-time"), "a time in microseconds", 0, 1'000'000'000)) {
    transfer.separation = std::chrono::microseconds{*time};
  }
}

void VsomeipReader::debounce(const JsonNode& node, bool is_request, Service& service,
                             const Instance& instance) {
  for (const JsonNode& member : node.members) {
    const auto number = whole(member.name);
    if (!number || *number == 0 || *number > 0xffff) {
      JsonNode name{.kind = JsonNode::Kind::string, .text = member.name, .mark = member.name_mark};
      error(name, "expected a method or event id, not " + what_it_is(name));
      continue;
    }
    Transfer& transfer =
        transfer_of(service, static_cast<someip::MethodId>(*number), is_request, instance, member);
    const Transfer& usual = is_request ? settings_.requests : settings_.responses;
    transfer.debounce = usual.debounce;
    transfer.retention = usual.retention;
    if (const auto time = milliseconds(member.find("debounce-time"), "a time")) {
      transfer.debounce = *time;
    }
    if (const auto time = milliseconds(member.find("maximum-retention-time"), "a time")) {
      transfer.retention = *time;
    }
  }
}

void VsomeipReader::client(const JsonNode& node) {
  if (node.find("service") == nullptr) {
    return;  // ranges of ports for all services
  }
  const auto service_id = id<someip::ServiceId>(node.find("service"), "a service id");
  const auto instance_id = number(node.find("instance"), "an instance id", 1, 0xffff);
  if (!service_id) {
    return;
  }
  Instance instance{.role = Instance::Role::required,
                    .service = model_.services[service_of(*service_id, node)].name,
                    .service_id = service_id,
                    .place = place(node)};
  if (instance_id && *instance_id != 0xffff) {
    instance.id = static_cast<someip::InstanceId>(*instance_id);
    instance.name = fmt::format("instance_{:04x}", *instance_id);
  }
  if (required_.insert({*service_id, instance.id}).second) {
    model_.instances.push_back(std::move(instance));
  }
}

void VsomeipReader::profile(const JsonNode& node, std::string_view name, Protection& e2e) {
  const auto put = [&](const char* key, const char* ours, std::uint64_t max) {
    if (const auto value = number(node.find(key), key, 0, max)) {
      e2e.numbers[ours] = *value;
    }
  };
  put("data_id", "data_id", 0xffff'ffff);
  put("max_delta_counter", "max_delta_counter", 0xffff'ffff);
  if (name == "P01" || name == "CRC8") {
    e2e.profile = "1";
    e2e.words["payload_only"] = "true";  // docs/e2e.md: what vsomeip does
    put("crc_offset", "crc_offset_bits", 0xffff);
    put("counter_offset", "counter_offset_bits", 0xffff);
    put("data_id_nibble_offset", "data_id_nibble_offset_bits", 0xffff);
    put("data_length", "data_bits", 0xffff);
    static constexpr std::array modes{"both", "alternating", "low", "nibble"};
    if (const auto mode = number(node.find("data_id_mode"), "data_id_mode", 0, modes.size() - 1)) {
      e2e.words["data_id_mode"] = modes[*mode];
    }
    return;
  }
  put("crc_offset", "offset_bits", 0xffff'ffff);
  if (name == "P05") {
    e2e.profile = "5";
    e2e.words["crc_order"] = "big";
    put("data_length", "data_bits", 0xffff);
  } else {
    e2e.profile = name == "P07" ? "7" : "4";
    put("min_data_length", "min_data_bits", 0xffff'ffff);
    put("max_data_length", "max_data_bits", 0xffff'ffff);
  }
}

void VsomeipReader::protection(const JsonNode& node) {
  const auto service = id<someip::ServiceId>(node.find("service_id"), "a service id");
  const auto event = id<someip::MethodId>(node.find("event_id"), "an event or method id");
  const JsonNode* name = node.find("profile");
  if (!service || !event || name == nullptr) {
    if (node.find("service_id") == nullptr || node.find("event_id") == nullptr || name == nullptr) {
      error(node, "expected \"service_id\", \"event_id\" and \"profile\"");
    }
    return;
  }
  static constexpr std::array<std::string_view, 5> known{"P01", "CRC8", "P04", "P05", "P07"};
  if (std::ranges::find(known, name->text) == known.end()) {
    warning(*name, "the E2E profile " + documents::quote(name->text) +
                       " is left out: expected P01, CRC8, P04, P05 or P07");
    return;
  }
  Protected one{.service = *service, .id = *event, .e2e = {}, .place = place(node)};
  profile(node, name->text, one.e2e);
  protected_.push_back(std::move(one));
}

Protection* VsomeipReader::e2e_of(Service& service, someip::MethodId id) {
  if (const auto event = events_.find({*service.id, id}); event != events_.end()) {
    const auto [is_field, at] = event->second;
    return is_field ? &service.fields[at].e2e : &service.events[at].e2e;
  }
  const auto method = methods_.find({*service.id, id});
  return method == methods_.end() ? nullptr : &service.methods[method->second].e2e;
}

void VsomeipReader::finish(std::string_view name) {
  for (Protected& one : protected_) {
    file_ = one.place.file;
    const JsonNode node{.mark = one.place.mark};
    Service& service = model_.services[service_of(one.service, node)];
    Protection* e2e = e2e_of(service, one.id);
    if (e2e == nullptr && someip::value(one.id) >= first_event_id) {
      service.events.push_back(
          {.name = fmt::format("event_{:04x}", someip::value(one.id)), .id = one.id, .place = one.place});
      e2e = &service.events.back().e2e;
    } else if (e2e == nullptr) {
      e2e = &method_of(service, one.id, {}, node).e2e;
    }
    *e2e = std::move(one.e2e);
  }
  if (settings_.address || settings_.sd_multicast || settings_.sd_port) {
    model_.machines.push_back({.name = std::string{name},
                               .address = settings_.address,
                               .sd_multicast = settings_.sd_multicast,
                               .sd_port = settings_.sd_port});
  }
  for (Instance& instance : model_.instances) {
    if (settings_.sd) {
      instance.timing = settings_.timing;
    }
    const bool is_here = instance.role == Instance::Role::provided && !model_.machines.empty();
    if (is_here && (!instance.address || instance.address == settings_.address)) {
      instance.address = settings_.address;
      instance.machine = model_.machines.front().name;
    }
  }
}

/// "vsomeip-service" of "config/vsomeip-service.json.in".
std::string_view stem(std::string_view file) {
  const std::size_t slash = file.find_last_of("/\\");
  const std::string_view name = slash == std::string_view::npos ? file : file.substr(slash + 1);
  return name.substr(0, name.find('.'));
}

}  // namespace

Reading read_vsomeip(std::span<const SourceText> sources) {
  Reading reading;
  VsomeipReader reader{reading.model};
  for (const SourceText& source : sources) {
    const auto file = static_cast<std::uint32_t>(reading.model.files.size());
    reading.model.files.push_back(source.name);
    documents::Problems problems{source.name};
    if (source.text.size() > max_vsomeip_bytes) {
      problems.error({}, fmt::format("the file has {} bytes; expected at most {}", source.text.size(),
                                     max_vsomeip_bytes));
    } else if (const auto root = parse_json(source.text, problems)) {
      reader.read(*root, file, problems);
    }
    std::ranges::move(problems.take(), std::back_inserter(reading.problems));
  }
  if (!sources.empty()) {
    reader.finish(stem(sources.front().name));
  }
  return reading;
}

}  // namespace trestle::describe
