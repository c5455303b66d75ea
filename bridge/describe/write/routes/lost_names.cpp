#include "bridge/describe/write/routes/lost_names.hpp"

#include <fmt/format.h>

#include <map>
#include <set>
#include <string>

#include "bridge/describe/ros_names.hpp"

namespace trestle::describe {
namespace {

/// What the file says of a service.
struct ServiceInFile {
  std::string name{};     ///< as who reads the file calls it
  std::string members{};  ///< "openDoor is open_door, …"
  std::set<std::string> told{};
};

/// "/car/door" and "moved" of "/car/door/instance_2/moved".
std::pair<std::string, std::string> parts_of(const std::string& topic, someip::InstanceId instance) {
  const std::size_t slash = topic.rfind('/');
  std::string before = slash == std::string::npos ? std::string{} : topic.substr(0, slash);
  const std::string of_instance = fmt::format("/instance_{}", someip::value(instance));
  if (before.ends_with(of_instance)) {
    before.resize(before.size() - of_instance.size());
  }
  return {before, topic.substr(slash == std::string::npos ? 0 : slash + 1)};
}

}  // namespace

void tell_of_names(const Model& model, const Lowered& lowered, const std::vector<RouteEntry>& entries,
                   std::vector<NotCarried>& not_carried) {
  std::map<std::string, ServiceInFile> services;
  for (const RouteEntry& entry : entries) {
    const YAML::Node topic = entry.node[entry.list == "methods" ? "ros_service" : "topic"];
    const auto [before, last] = parts_of(topic.Scalar(), entry.instance);
    ServiceInFile& service = services[entry.service];
    if (service.name.empty()) {
      service.name = before.empty() ? ros_type_name(last) + "Service"
                                    : ros_type_name(before.substr(before.rfind('/') + 1));
    }
    const std::string name = entry.member.substr(0, entry.member.find(':'));
    if (name != last && service.told.insert(entry.member).second) {
      service.members += fmt::format("{}{} is {}", service.members.empty() ? "" : ", ", name, last);
    }
  }
  for (const Service& service : model.services) {
    const auto found = services.find(full_name(service.scope, service.name));
    if (found == services.end() || service.from_ros) {
      continue;  // what is not in the file is listed; what ROS has keeps its names
    }
    const ServiceInFile& written = found->second;
    if (written.name != service.name) {
      not_carried.push_back(
          {service.name, "its name: who reads the file calls it " + written.name, service.place});
    }
    if (!service.scope.empty()) {
      not_carried.push_back({service.name, "its package: " + service.scope, service.place});
    }
    if (!written.members.empty()) {
      not_carried.push_back({service.name,
                             "the names of its members, which are as ROS has them: " + written.members,
                             service.place});
    }
    for (const Eventgroup& group : service.eventgroups) {
      if (!group.name.empty()) {
        not_carried.push_back(
            {service.name,
             fmt::format("the name of its eventgroup: {:#06x} is {}", someip::value(group.id), group.name),
             group.place});
      }
    }
  }
  // A message that is the whole payload is called `data` by readers of the file.
  for (const LoweredMember& member : lowered.members) {
    const Service& service = model.services[member.service];
    const auto found = services.find(full_name(service.scope, service.name));
    if (member.argument.empty() || member.argument == "data" || found == services.end() || service.from_ros) {
      continue;
    }
    const bool is_event = member.kind == LoweredMember::Kind::event;
    const std::string& name =
        is_event ? service.events[member.member].name : service.fields[member.member].name;
    const Place place = is_event ? service.events[member.member].place : service.fields[member.member].place;
    not_carried.push_back({service.name + "." + name, "the name of its argument: " + member.argument, place});
  }
  for (const Instance& instance : model.instances) {
    if (!instance.name.empty() && services.contains(instance.service)) {
      not_carried.push_back({instance.name, "the name of the instance", instance.place});
    }
  }
  for (const Machine& machine : model.machines) {
    if (!machine.name.empty()) {
      not_carried.push_back({machine.name, "the name of the machine", machine.place});
    }
  }
}

}  // namespace trestle::describe
