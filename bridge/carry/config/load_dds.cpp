#include "bridge/carry/config/load_dds.hpp"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <system_error>

#include "bridge/carry/config/ros_environment.hpp"
#include "bridge/documents/host_and_port.hpp"
#include "bridge/documents/quote_path.hpp"
#include "bridge/documents/section.hpp"
#include "bridge/messages/types/names.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::carry {
namespace {

bool is_host_name(std::string_view text) {
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  // Without a letter it would be an address.
  return text.size() <= 253 && std::ranges::any_of(text, is_letter) && std::ranges::all_of(text, [&](char c) {
           return is_letter(c) || (c >= '0' && c <= '9') || c == '-' || c == '.' || c == '_';
         });
}

/// "10.0.0.1", "10.0.0.1:11811", "host:11811", "fd00::1", "[fd00::1]:11811".
std::optional<dds::DiscoveryServer> discovery_server(std::string_view text) {
  const auto parts = documents::host_and_port(text);
  if (!parts) {
    return std::nullopt;
  }
  dds::DiscoveryServer server{std::string{parts->host}};
  if (const auto address = documents::ip_address().read(parts->host)) {
    if (address->is_multicast() || address->v6 != parts->v6) {
      return std::nullopt;
    }
    server.address = someip::to_string(*address);
  } else if (parts->v6 || !is_host_name(parts->host)) {
    return std::nullopt;
  }
  server.port = parts->port.value_or(server.port);
  return server;
}

}  // namespace

documents::Format<std::vector<dds::DiscoveryServer>> discovery_servers() {
  return {
      "addresses of discovery servers such as 10.0.0.1:11811, [fd00::1]:11811 or host:11811 (several with "
      "';' between them)",
      [](std::string_view text) -> std::optional<std::vector<dds::DiscoveryServer>> {
        constexpr std::size_t servers_max = 256;  // this many servers have an id
        std::vector<dds::DiscoveryServer> servers;
        for (bool more = true; more;) {
          const std::size_t end = std::min(text.find(';'), text.size());
          const auto server = end == 0 ? dds::DiscoveryServer{} : discovery_server(text.substr(0, end));
          if (!server || servers.size() == servers_max) {
            return std::nullopt;
          }
          servers.push_back(*server);
          more = end < text.size();
          text.remove_prefix(more ? end + 1 : end);
        }
        while (!servers.empty() && servers.back().address.empty()) {
          servers.pop_back();
        }
        return servers.empty() ? std::nullopt : std::optional{servers};
      }};
}

namespace {

/// A path relative to the folder of the configuration; an absolute path stays as it is.
std::filesystem::path beside(const std::string& file, const std::string& path) {
  return (std::filesystem::path{file}.parent_path() / path).lexically_normal();
}

void load_security(const YAML::Node& node, const std::string& file, SecuritySettings& into,
                   documents::Problems& problems) {
  documents::Section security{node, "security", problems};
  std::string keystore;
  security.read("enclave",
                documents::text_that(
                    "the absolute name of an enclave such as /vehicle/trestle",
                    [](std::string_view text) { return text == "/" || messages::is_topic_name(text); }),
                into.enclave);
  if (security.require("keystore", documents::any_text("a folder that `ros2 security` made"), keystore)) {
    const auto folder = beside(file, keystore);
    std::error_code ignored;
    if (std::filesystem::is_directory(folder / "enclaves", ignored)) {
      into.keystore = folder.string();
    } else {
      problems.error(security.value_mark("keystore"), fmt::format("keystore: {} has no folder 'enclaves'",
                                                                  documents::quote_path(folder.string())));
    }
  }
  security.finish();
}

/// The names of the profiles of readers and writers in a file of profiles.
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
        names.push_back(documents::quote(name));
      }
    }
  }
  return names;
}

void load_profiles(documents::Section& dds, const std::string& file, DdsSettings& into,
                   documents::Problems& problems) {
  std::string profiles;
  if (dds.read("profiles", documents::any_text("a file of Fast DDS's XML profiles"), profiles)) {
    const auto path = beside(file, profiles);
    std::error_code ignored;
    if (std::filesystem::is_regular_file(path, ignored)) {
      into.profiles_file = path.string();
      if (const auto unused = endpoint_profiles(path); !unused.empty()) {
        problems.warning(
            dds.value_mark("profiles"),
            fmt::format(
                "profiles: {} of readers and writers: not used, because these have the `qos` of their routes",
                fmt::join(unused, ", ")));
      }
    } else {
      problems.error(dds.value_mark("profiles"),
                     fmt::format("profiles: there is no file {}", documents::quote_path(path.string())));
    }
  }
  if (dds.read("profile", documents::any_text("the name of a participant profile"), into.profile) &&
      dds.is_missing("profiles")) {
    problems.error(dds.value_mark("profile"), "profile: needs 'profiles', the file that contains it");
  }
}

}  // namespace

void load_dds(const YAML::Node& node, const std::string& file, DdsSettings& into,
              documents::Problems& problems) {
  documents::Section dds{node, "dds", problems};
  into.has_domain = dds.read("domain", domain_id(), into.domain);
  std::vector<IpAddress> addresses;
  std::vector<documents::Mark> marks;
  auto ipv4 = documents::ip_address();
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
  if (bool shared_memory = false; dds.read("shared_memory", documents::truth(), shared_memory)) {
    into.shared_memory = shared_memory;
  }
  dds.read("types", documents::one_of<bool>({{"warn", false}, {"strict", true}}), into.strict_types);
  dds.read("lease", documents::duration(std::chrono::seconds{1}, std::chrono::hours{1}), into.lease);
  dds.read("node",
           documents::text_that("the absolute name of a ROS 2 node such as /trestle (letters, digits, '_')",
                                messages::is_topic_name, messages::topic_name_pattern),
           into.node);
  dds.read("ros_distro",
           documents::text_that("the name of a ROS 2 distribution such as jazzy", is_distro_name, "^[a-z]+$"),
           into.ros_distro);
  load_profiles(dds, file, into, problems);
  dds.read("discovery_server", discovery_servers(), into.discovery_servers);
  if (const YAML::Node security = dds.child("security")) {
    load_security(security, file, into.security, problems);
  }
  dds.finish();
}

}  // namespace trestle::carry
