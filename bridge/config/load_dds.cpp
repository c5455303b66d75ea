#include "bridge/config/load_dds.hpp"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <system_error>

#include "bridge/config/names.hpp"
#include "bridge/config/ros_environment.hpp"
#include "bridge/config/section.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::bridge {
namespace {

Format<std::string> node_name() {
  return {"the absolute name of a ROS 2 node such as /trestle (letters, digits, '_')",
          [](std::string_view text) -> std::optional<std::string> {
            return is_topic_name(text) ? std::optional<std::string>{text} : std::nullopt;
          }};
}

Format<std::string> enclave_name() {
  return {"the absolute name of an enclave such as /vehicle/trestle",
          [](std::string_view text) -> std::optional<std::string> {
            return text == "/" || is_topic_name(text) ? std::optional<std::string>{text} : std::nullopt;
          }};
}

Format<std::string> ros_distro() {
  return {"the name of a ROS 2 distribution such as jazzy",
          [](std::string_view text) -> std::optional<std::string> {
            return is_distro_name(text) ? std::optional<std::string>{text} : std::nullopt;
          }};
}

/// As ROS_DISCOVERY_SERVER has it, but for names of hosts: "10.0.0.1:11811;10.0.0.2".
Format<std::vector<DiscoveryServer>> discovery_servers() {
  return {"addresses of discovery servers such as 10.0.0.1:11811 (IPv4, several with ';' between them)",
          [](std::string_view text) -> std::optional<std::vector<DiscoveryServer>> {
            std::vector<DiscoveryServer> servers;
            while (true) {
              const std::size_t end = std::min(text.find(';'), text.size());
              const std::string_view one = text.substr(0, end);
              const std::size_t colon = std::min(one.find(':'), one.size());
              DiscoveryServer server;
              const auto address = ip_address().read(one.substr(0, colon));
              if (!address || address->v6 || address->is_multicast()) {
                return std::nullopt;
              }
              server.address = *address;
              if (colon < one.size()) {
                const auto port = whole_number(1, 65535).read(one.substr(colon + 1));
                if (!port) {
                  return std::nullopt;
                }
                server.port = static_cast<std::uint16_t>(*port);
              }
              servers.push_back(server);
              if (end == text.size()) {
                return servers;
              }
              text.remove_prefix(end + 1);
            }
          }};
}

/// A path that is meant from the configuration's folder; an absolute one stays as it is.
std::filesystem::path beside(const std::string& file, const std::string& path) {
  return (std::filesystem::path{file}.parent_path() / path).lexically_normal();
}

void load_security(const YAML::Node& node, const std::string& file, SecuritySettings& into,
                   Problems& problems) {
  Section security{node, "security", problems};
  std::string keystore;
  security.read("enclave", enclave_name(), into.enclave);
  if (security.require("keystore", any_text("a folder that `ros2 security` made"), keystore)) {
    const auto folder = beside(file, keystore);
    std::error_code ignored;
    if (std::filesystem::is_directory(folder / "enclaves", ignored)) {
      into.keystore = folder.string();
    } else {
      problems.error(security.value_mark("keystore"),
                     fmt::format("keystore: {} has no folder 'enclaves'", quote(folder.string())));
    }
  }
  security.finish();
}

void load_profiles(Section& dds, const std::string& file, DdsSettings& into, Problems& problems) {
  std::string profiles;
  if (dds.read("profiles", any_text("a file of Fast DDS's XML profiles"), profiles)) {
    const auto path = beside(file, profiles);
    std::error_code ignored;
    if (std::filesystem::is_regular_file(path, ignored)) {
      into.profiles = path.string();
    } else {
      problems.error(dds.value_mark("profiles"),
                     fmt::format("profiles: there is no file {}", quote(path.string())));
    }
  }
  if (dds.read("profile", any_text("the name of a participant profile"), into.profile) &&
      dds.is_missing("profiles")) {
    problems.error(dds.value_mark("profile"), "profile: needs 'profiles', the file that it stands in");
  }
}

}  // namespace

void load_dds(const YAML::Node& node, const std::string& file, DdsSettings& into, Problems& problems) {
  Section dds{node, "dds", problems};
  dds.read("domain", as<std::uint32_t>(whole_number(0, 232)), into.domain);
  std::vector<IpAddress> addresses;
  std::vector<Mark> marks;
  auto ipv4 = ip_address();
  ipv4.expected = "an IPv4 address of this host";
  ipv4.read = [read = std::move(ipv4.read)](std::string_view text) {
    const auto address = read(text);
    return address && !address->v6 && !address->is_multicast() ? address : std::nullopt;
  };
  dds.read_list("interfaces", ipv4, addresses, marks);
  for (const IpAddress& address : addresses) {
    into.interfaces.push_back(someip::to_string(address));
  }
  into.mark = marks.empty() ? dds.mark() : marks.front();
/// The names of what in a file of profiles are profiles of readers and writers.
std::vector<std::string> endpoint_profiles(const std::filesystem::path& file) {
  std::vector<std::string> names;
  tinyxml2::XMLDocument document;
  const bool is_read = document.LoadFile(file.c_str()) == tinyxml2::XML_SUCCESS;
  const tinyxml2::XMLElement* const root = document.RootElement();
  if (!is_read || root == nullptr) {
    return names;  // Fast DDS says why
  }
  const tinyxml2::XMLElement* profiles = root;
  if (std::string_view{root->Name()} != "profiles") {
    profiles = root->FirstChildElement("profiles");
  }
  for (; profiles != nullptr; profiles = profiles->NextSiblingElement("profiles")) {
    for (auto* one = profiles->FirstChildElement(); one != nullptr; one = one->NextSiblingElement()) {
      constexpr std::array<std::string_view, 4> kinds{"data_reader", "data_writer", "publisher",
                                                      "subscriber"};
      const char* const name = one->Attribute("profile_name");
      if (name != nullptr && std::ranges::find(kinds, one->Name()) != kinds.end()) {
        names.push_back(quote(name));
      }
    }
  }
  return names;
}

  if (bool shared_memory = false; dds.read("shared_memory", truth(), shared_memory)) {
    into.shared_memory = shared_memory;
  }
  dds.read("lease", duration(std::chrono::seconds{1}, std::chrono::hours{1}), into.lease);
  dds.read("node", node_name(), into.node);
  dds.read("ros_distro", ros_distro(), into.ros_distro);
  load_profiles(dds, file, into, problems);
      if (const auto unused = endpoint_profiles(path); !unused.empty()) {
        problems.warning(
            dds.value_mark("profiles"),
            fmt::format(
                "profiles: {} of readers and writers: not used, as these have the `qos` of their routes",
                fmt::join(unused, ", ")));
      }
  dds.read("discovery_server", discovery_servers(), into.discovery_servers);
  if (const YAML::Node security = dds.child("security")) {
    load_security(security, file, into.security, problems);
  }
  dds.finish();
}

}  // namespace trestle::bridge
