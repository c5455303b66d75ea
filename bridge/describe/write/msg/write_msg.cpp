#include "bridge/describe/write/msg/write_msg.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "bridge/describe/layout.hpp"
#include "bridge/describe/package_faults.hpp"
#include "bridge/describe/units.hpp"
#include "bridge/messages/types/field_service.hpp"

namespace trestle::describe {
namespace {

/// The files of one package.
struct Package {
  std::map<std::string, std::string> files{};  ///< "msg/Obstacle.msg" -> text
  std::set<std::string> needs{};               ///< other packages
};

std::string package_of(std::string_view type) {
  return std::string{type.substr(0, type.find('/'))};
}

std::string package_xml(const std::string& name, const Package& package) {
  std::string needs;
  for (const std::string& other : package.needs) {
    needs += fmt::format("  <depend>{}</depend>\n", other);
  }
  return fmt::format(R"(<?xml version="1.0"?>
<package format="3">
  <name>{}</name>
  <version>0.0.0</version>
  <description>Messages and services of SOME/IP interfaces, made by trestle generate.</description>
  <maintainer email="nobody@example.com">nobody</maintainer>
  <license>unknown</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
{}  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>
)",
                     name, needs);
}

std::string cmake(const std::string& name, const Package& package) {
  std::string find;
  std::string needs;
  for (const std::string& other : package.needs) {
    find += fmt::format("find_package({} REQUIRED)\n", other);
    needs += " " + other;
  }
  std::string files;
  for (const auto& [file, text] : package.files) {
    files += fmt::format("  \"{}\"\n", file);
  }
  return fmt::format(R"(cmake_minimum_required(VERSION 3.8)
project({})
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
{}rosidl_generate_interfaces(${{PROJECT_NAME}}
{}{})
ament_export_dependencies(rosidl_default_runtime)
ament_package()
)",
                     name, find, files, needs.empty() ? "" : "  DEPENDENCIES" + needs + "\n");
}

/// The services that get and set the value of a field, as a bridge names them.
void add_field_services(std::map<std::string, Package>& packages, const Field& field,
                        const std::string& value_type) {
  const auto add = [&](bool wanted, messages::FieldAccess access) {
    if (!wanted) {
      return;
    }
    const std::string service = messages::field_service_name(value_type, access);
    const std::string name = package_of(service);
    Package& package = packages[name];
    package.needs.insert(package_of(value_type));
    package.files[service.substr(name.size() + 1) + ".srv"] =
        messages::field_service_text(value_type, access);
  };
  add(field.getter.has_value(), messages::FieldAccess::get);
  add(field.setter.has_value(), messages::FieldAccess::set);
}

/// What is not on the wire and has no place in these files: there are no services, typedefs, maps and
/// enumerations, and no annotations and limits.
class LostNotes {
 public:
  LostNotes(const Model& model, const Lowered& lowered, std::vector<NotCarried>& lost)
      : model_{model}, lowered_{lowered}, lost_{lost} {}

  void run() {
    unused_types();
    const std::map<TypeIndex, std::string> errors = names_of_errors(model_);
    for (std::size_t i = 0; i < model_.types.size(); ++i) {
      const Type& type = model_.types[i];
      const bool is_message = type.kind == Kind::structure || type.kind == Kind::choice;
      const auto error = errors.find(TypeIndex{static_cast<std::uint32_t>(i)});
      const std::string name = error == errors.end() ? full_name(type.scope, type.name) : error->second;
      add(name, type.notes, is_message || type.name.empty(), type.place);
      if (!type.name.empty()) {
        limits(name, type, type.place);
      }
      values(name, type.members);
      for (const Enumerator& one : type.enumerators) {
        add(name + "." + one.name, one.notes, true, one.place);
      }
    }
    for (const Constant& constant : model_.constants) {
      add(full_name(constant.scope, constant.name), constant.notes, true, constant.place);
    }
    for (std::size_t at = 0; at < model_.services.size(); ++at) {
      service(model_.services[at], at);
    }
  }

 private:
  using Kinds = LoweredMember::Kind;

