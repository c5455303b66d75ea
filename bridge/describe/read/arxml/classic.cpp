#include "bridge/describe/read/arxml/classic.hpp"

#include <algorithm>
#include <utility>

#include "bridge/describe/read/arxml/values.hpp"

namespace trestle::describe::arxml {

namespace {

constexpr std::uint16_t usual_sd_port = 30490;
/// Message ID of service discovery.
constexpr std::uint32_t sd_message = 0xffff'8100;

[[nodiscard]] std::string hex(std::uint32_t value, int digits) {
  constexpr std::string_view letters = "0123456789abcdef";
  std::string out = "0x";
  for (int shift = 4 * (digits - 1); shift >= 0; shift -= 4) {
    out += letters[(value >> static_cast<unsigned>(shift)) & 15U];
  }
  return out;
}

template <typename T>
void add_once(std::vector<T>& list, T value) {
  if (std::ranges::find(list, value) == list.end()) {
    list.push_back(value);
  }
}

}  // namespace

void Classic::read() {
  for (const Service& service : model_.services) {
    if (service.id) {
      described_.try_emplace(*service.id, full_name(service.scope, service.name));
    }
    if (service.scope.empty()) {
      plain_names_.insert(service.name);
    }
  }
  read_machines();
  read_instances("PROVIDED-SERVICE-INSTANCE"_tag, Instance::Role::provided);
  read_instances("CONSUMED-SERVICE-INSTANCE"_tag, Instance::Role::required);
  read_eventgroups();
  read_segmentation();
  read_signal_mappings();
  read_messages();
  join_protections();
  for (const auto& [id, index] : services_) {
    Service& service = model_.services[index];
    std::ranges::sort(service.eventgroups, {}, &Eventgroup::id);
    std::ranges::sort(service.events, {}, &Event::id);
    std::ranges::sort(service.methods, {}, &Method::id);
  }
}

// --- hosts ------------------------------------------------------------------------------------------------

Classic::Socket Classic::socket(const Node* endpoint) {
  Socket socket;
  if (endpoint == nullptr) {
    return socket;
  }
  socket.address = address_of(tree_.follow(endpoint, "NETWORK-ENDPOINT-REF"_tag), problems_);
  const auto port = [&](Tag tp, Tag tp_port) -> std::optional<std::uint16_t> {
    const auto number = number_in(endpoint->down("TP-CONFIGURATION"_tag, tp, tp_port, "PORT-NUMBER"_tag), 0,
                                  0xffff, problems_);
    return number && *number != 0 ? std::optional{static_cast<std::uint16_t>(*number)} : std::nullopt;
  };
  socket.udp = port("UDP-TP"_tag, "UDP-TP-PORT"_tag);
  socket.tcp = port("TCP-TP"_tag, "TCP-TP-PORT"_tag);
  const Node* const connector = tree_.follow(endpoint->above("SOCKET-ADDRESS"_tag), "CONNECTOR-REF"_tag);
  const Node* const ecu = connector == nullptr ? nullptr : connector->above("ECU-INSTANCE"_tag);
  if (ecu != nullptr) {
    socket.machine = ecu->name;
  }
  return socket;
}

void Classic::read_machines() {
  std::map<std::string, std::size_t, std::less<>> machines;
  for (const Node* const ecu : tree_.all("ECU-INSTANCE"_tag)) {
    machines.emplace(ecu->name, model_.machines.size());
    model_.machines.push_back({.name = std::string{ecu->name}, .place = ecu->place()});
  }
  std::optional<IpAddress> sd_group;
  for (const Node* const endpoint : tree_.all("APPLICATION-ENDPOINT"_tag)) {
    const Socket here = socket(endpoint);
    if (!here.address) {
      continue;
    }
    if (here.address->is_multicast()) {
      // Service discovery has no element of its own: its group has its port.
      if (here.udp == usual_sd_port) {
        sd_group = here.address;
      }
    } else if (const auto machine = machines.find(here.machine); machine != machines.end()) {
      Machine& host = model_.machines[machine->second];
      if (!host.address) {
        host.address = here.address;
      }
    }
  }
  if (sd_group) {
    for (const auto& [name, index] : machines) {
      model_.machines[index].sd_multicast = sd_group;
      model_.machines[index].sd_port = usual_sd_port;
    }
  }
}

// --- instances --------------------------------------------------------------------------------------------

Service& Classic::service(someip::ServiceId id, std::string_view name, Place place, Place id_place) {
  const auto [there, is_new] = services_.emplace(id, model_.services.size());
  if (is_new) {
    Service service{.name = {}, .id = id, .place = place, .id_place = id_place};
    service.name = name.empty() ? "Service_" + hex(someip::value(id), 4) : std::string{name};
    if (plain_names_.contains(service.name)) {
      service.name += "_" + hex(someip::value(id), 4);
    }
    plain_names_.insert(service.name);
    model_.services.push_back(std::move(service));
  }
  return model_.services[there->second];
}

/// One instance with a UDP and a TCP socket stands at both of them in older files.
void Classic::merge(Instance instance) {
  const auto [there, is_new] = instances_.try_emplace(
      {instance.role, instance.service_id, instance.id, instance.machine, instance.address},
      model_.instances.size());
  if (is_new) {
    model_.instances.push_back(std::move(instance));
    return;
  }
  Instance& other = model_.instances[there->second];
  other.udp_port = other.udp_port ? other.udp_port : instance.udp_port;
  other.tcp_port = other.tcp_port ? other.tcp_port : instance.tcp_port;
  if (!other.timing) {
    other.timing = instance.timing;
    other.said_at.insert(instance.said_at.begin(), instance.said_at.end());
  }
  for (const someip::EventgroupId group : instance.eventgroups) {
    add_once(other.eventgroups, group);
  }
  for (const Multicast& multicast : instance.multicast) {
    add_once(other.multicast, multicast);
  }
}

std::optional<someip::EventgroupId> Classic::eventgroup_id(const Node& handler) {
  const Node* id = handler.child("EVENT-GROUP-IDENTIFIER"_tag);
  // Older files have it with those who subscribe.
  each_in(&handler, "CONSUMED-EVENT-GROUP-REFS"_tag, "CONSUMED-EVENT-GROUP-REF"_tag,
          [&](const Node& reference) {
            const Node* const group = id == nullptr ? tree_.resolve(reference) : nullptr;
            id = group == nullptr ? id : group->child("EVENT-GROUP-IDENTIFIER"_tag);
          });
  const auto value = number_in(id, 0, 0xffff, problems_);
  if (id == nullptr) {
    problems_.warning(handler.place(), "the id of the eventgroup " + Tree::path(&handler) +
                                           " is missing: neither this element nor its consumers give one");
  }
  return value ? std::optional{static_cast<someip::EventgroupId>(*value)} : std::nullopt;
}

void Classic::read_instances(Tag tag, Instance::Role role) {
  const bool provided = role == Instance::Role::provided;
  for (const Node* const node : tree_.all(tag)) {
    const Node* const offered = tree_.follow(node, "PROVIDED-SERVICE-INSTANCE-REF"_tag);
    const auto said = [&](Tag what) {
      const Node* const own = node->child(what);
      return own == nullptr && offered != nullptr ? offered->child(what) : own;
    };
    Instance instance{.role = role, .name = std::string{node->name}, .place = node->place()};
    const Node* const id = said("SERVICE-IDENTIFIER"_tag);
    const auto service_id = number_in(id, 0, 0xffff, problems_);
    if (!service_id) {
      problems_.warning(node->place(), Tree::path(node) + " has no SERVICE-IDENTIFIER; it is left out");
      continue;
    }
    instance.service_id = static_cast<someip::ServiceId>(*service_id);
    const Node* const number = said("INSTANCE-IDENTIFIER"_tag);
    if (number != nullptr && number->text != "ANY" && number->text != "ALL" && number->text != "65535") {
      if (const auto value = number_in(number, 0, 0xffff, problems_)) {
        instance.id = static_cast<someip::InstanceId>(*value);
        if (!someip::names_an_instance(*instance.id)) {
          problems_.warning(number->place(),
                            std::string{number->text} + " cannot be the id of an instance: it is left open");
          instance.id.reset();
        }
      }
    }
    const Node* config = node->child(provided ? "SD-SERVER-CONFIG"_tag : "SD-CLIENT-CONFIG"_tag);
    const Node* major = node->child("MAJOR-VERSION"_tag);
    const Node* minor = node->child("MINOR-VERSION"_tag);
    if (config != nullptr) {
      major = major == nullptr ? config->child(provided ? "SERVER-SERVICE-MAJOR-VERSION"_tag
                                                        : "CLIENT-SERVICE-MAJOR-VERSION"_tag)
                               : major;
      minor = minor == nullptr ? config->child(provided ? "SERVER-SERVICE-MINOR-VERSION"_tag
                                                        : "CLIENT-SERVICE-MINOR-VERSION"_tag)
                               : minor;
    }
    each_in(node, "SD-SERVER-TIMER-CONFIGS"_tag,
            "SOMEIP-SD-SERVER-SERVICE-INSTANCE-CONFIG-REF-CONDITIONAL"_tag, [&](const Node& conditional) {
              const Node* const named =
                  tree_.follow(&conditional, "SOMEIP-SD-SERVER-SERVICE-INSTANCE-CONFIG-REF"_tag);
              config = named == nullptr ? config : named;
            });
    each_in(node, "SD-CLIENT-TIMER-CONFIGS"_tag,
            "SOMEIP-SD-CLIENT-SERVICE-INSTANCE-CONFIG-REF-CONDITIONAL"_tag, [&](const Node& conditional) {
              const Node* const named =
                  tree_.follow(&conditional, "SOMEIP-SD-CLIENT-SERVICE-INSTANCE-CONFIG-REF"_tag);
              config = named == nullptr ? config : named;
            });
    instance.timing = timing_of(config, problems_, instance.said_at);
    if (major == nullptr && offered != nullptr) {
      major = offered->child("MAJOR-VERSION"_tag);
    }
    if (const auto value = number_in(major, 0, 0xff, problems_)) {
      instance.major = static_cast<std::uint8_t>(*value);
    }
    if (minor != nullptr && minor->text != "ANY") {
      instance.minor = number_in(minor, 0, 0xffff'ffff, problems_);
      if (instance.minor == 0xffff'ffff && !provided) {
        instance.minor.reset();
      }
    }
    read_version_rules(*node, instance, problems_);
    const auto small = [&](Tag what) -> std::optional<std::uint16_t> {
      const auto value = number_in(node->child(what), 0, 0xffff, problems_);
      return value ? std::optional{static_cast<std::uint16_t>(*value)} : std::nullopt;
    };
    instance.priority = small("LOAD-BALANCING-PRIORITY"_tag);
    instance.weight = small("LOAD-BALANCING-WEIGHT"_tag);
    instance.configuration = records_of(*node);
    // The socket that it stands at, or those that it names.
    const auto at = [&](const Node* endpoint) {
      const Socket here = socket(endpoint);
      instance.address = here.address ? here.address : instance.address;
      instance.udp_port = here.udp ? here.udp : instance.udp_port;
      instance.tcp_port = here.tcp ? here.tcp : instance.tcp_port;
      instance.machine = here.machine.empty() ? instance.machine : here.machine;
      if (provided) {  // the sockets of clients are those of many services
        note_instance(endpoint, node);
      }
    };
    at(node->above("APPLICATION-ENDPOINT"_tag));
    each_in(node, "LOCAL-UNICAST-ADDRESSS"_tag, "APPLICATION-ENDPOINT-REF-CONDITIONAL"_tag,
            [&](const Node& conditional) { at(tree_.follow(&conditional, "APPLICATION-ENDPOINT-REF"_tag)); });

    const auto service_number = *instance.service_id;
    if (const auto described = described_.find(service_number); described != described_.end()) {
      instance.service = described->second;
    } else {
      Service& known = service(service_number, offered == nullptr ? node->name : offered->name, node->place(),
                               id->place());
      instance.service = known.name;
      if (provided && instance.major) {
        known.major = *instance.major;
        known.minor = instance.minor.value_or(0);
        known.has_version = true;
      }
    }
    const auto add_eventgroup = [&](const Node& element, someip::EventgroupId group) {
      if (!described_.contains(service_number)) {
        std::vector<Eventgroup>& groups = service(service_number, {}, {}, {}).eventgroups;
        if (std::ranges::find(groups, group, &Eventgroup::id) == groups.end()) {
          groups.push_back({.name = std::string{element.name}, .id = group, .place = element.place()});
        }
      }
    };
    each_in(node, "EVENT-HANDLERS"_tag, "EVENT-HANDLER"_tag, [&](const Node& handler) {
      const auto group = eventgroup_id(handler);
      if (!group) {
        return;
      }
      add_eventgroup(handler, *group);
      const auto sent_to = [&](const Node* endpoint) {
        const Socket to = socket(endpoint);
        if (to.address && to.address->is_multicast()) {
          const auto threshold = number_in(handler.child("MULTICAST-THRESHOLD"_tag), 0, 0xffff, problems_);
          add_once(instance.multicast, Multicast{.eventgroup = *group,
                                                 .group = {*to.address, to.udp.value_or(0)},
                                                 .threshold = threshold.value_or(2),
                                                 .group_at = handler.place(),
                                                 .threshold_at = said_at(threshold, handler)});
        }
      };
      sent_to(tree_.follow(&handler, "APPLICATION-ENDPOINT-REF"_tag));
      each_in(&handler, "EVENT-MULTICAST-ADDRESSS"_tag, "APPLICATION-ENDPOINT-REF-CONDITIONAL"_tag,
              [&](const Node& conditional) {
                sent_to(tree_.follow(&conditional, "APPLICATION-ENDPOINT-REF"_tag));
              });
    });
    each_in(node, "CONSUMED-EVENT-GROUPS"_tag, "CONSUMED-EVENT-GROUP"_tag, [&](const Node& group) {
      if (const auto value = number_in(group.child("EVENT-GROUP-IDENTIFIER"_tag), 0, 0xffff, problems_)) {
        add_once(instance.eventgroups, static_cast<someip::EventgroupId>(*value));
        add_eventgroup(group, static_cast<someip::EventgroupId>(*value));
        read_subscription(tree_, group, instance, problems_);
      }
    });
    merge(std::move(instance));
  }
}

void Classic::read_eventgroups() {
  const auto carries = [this](const Node& holder, someip::EventgroupId group) {
    const Node* const provided = holder.above("PROVIDED-SERVICE-INSTANCE"_tag);
    const Node* const instance =
        provided == nullptr ? holder.above("CONSUMED-SERVICE-INSTANCE"_tag) : provided;
    // What is missing is not the same group as what else is missing.
    const auto add = [&](auto& ids, const Node& reference) {
      if (const Node* const carried = tree_.resolve(reference); carried != nullptr) {
        add_once(ids[carried], group);
        note_instance(carried, instance);
      }
    };
    each_in(&holder, "ROUTING-GROUP-REFS"_tag, "ROUTING-GROUP-REF"_tag,
            [&](const Node& reference) { add(group_ids_, reference); });
    each_in(
        &holder, "PDU-ACTIVATION-ROUTING-GROUPS"_tag, "PDU-ACTIVATION-ROUTING-GROUP"_tag,
        [&](const Node& activation) {
          const auto identifier = [&](const Node& reference) { add(identifier_ids_, reference); };
          each_in(&activation, "I-PDU-IDENTIFIER-UDP-REFS"_tag, "I-PDU-IDENTIFIER-UDP-REF"_tag, identifier);
          each_in(&activation, "I-PDU-IDENTIFIER-TCP-REFS"_tag, "I-PDU-IDENTIFIER-TCP-REF"_tag, identifier);
        });
  };
  const auto id_in = [](const Node* id) -> std::optional<someip::EventgroupId> {
    const auto value = id == nullptr ? std::nullopt : integer(id->text);
    return value ? std::optional{static_cast<someip::EventgroupId>(static_cast<std::uint16_t>(*value))}
                 : std::nullopt;
  };
  for (const Node* const handler : tree_.all("EVENT-HANDLER"_tag)) {
    const Node* id = handler->child("EVENT-GROUP-IDENTIFIER"_tag);
    each_in(handler, "CONSUMED-EVENT-GROUP-REFS"_tag, "CONSUMED-EVENT-GROUP-REF"_tag,
            [&](const Node& reference) {
              const Node* const group = id == nullptr ? tree_.resolve(reference) : nullptr;
              id = group == nullptr ? id : group->child("EVENT-GROUP-IDENTIFIER"_tag);
            });
    const auto group = id_in(id);
    if (!group) {
      continue;
    }
    carries(*handler, *group);
    // Older files have them with those who subscribe.
    each_in(handler, "CONSUMED-EVENT-GROUP-REFS"_tag, "CONSUMED-EVENT-GROUP-REF"_tag,
            [&](const Node& reference) {
              if (const Node* const consumed = tree_.resolve(reference); consumed != nullptr) {
                carries(*consumed, *group);
              }
            });
  }
  // Who takes the requests.
  for (const Node* const instance : tree_.all("PROVIDED-SERVICE-INSTANCE"_tag)) {
    each_in(instance, "METHOD-ACTIVATION-ROUTING-GROUPS"_tag, "PDU-ACTIVATION-ROUTING-GROUP"_tag,
            [&](const Node& group) {
              const auto note = [&](const Node& reference) {
                note_instance(tree_.resolve(reference), instance);
              };
              each_in(&group, "I-PDU-IDENTIFIER-UDP-REFS"_tag, "I-PDU-IDENTIFIER-UDP-REF"_tag, note);
              each_in(&group, "I-PDU-IDENTIFIER-TCP-REFS"_tag, "I-PDU-IDENTIFIER-TCP-REF"_tag, note);
            });
  }
  // Who subscribes may be known without who offers.
  for (const Node* const consumed : tree_.all("CONSUMED-EVENT-GROUP"_tag)) {
    if (const auto group = id_in(consumed->child("EVENT-GROUP-IDENTIFIER"_tag))) {
      carries(*consumed, *group);
    }
  }
}

/// An instance of which messages at `at` are, which may be nothing.
void Classic::note_instance(const Node* at, const Node* instance) {
  if (at == nullptr || instance == nullptr) {
    return;
  }
  const Node* const offered = tree_.follow(instance, "PROVIDED-SERVICE-INSTANCE-REF"_tag);
  const Node* text = instance->child("SERVICE-IDENTIFIER"_tag);
  text = text == nullptr && offered != nullptr ? offered->child("SERVICE-IDENTIFIER"_tag) : text;
  const auto service = text == nullptr ? std::nullopt : integer(text->text);
  auto id = said_instance_id(instance);
  id = id ? id : said_instance_id(offered);
  if (service && id) {
    instance_ids_[{at, static_cast<someip::ServiceId>(static_cast<std::uint16_t>(*service))}].insert(*id);
  }
}

// --- messages ---------------------------------------------------------------------------------------------

const Node* Classic::pdu_of(const Node* triggering) const {
  return triggering != nullptr && triggering->tag == "PDU-TRIGGERING"_tag
             ? tree_.follow(triggering, "I-PDU-REF"_tag)
             : triggering;
}

void Classic::read_segmentation() {
  for (const Node* const connection : tree_.all("SOMEIP-TP-CONNECTION"_tag)) {
    const Node* const whole = pdu_of(tree_.follow(connection, "TP-SDU-REF"_tag));
    const Node* const segment = pdu_of(tree_.follow(connection, "TRANSPORT-PDU-REF"_tag));
    const Node* const channel = tree_.follow(connection, "TP-CHANNEL-REF"_tag);
    Transfer transfer;
    const Node* separation = connection->child("SEPARATION-TIME"_tag);
    separation =
        separation == nullptr && channel != nullptr ? channel->child("SEPARATION-TIME"_tag) : separation;
    if (separation != nullptr) {
      const auto time = seconds(separation->text);
      if (time) {
        transfer.separation = std::chrono::round<std::chrono::microseconds>(*time);
      } else {
        problems_.error(separation->place(), "SEPARATION-TIME is \"" + std::string{separation->text} +
                                                 "\", and seconds were expected");
      }
    }
    // With 8 bytes of the SOME/IP header and 4 of TP.
    const auto length =
        number_in(segment == nullptr ? nullptr : segment->child("LENGTH"_tag), 0, 0xffff'ffff, problems_);
    if (length && *length >= 12 + 16) {
      transfer.segment_bytes = (*length - 12) / 16 * 16;
      transfer.segment_bytes_at = segment->place();
    }
    for (const Node* const pdu : {whole, segment}) {
      if (pdu != nullptr) {
        transfers_[pdu] = transfer;
      }
    }
    if (whole != nullptr && segment != nullptr && whole != segment) {
      wholes_[segment] = whole;
    }
  }
}

void Classic::read_signal_mappings() {
  for (const Node* const mapping : tree_.all("CLIENT-SERVER-TO-SIGNAL-MAPPING"_tag)) {
    if (const Node* const signal = tree_.follow(mapping, "CALL-SIGNAL-REF"_tag); signal != nullptr) {
      call_mappings_.emplace(signal, mapping);
    }
    if (const Node* const signal = tree_.follow(mapping, "RETURN-SIGNAL-REF"_tag); signal != nullptr) {
      return_mappings_.emplace(signal, mapping);
    }
  }
  for (const Node* const mapping : tree_.all("SENDER-RECEIVER-TO-SIGNAL-MAPPING"_tag)) {
    const Node* const signal = tree_.follow(mapping, "SYSTEM-SIGNAL-REF"_tag);
    const Node* const element =
        tree_.follow(mapping->child("DATA-ELEMENT-IREF"_tag), "TARGET-DATA-PROTOTYPE-REF"_tag);
    if (signal != nullptr && element != nullptr) {
      data_mappings_.emplace(signal, element);
    }
  }
  for (const Node* const mapping : tree_.all("TRIGGER-TO-SIGNAL-MAPPING"_tag)) {
    const Node* const signal = tree_.follow(mapping, "SYSTEM-SIGNAL-REF"_tag);
    const Node* const trigger = tree_.follow(mapping->child("TRIGGER-IREF"_tag), "TARGET-TRIGGER-REF"_tag);
    if (signal != nullptr && trigger != nullptr) {
      data_mappings_.emplace(signal, trigger);
    }
  }
}

void Classic::read_messages() {
  std::map<const Node*, Transport> transports;
  std::map<const Node*, std::vector<const Node*>> ends;
  for (const Node* const connection : tree_.all("STATIC-SOCKET-CONNECTION"_tag)) {
    const Node* const address = connection->above("SOCKET-ADDRESS"_tag);
    const Node* const end = address == nullptr ? nullptr : address->child("APPLICATION-ENDPOINT"_tag);
    const Socket here = socket(end);
    each_in(
        connection, "I-PDU-IDENTIFIERS"_tag, "SO-CON-I-PDU-IDENTIFIER-REF-CONDITIONAL"_tag,
        [&](const Node& conditional) {
          if (const Node* const identifier = tree_.follow(&conditional, "SO-CON-I-PDU-IDENTIFIER-REF"_tag)) {
            transports[identifier] = here.transport();
            ends[identifier].push_back(end);
          }
        });
  }
  // Connections that are made when somebody subscribes stand nowhere: which refer to a PDU tells.
  for (const Node* const group : tree_.all("PDU-ACTIVATION-ROUTING-GROUP"_tag)) {
    each_in(group, "I-PDU-IDENTIFIER-UDP-REFS"_tag, "I-PDU-IDENTIFIER-UDP-REF"_tag,
            [&](const Node& reference) { transports.try_emplace(tree_.resolve(reference), Transport::udp); });
  }
  for (const Node* const group : tree_.all("PDU-ACTIVATION-ROUTING-GROUP"_tag)) {
    each_in(group, "I-PDU-IDENTIFIER-TCP-REFS"_tag, "I-PDU-IDENTIFIER-TCP-REF"_tag,
            [&](const Node& reference) { transports.try_emplace(tree_.resolve(reference), Transport::tcp); });
  }
  for (const Node* const identifier : tree_.all("SO-CON-I-PDU-IDENTIFIER"_tag)) {
    const auto found = transports.find(identifier);
    read_identifier(*identifier, found == transports.end() ? std::nullopt : std::optional{found->second},
                    ends[identifier]);
  }
  for (const Node* const bundle : tree_.all("SOCKET-CONNECTION-BUNDLE"_tag)) {
    const Node* const server = tree_.follow(bundle, "SERVER-PORT-REF"_tag);
    const Node* const end = server == nullptr ? nullptr : server->child("APPLICATION-ENDPOINT"_tag);
    const Transport transport = socket(end).transport();
    each_in(bundle, "BUNDLED-CONNECTIONS"_tag, "SOCKET-CONNECTION"_tag, [&](const Node& connection) {
      each_in(&connection, "PDUS"_tag, "SOCKET-CONNECTION-IPDU-IDENTIFIER"_tag,
              [&](const Node& identifier) { read_identifier(identifier, transport, {end}); });
    });
    each_in(bundle, "PDUS"_tag, "SOCKET-CONNECTION-IPDU-IDENTIFIER"_tag,
            [&](const Node& identifier) { read_identifier(identifier, transport, {end}); });
  }
  for (const Node* const config : tree_.all("SO-AD-CONFIG"_tag)) {
    // Connections without a bundle.
    each_in(config, "CONNECTIONS"_tag, "SOCKET-CONNECTION"_tag, [&](const Node& connection) {
      const Node* const local = tree_.follow(&connection, "LOCAL-PORT-REF"_tag);
      const Node* const port = local == nullptr ? tree_.follow(&connection, "REMOTE-PORT-REF"_tag) : local;
      const Node* const end = port == nullptr ? nullptr : port->child("APPLICATION-ENDPOINT"_tag);
      const Transport transport = socket(end).transport();
      each_in(&connection, "PDUS"_tag, "SOCKET-CONNECTION-IPDU-IDENTIFIER"_tag,
              [&](const Node& identifier) { read_identifier(identifier, transport, {end}); });
    });
  }
  for (const auto& [id, list] : messages_) {
    for (const Message& message : list) {
      make_message(message);
    }
  }
}

std::chrono::microseconds Classic::retention_of(const Node& identifier) {
  const Node* const timeout = identifier.child("PDU-COLLECTION-PDU-TIMEOUT"_tag);
  if (timeout == nullptr || identifier.child_text("PDU-COLLECTION-TRIGGER"_tag) == "ALWAYS") {
    return {};
  }
  const auto time = seconds(timeout->text);
  if (!time) {
    problems_.error(timeout->place(), "PDU-COLLECTION-PDU-TIMEOUT is \"" + std::string{timeout->text} +
                                          "\", and seconds were expected");
    return {};
  }
  return std::chrono::round<std::chrono::microseconds>(*time);
}

void Classic::read_identifier(const Node& identifier, std::optional<Transport> transport,
                              const std::vector<const Node*>& ends) {
  const auto id = number_in(identifier.child("HEADER-ID"_tag), 0, 0xffff'ffff, problems_);
  if (!id || *id == sd_message) {
    return;
  }
  const Node* const triggering = tree_.follow(&identifier, "PDU-TRIGGERING-REF"_tag);
  Message message{.id = *id,
                  .pdu = pdu_of(triggering),
                  .triggering = triggering,
                  .identifier = &identifier,
                  .transport = transport,
                  .retention = retention_of(identifier)};
  message.pdu = message.pdu == nullptr ? tree_.follow(&identifier, "PDU-REF"_tag) : message.pdu;
  if (const auto found = identifier_ids_.find(&identifier); found != identifier_ids_.end()) {
    message.groups = found->second;
  }
  const auto add_instances = [&](const Node* at) {
    const auto service = static_cast<someip::ServiceId>(static_cast<std::uint16_t>(*id >> 16U));
    const auto found = instance_ids_.find({at, service});
    if (found != instance_ids_.end() && copies_.take(identifier.place(), found->second.size() / 2)) {
      message.instances.insert(found->second.begin(), found->second.end());
    }
  };
  add_instances(&identifier);
  for (const Node* const end : ends) {
    add_instances(end);
  }
  each_in(&identifier, "ROUTING-GROUP-REFS"_tag, "ROUTING-GROUP-REF"_tag, [&](const Node& reference) {
    const Node* const routing_group = tree_.resolve(reference);
    add_instances(routing_group);
    const auto found = group_ids_.find(routing_group);
    if (found != group_ids_.end() && copies_.take(reference.place(), found->second.size() / 2)) {
      for (const someip::EventgroupId group : found->second) {
        add_once(message.groups, group);
      }
    }
  });
  // The same PDU goes to several clients.
  for (Message& other : messages_[*id]) {
    if (other.pdu == message.pdu) {
      other.transport = other.transport ? other.transport : message.transport;
      other.retention = std::max(other.retention, message.retention);
      other.instances.insert(message.instances.begin(), message.instances.end());
      for (const someip::EventgroupId group : message.groups) {
        add_once(other.groups, group);
      }
      return;
    }
  }
  messages_[*id].push_back(std::move(message));
}

const Node* Classic::signal_of(const Message& message) {
  const Node* signal = nullptr;
  bool several = false;
  const auto add = [&](const Node* found) {
    several = several || (signal != nullptr && found != nullptr && found != signal);
    signal = signal == nullptr ? found : signal;
  };
  const auto whole = wholes_.find(message.pdu);
  const Node* const pdu = whole == wholes_.end() ? message.pdu : whole->second;
  for (const Tag list : {"I-SIGNAL-TO-PDU-MAPPINGS"_tag, "SIGNAL-TO-PDU-MAPPINGS"_tag}) {
    each_in(pdu, list, "I-SIGNAL-TO-I-PDU-MAPPING"_tag,
            [&](const Node& mapping) { add(tree_.follow(&mapping, "I-SIGNAL-REF"_tag)); });
  }
  if (several) {
    without_signal_.insert(message.pdu);
    problems_.warning_once("several signals " + Tree::path(pdu), pdu->place(),
                           Tree::path(pdu) +
                               " has several signals, each at its bits: that is no SOME/IP transformation, "
                               "and its payload is not known");
    return nullptr;
  }
  each_in(message.triggering, "I-SIGNAL-TRIGGERINGS"_tag, "I-SIGNAL-TRIGGERING-REF-CONDITIONAL"_tag,
          [&](const Node& conditional) {
            const Node* const triggering = tree_.follow(&conditional, "I-SIGNAL-TRIGGERING-REF"_tag);
            signal = signal == nullptr ? tree_.follow(triggering, "I-SIGNAL-REF"_tag) : signal;
          });
  return signal;
}

/// How often the PDU is sent, if that is said.
std::optional<std::chrono::microseconds> Classic::cycle_of(const Message& message) {
  const auto whole = wholes_.find(message.pdu);
  const Node* const pdu = whole == wholes_.end() ? message.pdu : whole->second;
  const Node* const timing =
      pdu == nullptr ? nullptr : pdu->down("I-PDU-TIMING-SPECIFICATIONS"_tag, "I-PDU-TIMING"_tag);
  const Node* const period =
      timing == nullptr
          ? nullptr
          : timing->down("TRANSMISSION-MODE-DECLARATION"_tag, "TRANSMISSION-MODE-TRUE-TIMING"_tag,
                         "CYCLIC-TIMING"_tag, "TIME-PERIOD"_tag, "VALUE"_tag);
  if (period == nullptr) {
    return std::nullopt;
  }
  const auto time = seconds(period->text);
  if (!time) {
    problems_.error(period->place(),
                    "TIME-PERIOD is \"" + std::string{period->text} + "\", and seconds were expected");
    return std::nullopt;
  }
  return time->count() == 0 ? std::nullopt
                            : std::optional{std::chrono::round<std::chrono::microseconds>(*time)};
}

namespace {

/// The part of …-PROPS-VARIANTS that holds.
[[nodiscard]] const Node* conditional(const Node* signal, Tag properties, Tag variants, Tag inner) {
  const Node* const node =
      signal == nullptr ? nullptr : signal->down("TRANSFORMATION-I-SIGNAL-PROPSS"_tag, properties);
  const Node* const found = node == nullptr ? nullptr : node->down(variants, inner);
  return found == nullptr ? node : found;
}

}  // namespace

const Node* Classic::rules_node(const Node* signal) const {
  return conditional(signal, "SOMEIP-TRANSFORMATION-I-SIGNAL-PROPS"_tag,
                     "SOMEIP-TRANSFORMATION-I-SIGNAL-PROPS-VARIANTS"_tag,
                     "SOMEIP-TRANSFORMATION-I-SIGNAL-PROPS-CONDITIONAL"_tag);
}

/// The description of a step of the signal's transformation.
const Node* Classic::description(const Node* signal, const Node* properties, Tag tag) const {
  const Node* found = nullptr;
  const auto look = [&](const Node* technology) {
    const Node* const inner =
        technology == nullptr ? nullptr : technology->down("TRANSFORMATION-DESCRIPTIONS"_tag, tag);
    found = found == nullptr ? inner : found;
  };
  look(tree_.follow(properties, "TRANSFORMER-REF"_tag));
  each_in(signal, "DATA-TRANSFORMATIONS"_tag, "DATA-TRANSFORMATION-REF-CONDITIONAL"_tag,
          [&](const Node& reference) {
            const Node* const chain = tree_.follow(&reference, "DATA-TRANSFORMATION-REF"_tag);
            each_in(chain, "TRANSFORMER-CHAIN-REFS"_tag, "TRANSFORMER-CHAIN-REF"_tag,
                    [&](const Node& step) { look(tree_.resolve(step)); });
          });
  return found;
}

Context Classic::context_of(const Node* signal) {
  Context context;
  const Node* const properties = rules_node(signal);
  const Node* const general = description(signal, properties, "SOMEIP-TRANSFORMATION-DESCRIPTION"_tag);
  context.rules = joined(rules_of(properties, problems_), rules_of(general, problems_));
  each_in(properties, "TLV-DATA-ID-DEFINITION-REFS"_tag, "TLV-DATA-ID-DEFINITION-REF"_tag,
          [&](const Node& reference) {
            if (const Node* const set = tree_.resolve(reference); set != nullptr) {
              context.tag_sets.push_back(set);
            }
          });
  each_in(properties, "DATA-PROTOTYPE-TRANSFORMATION-PROPSS"_tag, "DATA-PROTOTYPE-TRANSFORMATION-PROPS"_tag,
          [&](const Node& special) {
            Override override;
            override.rules = rules_of(tree_.follow(&special, "TRANSFORMATION-PROPS-REF"_tag), problems_);
            override.representation =
                special.down("NETWORK-REPRESENTATION-PROPS"_tag, "SW-DATA-DEF-PROPS-VARIANTS"_tag,
                             "SW-DATA-DEF-PROPS-CONDITIONAL"_tag);
            for (const Tag tag : {"DATA-PROTOTYPE-IN-PORT-INTERFACE-REF"_tag,
                                  "DATA-PROTOTOTYPE-IN-PORT-INTERFACE-REF"_tag, "DATA-PROTOTYPE-REF"_tag}) {
              const Node* const holder = special.child(tag);
              for (const Node* way = holder == nullptr ? nullptr : holder->first_child; way != nullptr;
                   way = way->next) {
                const Node* const inner = way->first_child;
                const bool nested = inner != nullptr && inner->first_child != nullptr;
                (void)read_way(tree_, nested ? *inner : *way, override, problems_);
              }
            }
            if (override.target != nullptr) {
              context.overrides.push_back(std::move(override));
            }
          });
  return context;
}

void Classic::make_message(const Message& message) {
  const auto service_id = static_cast<someip::ServiceId>(static_cast<std::uint16_t>(message.id >> 16U));
  if (described_.contains(service_id)) {
    return;
  }
  const Node* const signal = signal_of(message);
  const Node* const properties = rules_node(signal);
  const Node* const system_signal = tree_.follow(signal, "SYSTEM-SIGNAL-REF"_tag);
  const auto call = call_mappings_.find(system_signal);
  const auto answer = return_mappings_.find(system_signal);
  const auto data = data_mappings_.find(system_signal);
  const bool is_someip = properties != nullptr ||
                         description(signal, nullptr, "SOMEIP-TRANSFORMATION-DESCRIPTION"_tag) != nullptr;
  if (!services_.contains(service_id) && !is_someip) {
    problems_.warning_once(
        "plain PDUs", message.identifier->place(),
        "HEADER-ID " + hex(message.id, 8) +
            " belongs to no service instance and no SOME/IP transformation: such PDUs are not "
            "SOME/IP messages, and are left out");
    return;
  }
  const Place id_place = message.identifier->child("HEADER-ID"_tag)->place();
  Service& here = service(service_id, {}, message.identifier->place(), id_place);
  const std::string_view type =
      properties == nullptr ? std::string_view{} : properties->child_text("MESSAGE-TYPE"_tag);
  if (properties != nullptr && !here.has_version) {
    const Node* version = properties->child("INTERFACE-VERSION"_tag);
    const Node* const general = description(signal, properties, "SOMEIP-TRANSFORMATION-DESCRIPTION"_tag);
    version = version == nullptr && general != nullptr ? general->child("INTERFACE-VERSION"_tag) : version;
    if (const auto major = number_in(version, 0, 0xff, problems_)) {
      here.major = static_cast<std::uint8_t>(*major);
      here.has_version = true;
    }
  }
  // An event may have no bit 15 here: the mapping and the message type tell more than the id.
  const bool is_event =
      type == "NOTIFICATION" ||
      (type.empty() && call == call_mappings_.end() && answer == return_mappings_.end() &&
       (data != data_mappings_.end() || (message.id & 0x8000U) != 0 || !message.groups.empty()));
  if (is_event) {
    make_event(here, message, signal, data == data_mappings_.end() ? nullptr : data->second);
  } else {
    const Node* const mapping = call != call_mappings_.end()       ? call->second
                                : answer != return_mappings_.end() ? answer->second
                                                                   : nullptr;
    // A trigger is sent as a request without answer, and so is a method without arguments.
    const bool is_trigger = data != data_mappings_.end() && data->second->tag == "TRIGGER"_tag;
    make_method(here, message, signal, mapping, is_trigger ? data->second : nullptr,
                type == "RESPONSE" || (call == call_mappings_.end() && answer != return_mappings_.end()),
                type == "REQUEST_NO_RETURN" || type == "REQUEST-NO-RETURN");
  }
}

namespace {

[[nodiscard]] std::string name_of(const Node* first, const Node* second, const Node* third,
                                  std::uint32_t id) {
  for (const Node* const node : {first, second, third}) {
    if (node != nullptr && !node->name.empty()) {
      return std::string{node->name};
    }
  }
  return "member_" + hex(id & 0xffffU, 4);
}

}  // namespace

void Classic::make_event(Service& here, const Message& message, const Node* signal, const Node* prototype) {
  const auto id = static_cast<someip::MethodId>(static_cast<std::uint16_t>(message.id));
  const someip::ServiceId service_id = here.id.value_or(someip::ServiceId{});
  const auto [known, is_new] = events_.try_emplace({service_id, id}, here.events.size());
  add_protection(message, signal, said_of_events_[{service_id, id}]);
  if (!is_new) {
    for (const someip::EventgroupId group : message.groups) {
      add_once(here.events[known->second].eventgroups, group);
    }
    return;
  }
  Event event{.name = name_of(prototype, signal, message.pdu, message.id), .id = id};
  if (event_names_.contains({service_id, event.name})) {
    event.name += "_" + hex(message.id & 0xffffU, 4);
  }
  event_names_.emplace(service_id, event.name);
  event.place = message.identifier->place();
  event.id_place = message.identifier->child("HEADER-ID"_tag)->place();
  event.eventgroups = message.groups;
  add_transfer(message, event.transfer);
  event.cycle = cycle_of(message);
  const Context context = context_of(signal);
  contexts_.fill(event.payload, context);
  if (prototype != nullptr) {
    event.notes = notes_beside(*prototype);
    if (!copies_.take(event.place, Copies::of_text(event.notes))) {
      event.notes = {};
    }
  }
  if (prototype != nullptr && prototype->tag != "TRIGGER"_tag) {
    event.payload.values.push_back(types_.value(*prototype, context));
    event.payload.values.back().notes.description.clear();
  } else if (prototype == nullptr) {
    event.payload.known = false;
    if (!without_signal_.contains(message.pdu)) {
      problems_.warning(event.place, "of " + here.name + "." + event.name + " (" + hex(message.id, 8) +
                                         ") no mapping tells the data type: its payload is not known");
    }
  }
  if (event.notes == Notes{} && message.pdu != nullptr) {
    event.notes = notes_beside(*message.pdu);
  }
  here.events.push_back(std::move(event));
}

/// What the message says, of its instances.
void Classic::add_protection(const Message& message, const Node* signal, std::vector<SaidProtection>& said) {
  const Node* const properties = conditional(signal, "END-TO-END-TRANSFORMATION-I-SIGNAL-PROPS"_tag,
                                             "END-TO-END-TRANSFORMATION-I-SIGNAL-PROPS-VARIANTS"_tag,
                                             "END-TO-END-TRANSFORMATION-I-SIGNAL-PROPS-CONDITIONAL"_tag);
  if (properties == nullptr) {
    return;
  }
  SaidProtection one{
      .e2e = protection_of(description(signal, properties, "END-TO-END-TRANSFORMATION-DESCRIPTION"_tag),
                           properties, nullptr, problems_),
      .node = signal,
      .instances = message.instances};
  if (!one.e2e.profile.empty()) {
    said.push_back(std::move(one));
  }
}

void Classic::join_protections() {
  for (const auto& [element, said] : said_of_events_) {
    model_.services[services_.at(element.first)].events[events_.at(element)].e2e = joined(said, problems_);
  }
  for (const auto& [element, calls] : said_of_methods_) {
    model_.services[services_.at(element.first)].methods[methods_.at(element)].e2e =
        joined(calls.said, problems_);
  }
}

void Classic::add_transfer(const Message& message, Transfer& transfer) const {
  transfer.transport = message.transport.value_or(Transport::udp);
  if (message.transport) {
    transfer.transport_at = message.identifier->place();
  }
  transfer.retention = message.retention;
  transfer.retention_at = message.identifier->place();
  const auto found = transfers_.find(message.pdu);
  if (found != transfers_.end()) {
    transfer.segment_bytes = found->second.segment_bytes;
    transfer.segment_bytes_at = found->second.segment_bytes_at;
    transfer.separation = found->second.separation;
  }
}

void Classic::make_method(Service& here, const Message& message, const Node* signal, const Node* mapping,
                          const Node* trigger, bool is_answer, bool fire_and_forget) {
  const auto id = static_cast<someip::MethodId>(static_cast<std::uint16_t>(message.id));
  const Node* const operation =
      mapping == nullptr
          ? nullptr
          : tree_.follow(mapping->child("CLIENT-SERVER-OPERATION-IREF"_tag), "TARGET-OPERATION-REF"_tag);
  const std::pair element{here.id.value_or(someip::ServiceId{}), id};
  const auto [known, is_new] = methods_.try_emplace(element, here.methods.size());
  SaidOfCalls& calls =
      said_of_methods_.try_emplace(element, SaidOfCalls{.of_answers = is_answer}).first->second;
  if (calls.of_answers == is_answer) {
    add_protection(message, signal, calls.said);
  }
  if (is_new) {
    here.methods.push_back(
        {.name = name_of(operation == nullptr ? trigger : operation, signal, message.pdu, message.id),
         .id = id});
  }
  Method* const method = &here.methods[known->second];
  if (is_new) {
    method->place = message.identifier->place();
    method->id_place = message.identifier->child("HEADER-ID"_tag)->place();
    if (operation == nullptr && trigger != nullptr) {
      method->notes = notes_beside(*trigger);
    } else if (operation == nullptr) {
      method->request.known = false;
      method->response.known = false;
      if (!without_signal_.contains(message.pdu)) {
        problems_.warning(method->place, "of " + here.name + "." + method->name + " (" + hex(message.id, 8) +
                                             ") no mapping tells the operation: its payloads are not known");
      }
    } else {
      method->notes = notes_beside(*operation);
    }
    // An operation without any answer on the wire.
    method->fire_and_forget =
        fire_and_forget || (mapping != nullptr && mapping->child("RETURN-SIGNAL-REF"_tag) == nullptr);
  }
  Transfer& transfer = is_answer ? method->response_transfer : method->request_transfer;
  add_transfer(message, transfer);
  Payload& payload = is_answer ? method->response : method->request;
  if (!payload.values.empty() || operation == nullptr) {
    return;
  }
  const Context context = context_of(signal);
  contexts_.fill(payload, context);
  payload.known = true;
  // Messages of several services may be of one operation.
  if (is_new && !used_operations_.insert(operation).second) {
    std::size_t parts = Copies::of_member + Copies::of_text(method->notes);
    each_in(operation, "ARGUMENTS"_tag, "ARGUMENT-DATA-PROTOTYPE"_tag, [&](const Node&) { parts += 2; });
    each_in(operation, "POSSIBLE-ERROR-REFS"_tag, "POSSIBLE-ERROR-REF"_tag,
            [&](const Node& error) { parts += 1 + Copies::of_text(error.text.size()); });
    if (!copies_.take(method->place, parts)) {
      return;
    }
  }
  if (copies_.full()) {
    return;
  }
  each_in(operation, "ARGUMENTS"_tag, "ARGUMENT-DATA-PROTOTYPE"_tag, [&](const Node& argument) {
    const std::string_view direction = argument.child_text("DIRECTION"_tag);
    const bool in_answer = direction == "OUT" || direction == "INOUT";
    const bool in_request = direction != "OUT";
    if (is_answer ? in_answer : in_request) {
      payload.values.push_back(types_.value(argument, context));
      payload.values.back().tag = contexts_.tag(context, &argument);
    }
    if (direction == "INOUT") {
      add_once(method->inout, std::string{argument.name});
    }
  });
  if (operation->child("POSSIBLE-ERROR-REFS"_tag) != nullptr && method->application_errors.empty()) {
    each_in(operation, "POSSIBLE-ERROR-REFS"_tag, "POSSIBLE-ERROR-REF"_tag,
            [&](const Node& reference) { method->application_errors.emplace_back(reference.text); });
  }
}

}  // namespace trestle::describe::arxml
