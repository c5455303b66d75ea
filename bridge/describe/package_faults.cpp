#include "bridge/describe/package_faults.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <string_view>

#include "bridge/messages/types/builtin.hpp"

namespace trestle::describe {
namespace {

/// Names of targets that CMake or ament have themselves: rosidl makes one of the package's name.
constexpr std::array<std::string_view, 10> targets{"all",           "clean",   "edit_cache",     "help",
                                                   "install",       "package", "package_source", "preinstall",
                                                   "rebuild_cache", "test"};

std::string package_of(std::string_view name) {
  return std::string{name.substr(0, name.find('/'))};
}

std::set<std::string, std::less<>> packages_of_ros() {
  std::set<std::string, std::less<>> all;
  for (const messages::BuiltinDefinition& one : messages::builtin_definitions()) {
    all.insert(package_of(one.name));
  }
  return all;
}

Place place_of(const Model& model, const std::string& element) {
  for (const Type& type : model.types) {
    if (full_name(type.scope, type.name) == element) {
      return type.place;
    }
  }
  for (const Service& service : model.services) {
    const std::string name = full_name(service.scope, service.name);
    if (element.starts_with(name)) {
      return service.place;
    }
  }
  return {};
}

}  // namespace

std::vector<PackageFault> faults_of_packages(const Model& model, const Lowered& lowered) {
  std::set<std::string_view> from_ros;  // packages
  for (const Type& type : model.types) {
    if (!type.ros_name.empty()) {
      from_ros.insert(std::string_view{type.ros_name}.substr(0, type.ros_name.find('/')));
    }
  }
  for (const Service& service : model.services) {
    if (service.from_ros) {
      from_ros.insert(service.scope);
    }
  }
  static const std::set<std::string, std::less<>> of_ros = packages_of_ros();
  std::map<std::string, PackageFault> faults;
  for (const messages::MessageDefinition& one : lowered.definitions) {
    const std::string package = package_of(one.name);
    const bool is_of_ros = of_ros.contains(package);
    const bool is_target = std::ranges::find(targets, package) != targets.end();
    if ((!is_of_ros && !is_target) || from_ros.contains(package) || faults.contains(package)) {
      continue;
    }
    const auto source = lowered.sources.find(one.name);
    faults.emplace(
        package,
        PackageFault{.package = package,
                     .is_of_ros = is_of_ros,
                     .what = is_of_ros ? "its name, which is that of a package of ROS 2: where both are, one "
                                         "hides the other"
                                       : "its name, which CMake keeps for a target of its own: colcon does "
                                         "not build a package of this name",
                     .place = source == lowered.sources.end() ? Place{} : place_of(model, source->second)});
  }
  std::vector<PackageFault> all;
  for (auto& [package, fault] : faults) {
    all.push_back(std::move(fault));
  }
  return all;
}

}  // namespace trestle::describe
