#include <algorithm>

#include "bridge/describe/address_text.hpp"
#include "bridge/describe/write/arxml/writer.hpp"

namespace trestle::describe::arxml_writer {

std::string Writer::timing_path(const sd::Timing& timing, bool server, const std::string& name, Place place) {
  const std::string package = std::string{own} + "/Sd";
  const std::string unique = packages_.unique(package, name);
  const std::string tag =
      server ? "SOMEIP-SD-SERVER-SERVICE-INSTANCE-CONFIG" : "SOMEIP-SD-CLIENT-SERVICE-INSTANCE-CONFIG";
  Xml xml;
  xml.open(tag);
  xml.leaf("SHORT-NAME", unique);
  xml.open(server ? "INITIAL-OFFER-BEHAVIOR" : "INITIAL-FIND-BEHAVIOR");
  xml.leaf("INITIAL-DELAY-MAX-VALUE", seconds(timing.initial_delay_max));
  xml.leaf("INITIAL-DELAY-MIN-VALUE", seconds(timing.initial_delay_min));
  xml.leaf("INITIAL-REPETITIONS-BASE-DELAY", seconds(timing.repetitions_base_delay));
  xml.leaf("INITIAL-REPETITIONS-MAX", std::to_string(timing.repetitions_max));
  xml.close();
  if (server) {
    xml.leaf("OFFER-CYCLIC-DELAY", seconds(timing.cyclic_offer_delay));
    xml.open("REQUEST-RESPONSE-DELAY");
    xml.leaf("MAX-VALUE", seconds(timing.request_response_delay_max));
    xml.leaf("MIN-VALUE", seconds(timing.request_response_delay_min));
    xml.close();
  }
  xml.leaf(server ? "SERVICE-OFFER-TIME-TO-LIVE" : "SERVICE-FIND-TIME-TO-LIVE", std::to_string(timing.ttl_s));
  xml.close();
  packages_.add(package, unique, xml.text());
  if (!server && (timing.cyclic_offer_delay != sd::Timing{}.cyclic_offer_delay ||
                  timing.request_response_delay_max != sd::Timing{}.request_response_delay_max ||
                  timing.request_response_delay_min != sd::Timing{}.request_response_delay_min)) {
    lost(name, "delays of offers and answers, which a client has none of", place);
  }
  return package + "/" + unique;
}

void Writer::write_instances() {
  const std::string package = std::string{own} + "/Instances";
  struct Host {
    std::optional<IpAddress> address{};
    const Machine* machine = nullptr;
    std::vector<std::pair<std::string, const Instance*>> instances{};
  };
  std::map<std::string, Host> hosts;
  for (const Machine& machine : model_.machines) {
    hosts[machine.name].machine = &machine;
    hosts[machine.name].address = machine.address;
  }
  for (const Instance& instance : model_.instances) {
    const bool provided = instance.role == Instance::Role::provided;
    const auto deployment = deployments_.find(instance.service);
    const std::string label = label_of(instance);
    if (deployment == deployments_.end()) {
      lost(label, "the instance: its service is not described", instance.place);
      continue;
    }
    const std::string name = packages_.unique(package, instance.name.empty() ? "Instance" : instance.name);
    if (name != instance.name) {
      lost(label, "its name: it is " + name, instance.place);
    }
    Xml xml;
    xml.open(provided ? "PROVIDED-SOMEIP-SERVICE-INSTANCE" : "REQUIRED-SOMEIP-SERVICE-INSTANCE");
    xml.leaf("SHORT-NAME", name);
    notes(xml, instance.notes);
    write_protections(xml, instance);
    xml.reference("SERVICE-INTERFACE-DEPLOYMENT-REF", "SOMEIP-SERVICE-INTERFACE-DEPLOYMENT",
                  deployment->second);
    if (!instance.configuration.empty()) {
      xml.open("CAPABILITY-RECORDS");
      for (const auto& [key, value] : instance.configuration) {
        xml.open("TAG-WITH-OPTIONAL-VALUE");
        xml.leaf("KEY", key);
        xml.leaf("VALUE", value);
        xml.close();
      }
      xml.close();
    }
    const auto group_path = [&](someip::EventgroupId id) {
      const auto found = eventgroups_.find({instance.service, someip::value(id)});
      return found == eventgroups_.end() ? std::string{} : found->second;
    };
    if (provided) {
      if (instance.priority) {
        xml.leaf("LOAD-BALANCING-PRIORITY", std::to_string(*instance.priority));
      }
      if (instance.weight) {
        xml.leaf("LOAD-BALANCING-WEIGHT", std::to_string(*instance.weight));
      }
      bool opened = false;
      std::size_t index = 0;
      for (const Multicast& multicast : instance.multicast) {
        const std::string group = group_path(multicast.eventgroup);
        if (group.empty()) {
          lost(label, "the group of an eventgroup that its service does not have", instance.place);
          continue;
        }
        if (!opened) {
          xml.open("PROVIDED-EVENT-GROUPS");
          opened = true;
        }
        xml.open("SOMEIP-PROVIDED-EVENT-GROUP");
        xml.leaf("SHORT-NAME", "group" + std::to_string(++index));
        xml.reference("EVENT-GROUP-REF", "SOMEIP-EVENT-GROUP", group);
        if (multicast.group.port != 0) {
          xml.leaf("EVENT-MULTICAST-UDP-PORT", std::to_string(multicast.group.port));
        }
        xml.leaf(multicast.group.address.v6 ? "IPV-6-MULTICAST-IP-ADDRESS" : "IPV-4-MULTICAST-IP-ADDRESS",
                 full_text(multicast.group.address));
        xml.leaf("MULTICAST-THRESHOLD", std::to_string(multicast.threshold));
        xml.close();
      }
      if (opened) {
        xml.close();
      }
      if (instance.timing) {
        xml.reference("SD-SERVER-CONFIG-REF", "SOMEIP-SD-SERVER-SERVICE-INSTANCE-CONFIG",
                      timing_path(*instance.timing, true, name, instance.place));
      }
      if (instance.id) {
        note_chosen(xml, instance.id_is_chosen);
        xml.leaf("SERVICE-INSTANCE-ID", std::to_string(someip::value(*instance.id)));
      }
    } else {
      bool opened = false;
      std::size_t index = 0;
      for (const someip::EventgroupId id : instance.eventgroups) {
        const std::string group = group_path(id);
        if (group.empty()) {
          lost(label, "an eventgroup that its service does not have", instance.place);
          continue;
        }
        if (!opened) {
          xml.open("REQUIRED-EVENT-GROUPS");
          opened = true;
        }
        xml.open("SOMEIP-REQUIRED-EVENT-GROUP");
        xml.leaf("SHORT-NAME", "group" + std::to_string(++index));
        xml.reference("EVENT-GROUP-REF", "SOMEIP-EVENT-GROUP", group);
        xml.close();
      }
      if (opened) {
        xml.close();
      }
      xml.leaf("REQUIRED-MINOR-VERSION", instance.minor ? std::to_string(*instance.minor) : "ANY");
      xml.leaf("REQUIRED-SERVICE-INSTANCE-ID",
               instance.id ? std::to_string(someip::value(*instance.id)) : "ALL");
      if (instance.timing) {
        xml.reference("SD-CLIENT-CONFIG-REF", "SOMEIP-SD-CLIENT-SERVICE-INSTANCE-CONFIG",
                      timing_path(*instance.timing, false, name, instance.place));
      }
      if (!instance.multicast.empty() || instance.priority || instance.weight) {
        lost(label, "groups, priority and weight, which only servers have", instance.place);
      }
    }
    xml.close();
    packages_.add(package, name, xml.text());
    if (instance.major || (provided && instance.minor)) {
      lost(label, "its version: it is that of the service", instance.place);
    }
    if (instance.address || instance.udp_port || instance.tcp_port || !instance.machine.empty()) {
      std::string host = instance.machine;
      if (host.empty()) {
        host = instance.address ? "Host_" + full_text(*instance.address) : "Host";
        lost(label, "that its machine has no name: it is " + short_name(host), instance.place);
      }
      Host& where = hosts[host];
      where.address = where.address ? where.address : instance.address;
      if (instance.address && where.address != instance.address) {
        lost(label, "its address, which is not that of its machine", instance.place);
      }
      where.instances.emplace_back(package + "/" + name, &instance);
    }
  }
  if (hosts.empty()) {
    return;
  }
  // All addresses are end points of one channel; a machine has one connector to it.
  const std::string network = std::string{own} + "/Network";
  const std::string channel = network + "/Cluster/Channel";
  std::map<std::string, std::string> endpoints;
  Xml addresses;
  const auto endpoint = [&](const IpAddress& address) {
    const std::string text = full_text(address);
    const auto [there, is_new] = endpoints.try_emplace(text, short_name("ep_" + text));
    if (is_new) {
      addresses.open("NETWORK-ENDPOINT");
      addresses.leaf("SHORT-NAME", there->second);
      addresses.open("NETWORK-ENDPOINT-ADDRESSES");
      addresses.open(address.v6 ? "IPV-6-CONFIGURATION" : "IPV-4-CONFIGURATION");
      addresses.leaf(address.v6 ? "IPV-6-ADDRESS" : "IPV-4-ADDRESS", text);
      addresses.close();
      addresses.close();
      addresses.close();
    }
    return channel + "/" + there->second;
  };
  for (const auto& [host_name, host] : hosts) {
    const std::string machines = std::string{own} + "/Machines";
    const std::string name = packages_.unique(machines, host_name);
    if (name != host_name && host.machine != nullptr) {
      lost(host_name, "the name of the machine: it is " + name, host.machine->place);
    }
    const std::string connector = machines + "/" + name + "/Connector";
    Xml xml;
    xml.open("MACHINE-DESIGN");
    xml.leaf("SHORT-NAME", name);
    xml.open("COMMUNICATION-CONNECTORS");
    xml.open("ETHERNET-COMMUNICATION-CONNECTOR");
    xml.leaf("SHORT-NAME", "Connector");
    std::map<std::pair<bool, std::uint16_t>, std::string> ports;
    for (const auto& [path, instance] : host.instances) {
      if (instance->tcp_port) {
        ports[{true, *instance->tcp_port}] = "tcp_" + std::to_string(*instance->tcp_port);
      }
      if (instance->udp_port) {
        ports[{false, *instance->udp_port}] = "udp_" + std::to_string(*instance->udp_port);
      }
    }
    if (!ports.empty()) {
      xml.open("AP-APPLICATION-ENDPOINTS");
      for (const auto& [port, port_name] : ports) {
        const std::string tp = port.first ? "TCP-TP" : "UDP-TP";
        xml.open("AP-APPLICATION-ENDPOINT");
        xml.leaf("SHORT-NAME", port_name);
        xml.open("TP-CONFIGURATION");
        xml.open(tp);
        xml.open(tp + "-PORT");
        xml.leaf("PORT-NUMBER", std::to_string(port.second));
        xml.close();
        xml.close();
        xml.close();
        xml.close();
      }
      xml.close();
    }
    if (host.address) {
      xml.open("UNICAST-NETWORK-ENDPOINT-REFS");
      xml.reference("UNICAST-NETWORK-ENDPOINT-REF", "NETWORK-ENDPOINT", endpoint(*host.address));
      xml.close();
    }
    xml.close();
    xml.close();
    if (host.machine != nullptr && (host.machine->sd_multicast || host.machine->sd_port)) {
      xml.open("SERVICE-DISCOVERY-CONFIGS");
      xml.open("SOMEIP-SERVICE-DISCOVERY");
      if (host.machine->sd_multicast) {
        xml.reference("MULTICAST-SD-IP-ADDRESS-REF", "NETWORK-ENDPOINT",
                      endpoint(*host.machine->sd_multicast));
      }
      if (host.machine->sd_port) {
        xml.leaf("SOMEIP-SERVICE-DISCOVERY-PORT", std::to_string(*host.machine->sd_port));
      }
      xml.close();
      xml.close();
    }
    xml.close();
    packages_.add(machines, name, xml.text());
    for (const auto& [path, instance] : host.instances) {
      const std::string mappings = std::string{own} + "/Mappings";
      const std::string mapping = packages_.unique(mappings, path.substr(path.rfind('/') + 1));
      Xml map;
      map.open("SOMEIP-SERVICE-INSTANCE-TO-MACHINE-MAPPING");
      map.leaf("SHORT-NAME", mapping);
      map.reference("COMMUNICATION-CONNECTOR-REF", "ETHERNET-COMMUNICATION-CONNECTOR", connector);
      map.open("SERVICE-INSTANCE-REFS");
      map.reference("SERVICE-INSTANCE-REF",
                    instance->role == Instance::Role::provided ? "PROVIDED-SOMEIP-SERVICE-INSTANCE"
                                                               : "REQUIRED-SOMEIP-SERVICE-INSTANCE",
                    path);
      map.close();
      if (instance->tcp_port) {
        map.reference("TCP-PORT-REF", "AP-APPLICATION-ENDPOINT",
                      connector + "/" + ports[{true, *instance->tcp_port}]);
      }
      if (instance->udp_port) {
        map.reference("UDP-PORT-REF", "AP-APPLICATION-ENDPOINT",
                      connector + "/" + ports[{false, *instance->udp_port}]);
      }
      map.close();
      packages_.add(mappings, mapping, map.text());
    }
  }
  if (!addresses.text().empty()) {
    Xml xml;
    xml.open("ETHERNET-CLUSTER");
    xml.leaf("SHORT-NAME", "Cluster");
    xml.open("ETHERNET-CLUSTER-VARIANTS");
    xml.open("ETHERNET-CLUSTER-CONDITIONAL");
    xml.open("PHYSICAL-CHANNELS");
    xml.open("ETHERNET-PHYSICAL-CHANNEL");
    xml.leaf("SHORT-NAME", "Channel");
    xml.open("NETWORK-ENDPOINTS");
    xml.raw(addresses.text());
    xml.close();
    xml.close();
    xml.close();
    xml.close();
    xml.close();
    xml.close();
    packages_.add(network, "Cluster", xml.text());
  }
}

}  // namespace trestle::describe::arxml_writer
