#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include "dds_adapter/participant_core.hpp"
#include "dds_adapter/polled_udp.hpp"
#include "dds_adapter/socket_buffers.hpp"

namespace trestle::dds::detail {

namespace {

// What sockets of UDP ask for; see buffers_not_granted(). A 4 MB sample is 64 datagrams at once.
constexpr std::uint32_t socket_buffer_bytes = 16U << 20U;
// A segment must hold several of the largest samples or it becomes the bottleneck.
constexpr std::uint32_t shared_memory_bytes = 128U << 20U;
constexpr std::uint32_t shared_message_bytes = 16U << 20U;

/// All IPv4 addresses of this host, as text.
std::vector<std::string> host_addresses() {
  std::vector<std::string> result;
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) {
    return result;
  }
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr != nullptr && entry->ifa_addr->sa_family == AF_INET) {
      const void* address = entry->ifa_addr;
      std::array<char, INET_ADDRSTRLEN> text{};
      if (inet_ntop(AF_INET, &static_cast<const sockaddr_in*>(address)->sin_addr, text.data(), text.size()) !=
          nullptr) {
        result.emplace_back(text.data());
      }
    }
  }
  freeifaddrs(list);
  return result;
}

std::string not_ours(const std::string& address, const std::vector<std::string>& own) {
  std::string text =
      "no interface of this host has the address " + address + ", which DDS is to use; there are:";
  for (const std::string& one : own) {
    text.append(" ").append(one);
  }
  return text;
}

/// @throws DdsError  unless each is an address of this host: names those that there are.
void check_interfaces(const std::vector<std::string>& interfaces) {
  if (interfaces.empty()) {
    return;
  }
  const std::vector<std::string> own = host_addresses();
  for (const std::string& address : interfaces) {
    in_addr parsed{};
    if (inet_pton(AF_INET, address.c_str(), &parsed) != 1) {
      throw DdsError{"DDS interface '" + address + "' is not an IPv4 address"};
    }
    if (std::ranges::find(own, address) == own.end()) {
      throw DdsError{not_ours(address, own)};
    }
  }
}

void load_profile(const ParticipantConfig& config, fast::DomainParticipantQos& qos) {
  auto* factory = fast::DomainParticipantFactory::get_instance();
  if (access(config.profiles_file.c_str(), R_OK) != 0) {
    throw DdsError{"the file of DDS profiles, " + config.profiles_file + ", cannot be read"};
  }
  if (!fast::is_ok(factory->load_XML_profiles_file(config.profiles_file))) {
    throw DdsError{"Fast DDS does not take " + config.profiles_file +
                   " for a file of profiles; see its own message on standard error"};
  }
  if (!fast::is_ok(factory->get_participant_qos_from_profile(config.profile, qos))) {
    throw DdsError{config.profiles_file + " has no participant profile '" + config.profile + "'"};
  }
}

/// `qos` is the default or comes from a profile.
void set_transports(const ParticipantConfig& config, const std::shared_ptr<SampleSockets>& sockets,
                    fast::DomainParticipantQos& qos) {
  auto& transport = qos.transport();
  // Fast DDS's built-in transports are never used, because they include shared memory.
  bool wants_udp = std::exchange(transport.use_builtin_transports, false);
  if (config.shared_memory || !config.interfaces.empty()) {
    transport.user_transports.clear();
  }
  wants_udp = wants_udp || transport.user_transports.empty();
  if (!wants_udp) {
    return;  // the profile has all the transports that it wants
  }
  const auto or_ours = [](std::uint32_t of_profile) {
    return of_profile != 0 ? of_profile : socket_buffer_bytes;
  };
  const auto udp = std::make_shared<fast::UdpV4Descriptor>();
  udp->interfaceWhiteList = config.interfaces;
  udp->sendBufferSize = or_ours(transport.send_socket_buffer_size);
  udp->receiveBufferSize = or_ours(transport.listen_socket_buffer_size);
  transport.user_transports.push_back(sockets ? received_by(sockets, udp) : udp);
  if (config.shared_memory == true) {
    const auto shared = std::make_shared<eprosima::fastdds::rtps::SharedMemTransportDescriptor>();
    shared->segment_size(shared_memory_bytes);
    shared->max_message_size(shared_message_bytes);
    transport.user_transports.push_back(shared);
  }
}

void set_lease(std::chrono::nanoseconds lease, fast::DomainParticipantQos& qos) {
  // Several announcements may be lost before peers give us up; by default they come every 3 s.
  auto& discovery = qos.wire_protocol().builtin.discovery_config;
  discovery.leaseDuration = fast::duration_of(lease);
  discovery.leaseDuration_announcementperiod =
      fast::duration_of(std::min<std::chrono::nanoseconds>(lease / 4, std::chrono::seconds{3}));
}

/// The files are those that ROS 2's tools put into the folder of an enclave (SROS2).
void set_security(const std::string& folder, fast::DomainParticipantQos& qos) {
  const auto set = [&](const std::string& name, const std::string& value) {
    qos.properties().properties().emplace_back("dds.sec." + name, value);
  };
  const auto set_file = [&](const std::string& name, const std::string& file) {
    const std::string path = folder + "/" + file;
    if (access(path.c_str(), R_OK) != 0) {
      throw DdsError{"DDS security needs " + path + ", which cannot be read"};
    }
    set(name, "file://" + path);
  };
  set("auth.plugin", "builtin.PKI-DH");
  set_file("auth.builtin.PKI-DH.identity_ca", "identity_ca.cert.pem");
  set_file("auth.builtin.PKI-DH.identity_certificate", "cert.pem");
  set_file("auth.builtin.PKI-DH.private_key", "key.pem");
  if (access((folder + "/crl.pem").c_str(), F_OK) == 0) {
    set_file("auth.builtin.PKI-DH.identity_crl", "crl.pem");
  }
  set("crypto.plugin", "builtin.AES-GCM-GMAC");
  set("access.plugin", "builtin.Access-Permissions");
  set_file("access.builtin.Access-Permissions.permissions_ca", "permissions_ca.cert.pem");
  set_file("access.builtin.Access-Permissions.governance", "governance.p7s");
  set_file("access.builtin.Access-Permissions.permissions", "permissions.p7s");
}

}  // namespace

fast::DomainParticipantQos participant_qos(const ParticipantConfig& config,
                                           const std::shared_ptr<SampleSockets>& sockets) {
  check_interfaces(config.interfaces);
  fast::DomainParticipantQos qos;
  const bool has_profile = !config.profiles_file.empty();
  if (has_profile) {
    load_profile(config, qos);
  }
  qos.name(config.name);
  set_transports(config, sockets, qos);
  // The lease of a profile stays, unless the configuration sets one.
  if (!has_profile || config.lease != ParticipantConfig{}.lease) {
    set_lease(config.lease, qos);
  }
  if (!config.discovery_servers.empty()) {
    fast::use_discovery_servers(config.discovery_servers, qos);
  }
  if (!config.security_folder.empty()) {
    set_security(config.security_folder, qos);
  }
  if (!config.node.empty()) {
    fast::set_user_data(qos, "enclave=" + config.enclave + ";");
  }
  return qos;
}

}  // namespace trestle::dds::detail

namespace trestle::dds {

std::uint32_t polled_buffer_bytes() noexcept {
  return detail::granted_receive_buffer(detail::socket_buffer_bytes);
}

bool sees_readers_begin() noexcept {
  return fast::HiddenSamples::are_possible;
}

bool shared_memory_can_abort() noexcept {
  return fast::stalled_peer_aborts(TRESTLE_FASTDDS_VERSION);
}

}  // namespace trestle::dds
