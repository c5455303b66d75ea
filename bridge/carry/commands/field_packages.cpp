#include "bridge/carry/commands/field_packages.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <set>

namespace trestle::carry {
namespace {

/// A package of services that get and set values with types of one other package.
struct Package {
  std::string of;  ///< "std_msgs"
  std::set<std::string> services;
};

std::string manifest(const std::string& name, const Package& package) {
  return fmt::format(R"(<?xml version="1.0"?>
<package format="3">
  <name>{0}</name>
  <version>1.0.0</version>
  <description>Services that get and set fields with values of {1}</description>
  <maintainer email="nobody@example.com">nobody</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  <depend>{1}</depend>
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export><build_type>ament_cmake</build_type></export>
</package>
)",
                     name, package.of);
}

std::string build_file(const std::string& name, const Package& package) {
  std::string services;
  for (const std::string& service : package.services) {
    services += fmt::format("  srv/{}.srv\n", service);
  }
  return fmt::format(R"(cmake_minimum_required(VERSION 3.8)
project({0})
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
find_package({1} REQUIRED)
rosidl_generate_interfaces(${{PROJECT_NAME}}
{2}  DEPENDENCIES {1})
ament_export_dependencies(rosidl_default_runtime)
ament_package()
)",
                     name, package.of, services);
}

}  // namespace

std::map<std::string, std::string> field_packages(const BridgeConfig& config) {
  std::map<std::string, std::string> files;
  std::map<std::string, Package> packages;
  for (const MethodRoute& method : config.methods) {
    if (method.access == messages::FieldAccess::none ||
        method.type != field_service_name(method.value_type, method.access)) {
      continue;
    }
    const auto service = messages::interface_name(method.type);
    const auto value = messages::interface_name(method.value_type);
    if (!service || !value) {
      continue;  // not reached: in a good configuration both are names
    }
    Package& package = packages[service->package];
    package.of = value->package;
    package.services.insert(service->type);
    files[method.type + ".srv"] = field_service_text(method.value_type, method.access);
  }
  for (const auto& [name, package] : packages) {
    files[name + "/package.xml"] = manifest(name, package);
    files[name + "/CMakeLists.txt"] = build_file(name, package);
  }
  return files;
}

std::string write_field_packages(const BridgeConfig& config, const std::string& folder) {
  for (const auto& [name, text] : field_packages(config)) {
    const std::filesystem::path path = std::filesystem::path{folder} / name;
    std::error_code error;
    std::filesystem::create_directories(path.parent_path(), error);
    if (error) {
      return fmt::format("{}: cannot be made: {}", path.parent_path().string(), error.message());
    }
    std::ofstream out{path, std::ios::binary};
    out << text;
    out.close();
    if (!out) {
      return fmt::format("{}: cannot be written", path.string());
    }
  }
  return {};
}

}  // namespace trestle::carry