  /// A structure is a file of its own; other types are where something uses them.
  void unused_types() {
    std::vector<TypeIndex> open;
    const auto use = [&](const std::vector<Value>& values) {
      std::ranges::transform(values, std::back_inserter(open), &Value::type);
    };
    for (const Type& type : model_.types) {
      if (type.kind == Kind::structure || type.kind == Kind::choice) {
        use(type.members);
      }
    }
    for (const Service& service : model_.services) {
      std::ranges::for_each(service.events, [&](const Event& one) { use(one.payload.values); });
      std::ranges::for_each(service.fields, [&](const Field& one) { use(one.payload.values); });
      for (const Method& one : service.methods) {
        use(one.request.values);
        use(one.response.values);
        open.push_back(one.error);
      }
    }
    std::vector<bool> is_seen(model_.types.size());
    std::set<std::pair<std::string_view, std::string_view>> used;  // variants have one name
    while (!open.empty()) {
      const auto index = static_cast<std::size_t>(open.back());
      open.pop_back();
      if (index >= is_seen.size() || is_seen[index]) {
        continue;
      }
      is_seen[index] = true;
      const Type& type = model_.types[index];
      used.emplace(type.scope, type.name);
      open.push_back(type.element.type);
      open.push_back(type.key.type);
    }
    for (const Type& type : model_.types) {
      if (type.kind != Kind::structure && type.kind != Kind::choice && !type.name.empty() &&
          !used.contains({type.scope, type.name})) {
        lost_.push_back({full_name(type.scope, type.name), "a type that nothing uses", type.place});
      }
    }
    polymorphic_types();
  }

  /// Those that something uses are in the list; of the others nobody asked for a message.
  void polymorphic_types() {
    std::set<std::string> told;
    for (const NotCarried& one : lost_) {
      told.insert(one.element);
    }
    for (const Type& type : model_.types) {
      // FIDL's `undefined` is written as one without a scope.
      if (const std::string name = full_name(type.scope, type.name);
          is_polymorphic(model_, type) && !type.scope.empty() && told.insert(name).second) {
        lost_.push_back({name, "a polymorphic structure", type.place});
      }
    }
  }

  void service(const Service& service, std::size_t index) {
    const std::string name = full_name(service.scope, service.name);
    add(name, service.notes, false, service.place);
    unit_of(name, service.notes.unit, service.place);
    for (std::size_t at = 0; at < service.events.size(); ++at) {
      const Event& one = service.events[at];
      member(name + "." + one.name, one, one.payload, {Kinds::event, index, at});
    }
    for (std::size_t at = 0; at < service.fields.size(); ++at) {
      const Field& one = service.fields[at];
      member(name + "." + one.name, one, one.payload, {Kinds::field, index, at});
    }
    for (const Method& one : service.methods) {
      add(name + "." + one.name, one.notes, true, one.place);
      values(name + "." + one.name, one.request.values);
      values(name + "." + one.name, one.response.values);
    }
  }

  struct Which {
    Kinds kind;
    std::size_t service;
    std::size_t index;
  };
  /// An event or field, which is a message of its own, or that of a structure.
  template <typename Member>
  void member(const std::string& name, const Member& one, const Payload& payload, const Which& which) {
    const LoweredMember* const lowered = lowered_.member(which.kind, which.service, which.index);
    const bool is_own = lowered == nullptr ||
                        lowered_.sources.find(lowered->type) == lowered_.sources.end() ||
                        lowered_.sources.find(lowered->type)->second == name;
    add(name, one.notes, is_own, one.place);
    if (!is_own) {
      unit_of(name, one.notes.unit, one.place);
    }
    for (const Value& value : payload.values) {
      add(name + "." + value.name, value.notes, is_own, value.place);
      // That of the structure itself is at the head of its message.
      if (const std::string unit = measured_in(model_, value);
          !is_own && unit != resolved(model_, value.type).notes.unit) {
        unit_of(name + "." + value.name, unit, value.place);
      }
      limits_of_use(name + "." + value.name, value);
    }
  }

  void values(const std::string& of, const std::vector<Value>& all) {
    for (const Value& value : all) {
      add(of + "." + value.name, value.notes, true, value.place);
      limits_of_use(of + "." + value.name, value);
    }
  }

  /// Of a type without a name.
  void limits_of_use(const std::string& element, const Value& value) {
    const Type& type = resolved(model_, value.type);
    if (type.name.empty()) {
      limits(element, type, value.place);
    }
  }

  void limits(const std::string& element, const Type& type, Place place) {
    if (type.minimum || type.maximum) {
      lost_.push_back({element, "its least and greatest value", place});
    }
    if (type.invalid_value) {
      lost_.push_back({element, fmt::format("its invalid value: {}", *type.invalid_value), place});
    }
  }

  void unit_of(const std::string& element, const std::string& unit, Place place) {
    if (!unit.empty()) {
      lost_.push_back({element, "its unit: " + unit, place});
    }
  }

  void add(const std::string& element, const Notes& notes, bool is_carried, Place place) {
    if (!is_carried && !notes.description.empty()) {
      lost_.push_back({element, "its description", place});
    }
    for (const auto& [name, value] : notes.others) {
      if (name.starts_with('@')) {
        lost_.push_back({element, fmt::format("its annotation: {}", name), place});
      }
    }
  }

