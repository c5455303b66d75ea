#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bridge/convert/message_rules.hpp"
#include "someip/wire/endpoint.hpp"
#include "someip/wire/types.hpp"

/// What a configuration file says, as plain values. docs/configuration.md documents every key; load.hpp reads
/// the file. A BridgeConfig that load() returned is complete and consistent: nothing in it needs checking
/// again.
namespace trestle::bridge {

/// A place in the configuration file, both from 1. Line 0 stands for the file as a whole.
struct Mark {
  int line = 0;
  int column = 0;
  friend constexpr bool operator==(const Mark&, const Mark&) = default;
};

/// Which side a route takes messages from, and which it hands them to.
enum class Direction : std::uint8_t { dds_to_someip, someip_to_dds };

/// The direction's name as it stands above and in the configuration.
[[nodiscard]] constexpr const char* to_string(Direction direction) noexcept {
  return direction == Direction::dds_to_someip ? "dds_to_someip" : "someip_to_dds";
}

/// Timing and addresses of SOME/IP-SD; the names are the specification's.  [feat_req_someipsd_63]
struct SdSettings {
  IpAddress multicast = IpAddress::v4(224, 244, 224, 245);
  std::uint16_t port = 30490;
  Duration initial_delay_min = std::chrono::milliseconds{10};
  Duration initial_delay_max = std::chrono::milliseconds{100};
  Duration repetitions_base_delay = std::chrono::milliseconds{30};
  std::uint8_t repetitions_max = 3;
  Duration cyclic_offer_delay = std::chrono::seconds{1};
  /// How long the answer to a multicast Find waits, drawn at random between the two.
  Duration request_response_delay_min{0};
  Duration request_response_delay_max = std::chrono::milliseconds{10};
  /// Of offers and subscriptions: whole seconds, 1 to 0xFFFFFE; 0xFFFFFF is "until the next reboot".
  std::chrono::seconds ttl{3};
  bool check_subnet = true;  ///< peers outside of the subnet of our address are not heard
  friend bool operator==(const SdSettings&, const SdSettings&) = default;
};

/// The SOME/IP side: who we are there.
struct SomeipSettings {
  IpAddress address;      ///< own unicast address: a service's endpoint, and where SD listens
  std::string interface;  ///< for multicast; empty: the one that has `address`
  SdSettings sd;
  Mark mark;            ///< of the address
  Mark interface_mark;  ///< of the interface, if there is one
};

/// The DDS side: which domain we join, and by which ways.
struct DdsSettings {
  std::uint32_t domain = 0;             ///< 0 to 232
  std::vector<std::string> interfaces;  ///< IPv4 addresses that DDS may use; empty: all
  bool shared_memory = false;
  Mark mark;  ///< of the interfaces, or where all of this begins
};

/// Quality of service of a route's DDS reader or writer.
struct QosSettings {
  bool reliable = true;          ///< else best effort
  bool transient_local = false;  ///< else volatile; only if reliable
  std::uint32_t depth = 10;      ///< samples kept (keep-last)
  friend constexpr bool operator==(const QosSettings&, const QosSettings&) = default;
};

/// How messages that don't fit one datagram travel.
struct TpSettings {
  std::uint32_t segment_bytes = 1392;  ///< payload of a segment; a multiple of 16
  std::uint32_t burst = 45;            ///< segments that may leave at once, before `separation` passes
  Duration separation = std::chrono::microseconds{500};  ///< pause between bursts; 0: none
  std::size_t max_message = std::size_t{16}
                            << 20U;  ///< payload bytes; larger messages are dropped and counted
  friend constexpr bool operator==(const TpSettings&, const TpSettings&) = default;
};

/// Where an eventgroup's events go when many want them.
struct MulticastSettings {
  Endpoint group;
  std::size_t threshold = 2;  ///< from how many subscribers on; 1: always  [feat_req_someip_813]
  friend constexpr bool operator==(const MulticastSettings&, const MulticastSettings&) = default;
};

/// One topic, joined with one SOME/IP event.
struct Route {
  std::string topic;  ///< the ROS name, absolute: "/points"
  std::string type;   ///< "sensor_msgs/msg/PointCloud2"
  Direction direction = Direction::dds_to_someip;
  someip::ServiceId service{};
  someip::InstanceId instance{};
  someip::EventgroupId eventgroup{};
  someip::MethodId event{};
  std::uint8_t major = 1;
  std::uint32_t minor = 0;  ///< someip_to_dds: 0xFFFFFFFF accepts every minor version
  Transport transport = Transport::udp;
  /// dds_to_someip: the port of the offered service, UDP and TCP alike; routes of the same service instance
  /// share it. someip_to_dds: the UDP port to receive events at; 0 lets the system choose.
  std::uint16_t port = 0;
  std::optional<MulticastSettings> multicast;  ///< dds_to_someip over UDP; of the whole eventgroup
  TpSettings tp;
  MessageRules rules;
  QosSettings qos;
  Mark mark;  ///< where the route begins, for messages about it
};

/// A whole configuration file.
struct BridgeConfig {
  std::string file;  ///< as named by the user, for messages
  SomeipSettings someip;
  DdsSettings dds;
  std::vector<std::string>
      type_paths;             ///< folders with .msg packages, absolute or relative to the working directory
  std::vector<Route> routes;  ///< in the file's order; at least one
};

}  // namespace trestle::bridge
