// Instances and machines of the Adaptive Platform, and what Classic has in common with them.
#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <utility>

#include "bridge/describe/read/arxml/adaptive.hpp"
#include "bridge/describe/read/arxml/values.hpp"

namespace trestle::describe::arxml {

std::optional<sd::Timing> timing_of(const Node* node, Problems& problems,
                                    std::map<std::string_view, Place>& said_at) {
  if (node == nullptr) {
    return std::nullopt;
  }
  sd::Timing timing;
  const auto time = [&](const Node* in, Tag tag, std::string_view setting, Duration& into) {
    const Node* const found = in == nullptr ? nullptr : in->child(tag);
    if (found == nullptr) {
      return;
    }
    const auto value = seconds(found->text);
    if (!value) {
      problems.error(found->place(), std::string{to_string(tag)} + " is \"" + std::string{found->text} +
                                         "\", and seconds were expected");
      return;
    }
    if (*value >= std::chrono::seconds{20} && tag != "OFFER-CYCLIC-DELAY"_tag) {
      problems.warning(found->place(), std::string{to_string(tag)} + " is " + std::string{found->text} +
                                           " seconds; were milliseconds meant?");
    }
    into = *value;
    said_at[setting] = found->place();
  };
  const Node* initial = node->child("INITIAL-OFFER-BEHAVIOR"_tag);
  initial = initial == nullptr ? node->child("INITIAL-FIND-BEHAVIOR"_tag) : initial;
  time(initial, "INITIAL-DELAY-MIN-VALUE"_tag, "initial_delay_min", timing.initial_delay_min);
  time(initial, "INITIAL-DELAY-MAX-VALUE"_tag, "initial_delay_max", timing.initial_delay_max);
  time(initial, "INITIAL-REPETITIONS-BASE-DELAY"_tag, "repetitions_base_delay",
       timing.repetitions_base_delay);
  if (initial != nullptr) {
    const Node* const repetitions = initial->child("INITIAL-REPETITIONS-MAX"_tag);
    if (const auto count = number_in(repetitions, 0, 0xff, problems)) {
      timing.repetitions_max = static_cast<std::uint8_t>(*count);
      said_at["repetitions_max"] = repetitions->place();
    }
  }
  time(node, "OFFER-CYCLIC-DELAY"_tag, "cyclic_offer_delay", timing.cyclic_offer_delay);
  const Node* const answer = node->child("REQUEST-RESPONSE-DELAY"_tag);
  time(answer, "MIN-VALUE"_tag, "request_response_delay_min", timing.request_response_delay_min);
  time(answer, "MAX-VALUE"_tag, "request_response_delay_max", timing.request_response_delay_max);
  for (const Tag tag : {"SERVICE-OFFER-TIME-TO-LIVE"_tag, "SERVICE-FIND-TIME-TO-LIVE"_tag, "TTL"_tag}) {
    if (const auto ttl = number_in(node->child(tag), 0, 0xffff'ffff, problems)) {
      timing.ttl_s = std::min<std::uint32_t>(*ttl, 0xff'ffff);  // forever
      said_at["ttl"] = node->child(tag)->place();
    }
  }
  return timing;
}

void read_version_rules(const Node& node, Instance& instance, Problems& problems) {
  const Node* const behavior = node.child("VERSION-DRIVEN-FIND-BEHAVIOR"_tag);
  if (behavior != nullptr && behavior->text == "MINIMUM-MINOR-VERSION" && instance.minor) {
    if (*instance.minor > 0) {
      problems.warning(behavior->place(), Tree::path(&node) + " wants a minor version of at least " +
                                              std::to_string(*instance.minor) +
                                              ": any is found, since Find asks for one or for any");
    }
    instance.minor.reset();
  }
  for (const Tag tag : {"BLOCKLISTED-VERSIONS"_tag, "BLACKLISTED-VERSIONS"_tag}) {
    if (const Node* const versions = node.child(tag); versions != nullptr) {
      problems.warning(versions->place(), std::string{to_string(tag)} + " of " + Tree::path(&node) +
                                              " is not carried: these versions are found as well");
    }
  }
}

void read_subscription(const Tree& tree, const Node& group, Instance& instance, Problems& problems) {
  const Node* timing = tree.follow(&group, "SD-CLIENT-EVENT-GROUP-TIMING-CONFIG-REF"_tag);
  timing = timing == nullptr ? group.child("SD-CLIENT-EVENT-TIMING-CONFIG"_tag) : timing;
  each_in(&group, "SD-CLIENT-TIMER-CONFIGS"_tag,
          "SOMEIP-SD-CLIENT-EVENT-GROUP-TIMING-CONFIG-REF-CONDITIONAL"_tag, [&](const Node& conditional) {
            const Node* const found =
                tree.follow(&conditional, "SOMEIP-SD-CLIENT-EVENT-GROUP-TIMING-CONFIG-REF"_tag);
            timing = timing == nullptr ? found : timing;
          });
  const Node* const older = group.child("SD-CLIENT-CONFIG"_tag);
  const Node* const ttl = timing == nullptr ? (older == nullptr ? nullptr : older->child("TTL"_tag))
                                            : timing->child("TIME-TO-LIVE"_tag);
  const auto value = number_in(ttl, 1, 0xffff'ffff, problems);
  if (!value) {
    return;
  }
  // One lifetime of all that a client asks for; that of a Find matters to nobody.
  const std::uint32_t seconds = std::min<std::uint32_t>(*value, 0xff'ffff);
  instance.timing = instance.timing ? instance.timing : sd::Timing{};
  const bool is_first = instance.eventgroups.size() <= 1;
  if (!is_first && instance.timing->ttl_s != seconds) {
    problems.warning(ttl->place(), "the subscriptions of " + instance.name +
                                       " have several lifetimes; that of the first is taken for all");
    return;
  }
  instance.timing->ttl_s = seconds;
  instance.said_at["ttl"] = ttl->place();
}

std::optional<IpAddress> address_of(const Node* endpoint, Problems& problems) {
  if (endpoint == nullptr) {
    return std::nullopt;
  }
  std::optional<IpAddress> found;
  const auto read = [&](const Node* text) {
    if (text == nullptr || found || text->text == "ANY") {
      return;
    }
    found = address(text->text);
    if (!found) {
      problems.error(text->place(), "\"" + std::string{text->text} + "\" is no IP address");
    }
  };
  each_in(endpoint, "NETWORK-ENDPOINT-ADDRESSES"_tag, "IPV-4-CONFIGURATION"_tag,
          [&](const Node& node) { read(node.child("IPV-4-ADDRESS"_tag)); });
  each_in(endpoint, "NETWORK-ENDPOINT-ADDRESSES"_tag, "IPV-6-CONFIGURATION"_tag,
          [&](const Node& node) { read(node.child("IPV-6-ADDRESS"_tag)); });
  return found;
}

std::map<std::string, std::string, std::less<>> records_of(const Node& node) {
  std::map<std::string, std::string, std::less<>> records;
  each_in(&node, "CAPABILITY-RECORDS"_tag, "TAG-WITH-OPTIONAL-VALUE"_tag, [&](const Node& record) {
    records[std::string{record.child_text("KEY"_tag)}] = record.child_text("VALUE"_tag);
  });
  return records;
}

// --- machines ---------------------------------------------------------------------------------------------

namespace {

/// The network endpoint of a connector: one in older schemas, several in newer ones.
[[nodiscard]] const Node* endpoint_of(const Tree& tree, const Node* connector) {
  const Node* endpoint = tree.follow(connector, "UNICAST-NETWORK-ENDPOINT-REF"_tag);
  each_in(
      connector, "UNICAST-NETWORK-ENDPOINT-REFS"_tag, "UNICAST-NETWORK-ENDPOINT-REF"_tag,
      [&](const Node& reference) { endpoint = endpoint == nullptr ? tree.resolve(reference) : endpoint; });
  return endpoint;
}

}  // namespace

void Adaptive::read_machines() {
  std::vector<const Node*> machines = tree_.all("MACHINE-DESIGN"_tag);
  for (const Node* const node : tree_.all("MACHINE"_tag)) {
    // Until R18 there is no design beside it.
    if (node->child("COMMUNICATION-CONNECTORS"_tag) != nullptr) {
      machines.push_back(node);
    }
  }
  for (const Node* const node : machines) {
    Machine machine{.name = std::string{node->name}, .place = node->place()};
    each_in(node, "COMMUNICATION-CONNECTORS"_tag, "ETHERNET-COMMUNICATION-CONNECTOR"_tag,
            [&](const Node& connector) {
              if (!machine.address) {
                machine.address = address_of(endpoint_of(tree_, &connector), problems_);
              }
            });
    for (const Tag list : {"SERVICE-DISCOVERY-CONFIGS"_tag, "SERVICE-DISCOVER-CONFIGS"_tag}) {
      each_in(node, list, "SOMEIP-SERVICE-DISCOVERY"_tag, [&](const Node& discovery) {
        machine.sd_multicast =
            address_of(tree_.follow(&discovery, "MULTICAST-SD-IP-ADDRESS-REF"_tag), problems_);
        if (const auto number =
                number_in(discovery.child("SOMEIP-SERVICE-DISCOVERY-PORT"_tag), 1, 0xffff, problems_)) {
          machine.sd_port = static_cast<std::uint16_t>(*number);
        }
      });
    }
    model_.machines.push_back(std::move(machine));
  }
}

// --- instances --------------------------------------------------------------------------------------------

void Adaptive::read_instance(const Node& node, Instance::Role role) {
  Instance instance{
      .role = role, .name = std::string{node.name}, .notes = notes_beside(node), .place = node.place()};
  const Node* reference = node.child("SERVICE-INTERFACE-DEPLOYMENT-REF"_tag);
  // Until R19 the reference has the name of another one, to the interface itself.
  reference = reference == nullptr ? node.child("SERVICE-INTERFACE-REF"_tag) : reference;
  if (const Node* const target = reference == nullptr ? nullptr : tree_.resolve(*reference);
      target != nullptr) {
    const auto found = deployed_.find(target);
    const Service* const service = model_.service(full_name(Tree::scope(*target), target->name));
    if (found != deployed_.end()) {
      instance.service = found->second.service;
      instance.service_id = found->second.id;
    } else if (target->tag == "SERVICE-INTERFACE"_tag && service != nullptr) {
      instance.service = full_name(service->scope, service->name);
      instance.service_id = service->id;
    } else {
      problems_.warning(reference->place(), Tree::path(target) + " is a " +
                                                std::string{to_string(target->tag)} +
                                                ", and a SOMEIP-SERVICE-INTERFACE-DEPLOYMENT was expected");
    }
  } else if (reference != nullptr) {
    problems_.warning(reference->place(),
                      "the deployment " + std::string{reference->text} + " is in none of the files");
  }
  if (const Node* const inlined = node.child("SERVICE-INTERFACE-DEPLOYMENT"_tag); inlined != nullptr) {
    problems_.warning(
        inlined->place(),
        "a SERVICE-INTERFACE-DEPLOYMENT-REF was expected; what stands here is read as a deployment");
    if (const auto id = number_in(inlined->child("SERVICE-INTERFACE-ID"_tag), 0, 0xffff, problems_)) {
      instance.service_id = static_cast<someip::ServiceId>(*id);
    }
    const Node* const version = inlined->child("SERVICE-INTERFACE-VERSION"_tag);
    if (version != nullptr) {
      if (const auto major = number_in(version->child("MAJOR-VERSION"_tag), 0, 0xff, problems_)) {
        instance.major = static_cast<std::uint8_t>(*major);
      }
      instance.minor = number_in(version->child("MINOR-VERSION"_tag), 0, 0xffff'ffff, problems_);
    }
    for (const Service& service : model_.services) {
      if (service.id == instance.service_id && instance.service.empty()) {
        instance.service = full_name(service.scope, service.name);
      }
    }
  }
  if (reference == nullptr && !instance.service_id) {
    problems_.warning(node.place(), Tree::path(&node) +
                                        " names no deployment: of which service it is an "
                                        "instance is not known");
  }
  const Node* id = node.child("SERVICE-INSTANCE-ID"_tag);
  id = id == nullptr ? node.child("REQUIRED-SERVICE-INSTANCE-ID"_tag) : id;
  if (id != nullptr && id->text != "ANY" && id->text != "ALL") {
    if (const auto number = number_in(id, 0, 0xffff, problems_)) {
      instance.id = static_cast<someip::InstanceId>(*number);
      if (!someip::names_an_instance(*instance.id)) {
        problems_.warning(id->place(),
                          std::string{id->text} + " cannot be the id of an instance: it is left open");
        instance.id.reset();
      }
    }
  }
  const Node* minor = node.child("REQUIRED-MINOR-VERSION"_tag);
  if (const Node* const version = node.child("REQUIRED-SERVICE-VERSION"_tag); version != nullptr) {
    // Until R18.
    if (const auto major = number_in(version->child("MAJOR-VERSION"_tag), 0, 0xff, problems_)) {
      instance.major = static_cast<std::uint8_t>(*major);
    }
    minor = minor == nullptr ? version->child("MINOR-VERSION"_tag) : minor;
  }
  if (minor != nullptr && minor->text != "ANY") {
    instance.minor = number_in(minor, 0, 0xffff'ffff, problems_);
  }
  read_version_rules(node, instance, problems_);
  const bool provided = role == Instance::Role::provided;
  const Tag config_reference = provided ? "SD-SERVER-CONFIG-REF"_tag : "SD-CLIENT-CONFIG-REF"_tag;
  const Tag config_inside = provided ? "SD-SERVER-CONFIG"_tag : "SD-CLIENT-CONFIG"_tag;
  const Node* config = tree_.follow(&node, config_reference);
  config = config == nullptr ? node.child(config_inside) : config;
  instance.timing = timing_of(config, problems_, instance.said_at);
  const auto small = [&](Tag tag) -> std::optional<std::uint16_t> {
    const auto value = number_in(node.child(tag), 0, 0xffff, problems_);
    return value ? std::optional{static_cast<std::uint16_t>(*value)} : std::nullopt;
  };
  instance.priority = small("LOAD-BALANCING-PRIORITY"_tag);
  instance.weight = small("LOAD-BALANCING-WEIGHT"_tag);
  instance.configuration = records_of(node);
  if (config != nullptr && instance.configuration.empty()) {
    instance.configuration = records_of(*config);  // until R19
  }
  const auto group_id = [&](const Node& group) -> std::optional<someip::EventgroupId> {
    const Node* const target = tree_.follow(&group, "EVENT-GROUP-REF"_tag);
    const Node* const number = (target == nullptr ? group : *target).child("EVENT-GROUP-ID"_tag);
    const auto value = number_in(number, 0, 0xffff, problems_);
    if (!value) {
      problems_.warning(group.place(),
                        "the eventgroup of " + Tree::path(&group) + " is in none of the files");
    }
    return value ? std::optional{static_cast<someip::EventgroupId>(*value)} : std::nullopt;
  };
  each_in(&node, "PROVIDED-EVENT-GROUPS"_tag, "SOMEIP-PROVIDED-EVENT-GROUP"_tag, [&](const Node& group) {
    const Node* text = group.child("IPV-4-MULTICAST-IP-ADDRESS"_tag);
    text = text == nullptr ? group.child("IPV-6-MULTICAST-IP-ADDRESS"_tag) : text;
    const auto threshold = number_in(group.child("MULTICAST-THRESHOLD"_tag), 0, 0xffff, problems_);
    const auto group_number = group_id(group);
    if (!group_number) {
      return;
    }
    // Without a threshold the group would never be used: then a second subscriber is enough.
    Multicast multicast{.eventgroup = *group_number,
                        .threshold = threshold.value_or(2),
                        .group_at = group.place(),
                        .threshold_at = said_at(threshold, group)};
    if (text == nullptr) {
      groups_without_address_[&node].push_back(multicast);
    } else if (const auto to = multicast_group(text, group); to) {
      multicast.group = *to;
      instance.multicast.push_back(multicast);
    }
  });
  each_in(&node, "REQUIRED-EVENT-GROUPS"_tag, "SOMEIP-REQUIRED-EVENT-GROUP"_tag, [&](const Node& group) {
    if (const auto number = group_id(group)) {
      instance.eventgroups.push_back(*number);
      read_subscription(tree_, group, instance, problems_);
    }
  });
  read_collection(node, instance);
  instances_[&node] = model_.instances.size();
  model_.instances.push_back(std::move(instance));
}

std::optional<std::uint16_t> Adaptive::port(const Node& mapping, Tag direct, Tag reference, Tag tp,
                                            Tag tp_port) {
  const Node* number = mapping.child(direct);
  if (number == nullptr) {
    const Node* const endpoint = tree_.follow(&mapping, reference);
    number = endpoint == nullptr ? nullptr
                                 : endpoint->down("TP-CONFIGURATION"_tag, tp, tp_port, "PORT-NUMBER"_tag);
  }
  const auto value = number_in(number, 0, 0xffff, problems_);
  return value && *value != 0 ? std::optional{static_cast<std::uint16_t>(*value)} : std::nullopt;
}

/// How long messages may wait for others. AUTOSAR says it for each instance, and the model for the service.
void Adaptive::read_collection(const Node& node, const Instance& instance) {
  const auto service = std::ranges::find_if(model_.services, [&](const Service& one) {
    return full_name(one.scope, one.name) == instance.service;
  });
  if (service == model_.services.end()) {
    return;
  }
  using Take = std::function<void(const Node&, std::string_view, std::chrono::microseconds)>;
  const auto read = [&](const Node& properties, Tag reference, const Take& take) {
    const Node* const deployment = tree_.follow(&properties, reference);
    const Node* const collection = properties.child("COLLECTION-PROPS"_tag);
    const Node* const timeout =
        collection == nullptr ? nullptr : collection->child("UDP-COLLECTION-BUFFER-TIMEOUT"_tag);
    if (deployment == nullptr || timeout == nullptr ||
        collection->child_text("UDP-COLLECTION-TRIGGER"_tag) == "ALWAYS") {
      return;
    }
    const auto time = seconds(timeout->text);
    if (!time) {
      problems_.error(timeout->place(), "UDP-COLLECTION-BUFFER-TIMEOUT is \"" + std::string{timeout->text} +
                                            "\", and seconds were expected");
      return;
    }
    // Of a field the part stands in its deployment.
    const bool is_part =
        deployment->parent != nullptr &&
        (deployment->tag == "GET"_tag || deployment->tag == "SET"_tag || deployment->tag == "NOTIFIER"_tag);
    const Node* const whole = is_part ? deployment->parent : deployment;
    std::string_view name = whole->name;
    for (const Tag tag : {"EVENT-REF"_tag, "TRIGGER-REF"_tag, "METHOD-REF"_tag, "FIELD-REF"_tag}) {
      if (const std::string_view path = whole->child_text(tag); !path.empty()) {
        name = path.substr(path.rfind('/') + 1);
      }
    }
    take(*deployment, name, std::chrono::round<std::chrono::microseconds>(*time));
  };
  const auto element = [](auto& list, std::string_view name) {
    const auto found = std::ranges::find_if(list, [&](const auto& one) { return one.name == name; });
    return found == list.end() ? nullptr : &*found;
  };
  const auto set_retention = [](Transfer& transfer, const Node& part, std::chrono::microseconds time) {
    transfer.retention = time;
    transfer.retention_at = part.place();
  };
  const auto of_field = [&](const Node& part, std::string_view name, std::chrono::microseconds time) {
    if (Field* const field = element(service->fields, name); field != nullptr) {
      set_retention(part.tag == "GET"_tag   ? field->getter_transfer
                    : part.tag == "SET"_tag ? field->setter_transfer
                                            : field->notifier_transfer,
                    part, time);
    }
  };
  each_in(&node, "EVENT-PROPSS"_tag, "SOMEIP-EVENT-PROPS"_tag, [&](const Node& properties) {
    read(properties, "EVENT-REF"_tag,
         [&](const Node& deployment, std::string_view name, std::chrono::microseconds time) {
           if (deployment.tag == "NOTIFIER"_tag) {
             of_field(deployment, name, time);
           } else if (Event* const event = element(service->events, name); event != nullptr) {
             set_retention(event->transfer, deployment, time);
           }
         });
  });
  for (const Tag list : {"METHOD-REQUEST-PROPSS"_tag, "METHOD-RESPONSE-PROPSS"_tag}) {
    each_in(&node, list, "SOMEIP-METHOD-PROPS"_tag, [&](const Node& properties) {
      read(properties, "METHOD-REF"_tag,
           [&](const Node& deployment, std::string_view name, std::chrono::microseconds time) {
             if (deployment.tag == "GET"_tag || deployment.tag == "SET"_tag) {
               of_field(deployment, name, time);
             } else if (Method* const method = element(service->methods, name); method != nullptr) {
               set_retention(
                   list == "METHOD-REQUEST-PROPSS"_tag ? method->request_transfer : method->response_transfer,
                   deployment, time);
             }
           });
    });
  }
}

/// Where a group is, of an address and the port beside it.
std::optional<Endpoint> Adaptive::multicast_group(const Node* text, const Node& beside) {
  const auto to = address(text->text);
  const auto port = number_in(beside.child("EVENT-MULTICAST-UDP-PORT"_tag), 1, 0xffff, problems_);
  if (!to || !to->is_multicast()) {
    problems_.error(text->place(), "\"" + std::string{text->text} + "\" is no multicast address");
    return std::nullopt;
  }
  return Endpoint{*to, static_cast<std::uint16_t>(port.value_or(0))};
}

void Adaptive::read_places() {
  for (const Node* const mapping : tree_.all("SOMEIP-SERVICE-INSTANCE-TO-MACHINE-MAPPING"_tag)) {
    const Node* const connector = tree_.follow(mapping, "COMMUNICATION-CONNECTOR-REF"_tag);
    const auto host = address_of(endpoint_of(tree_, connector), problems_);
    const Node* machine = connector == nullptr ? nullptr : connector->above("MACHINE-DESIGN"_tag);
    machine = machine == nullptr && connector != nullptr ? connector->above("MACHINE"_tag) : machine;
    // Until R19 all groups of an instance are at the address that stands here.
    const Node* group_text = mapping->child("IPV-4-MULTICAST-IP-ADDRESS"_tag);
    group_text = group_text == nullptr ? mapping->child("IPV-6-MULTICAST-IP-ADDRESS"_tag) : group_text;
    const auto group = group_text == nullptr ? std::nullopt : multicast_group(group_text, *mapping);
    const auto udp = port(*mapping, "UDP-PORT"_tag, "UDP-PORT-REF"_tag, "UDP-TP"_tag, "UDP-TP-PORT"_tag);
    const auto tcp = port(*mapping, "TCP-PORT"_tag, "TCP-PORT-REF"_tag, "TCP-TP"_tag, "TCP-TP-PORT"_tag);
    const auto place = [&](const Node& reference) {
      const auto found = instances_.find(tree_.resolve(reference));
      if (found == instances_.end()) {
        problems_.warning(reference.place(),
                          "the instance " + std::string{reference.text} + " is in none of the files");
        return;
      }
      Instance& instance = model_.instances[found->second];
      instance.address = host ? host : instance.address;
      instance.udp_port = udp ? udp : instance.udp_port;
      instance.tcp_port = tcp ? tcp : instance.tcp_port;
      if (machine != nullptr) {
        instance.machine = machine->name;
      }
      const auto groups = groups_without_address_.find(found->first);
      if (group && groups != groups_without_address_.end()) {
        for (Multicast multicast : std::exchange(groups->second, {})) {
          multicast.group = *group;
          instance.multicast.push_back(multicast);
        }
      }
    };
    each_in(mapping, "SERVICE-INSTANCE-REFS"_tag, "SERVICE-INSTANCE-REF"_tag, place);
    each_child(mapping, "SERVICE-INSTANCE-REF"_tag, place);
  }
}

}  // namespace trestle::describe::arxml