  const Model& model_;
  const Lowered& lowered_;
  std::vector<NotCarried>& lost_;
};

/// Types and members that have other names in ROS.
void tell_of_names(const Model& model, const Lowered& lowered, const auto& is_from_ros,
                   std::vector<NotCarried>& lost) {
  std::map<std::string, Place> types;  // by full name
  for (const Type& type : model.types) {
    types.emplace(full_name(type.scope, type.name), type.place);
  }
  for (const messages::MessageDefinition& message : lowered.definitions) {
    const auto source = lowered.sources.find(message.name);
    if (source == lowered.sources.end() || is_from_ros(message.name)) {
      continue;
    }
    const std::string& element = source->second;
    const auto type = types.find(element);
    const Place place = type == types.end() ? Place{} : type->second;
    const std::string name = message.name.substr(message.name.rfind('/') + 1);
    if (type != types.end() && element.substr(element.find_last_of("./") + 1) != name) {
      lost.push_back({element, "its name, which ROS has otherwise: it is " + name, place});
    }
    std::string members;
    for (const messages::Field& field : message.fields) {
      const auto was = lowered.sources.find(message.name + "." + field.name);
      if (was != lowered.sources.end() && !was->second.empty() && was->second != field.name) {
        members += fmt::format("{}{} is {}", members.empty() ? "" : ", ", was->second, field.name);
      }
    }
    if (!members.empty()) {
      lost.push_back({element, "names of its members, which ROS has otherwise: " + members, place});
    }
  }
}

}  // namespace

Written write_msg(const Model& model, const Lowered& lowered) {
  Written written{.files = {}, .not_carried = lowered.not_carried};
  written.not_carried.insert(written.not_carried.end(), lowered.renamed.begin(), lowered.renamed.end());
  LostNotes{model, lowered, written.not_carried}.run();
  std::set<std::string, std::less<>> from_ros;
  for (const Type& type : model.types) {
    if (!type.ros_name.empty()) {
      from_ros.insert(type.ros_name);
    }
  }
  // Of a service that ROS has, an empty message has no type in the model.
  std::set<std::string, std::less<>> services_from_ros;
  for (const std::string& name : from_ros) {
    for (const std::string_view end : {"_Request", "_Response"}) {
      if (name.ends_with(end)) {
        services_from_ros.insert(name.substr(0, name.size() - end.size()));
      }
    }
  }
  for (const Service& service : model.services) {
    for (const Method& method : service.methods) {
      services_from_ros.insert(method.ros_type);
    }
  }
  const auto is_from_ros = [&](const std::string& name) {
    const std::size_t end = name.rfind('_');
    return from_ros.contains(name) || (name.find("/msg/") == std::string::npos && end != std::string::npos &&
                                       services_from_ros.contains(name.substr(0, end)));
  };
  tell_of_names(model, lowered, is_from_ros, written.not_carried);
  for (PackageFault& fault : faults_of_packages(model, lowered)) {
    written.not_carried.push_back({fault.package, std::move(fault.what), fault.place});
  }
  std::map<std::string, Package> packages;
  const auto note_needs = [](Package& package, const std::string& name,
                             const messages::MessageDefinition& message) {
    for (const messages::Field& field : message.fields) {
      if (const std::string other = package_of(field.type.message); !other.empty() && other != name) {
        package.needs.insert(other);
      }
    }
  };
  for (const messages::MessageDefinition& message : lowered.definitions) {
    if (is_from_ros(message.name)) {
      continue;
    }
    const std::string name = package_of(message.name);
    const std::size_t service = message.name.find("/srv/");
    Package& package = packages[name];
    note_needs(package, name, message);
    if (service == std::string::npos) {
      const std::string file = message.name.substr(name.size() + 1) + ".msg";
      package.files[file] = msg_text(lowered, message);
    }
  }
  for (const LoweredMember& member : lowered.members) {
    if (member.kind == LoweredMember::Kind::method && services_from_ros.contains(member.type)) {
      continue;
    }
    if (member.kind == LoweredMember::Kind::method) {
      const std::string name = package_of(member.type);
      packages[name].files[member.type.substr(name.size() + 1) + ".srv"] = srv_text(lowered, member.type);
    } else if (member.kind == LoweredMember::Kind::field) {
      add_field_services(packages, model.services[member.service].fields[member.member], member.type);
    }
  }
  for (const auto& [name, package] : packages) {
    written.files.push_back({name + "/package.xml", package_xml(name, package)});
    written.files.push_back({name + "/CMakeLists.txt", cmake(name, package)});
    for (const auto& [file, text] : package.files) {
      written.files.push_back({name + "/" + file, text});
    }
  }
  return written;
}

}  // namespace trestle::describe
