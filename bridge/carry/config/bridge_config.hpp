// bridge/carry/config: the configuration of a bridge.
//
//   bridge_config.hpp   what a file says, as plain values
//   load.hpp            reads and checks a file; load_access.hpp, load_console.hpp, load_dds.hpp and
//                       load_limits.hpp: its sections
//   elements.hpp        the elements of its lists, read in load_route.cpp, load_method.cpp and so on
//   conflicts.hpp, pattern_conflicts.hpp  what cannot be true together
//   topic_pattern.hpp   patterns of topics; lock_file.hpp, id_allocator.hpp: ids of discovered topics
//   schema.hpp          the JSON Schema, learnt from what the loaders ask for: ask_keys.hpp
//   ros_environment.hpp ROS_DOMAIN_ID and its like
//
// docs/configuration.md has every key.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bridge/describe/e2e_settings.hpp"
#include "bridge/documents/problem.hpp"
#include "bridge/messages/convert/message_rules.hpp"
#include "bridge/messages/map/field_mapping.hpp"
#include "bridge/messages/types/field_service.hpp"
#include "bridge/messages/types/type_library.hpp"
#include "dds_adapter/participant.hpp"
#include "sd/net/access.hpp"
#include "sd/net/node_config.hpp"
#include "sd/wire/entry.hpp"
#include "someip/core/tp_pacing.hpp"
#include "someip/net/tls.hpp"
#include "someip/wire/endpoint.hpp"
#include "someip/wire/types.hpp"

/// What a configuration file says, as plain values. docs/configuration.md documents every key; load.hpp reads
/// the file. A BridgeConfig that load() returned is complete and consistent: nothing in it needs checking
/// again.
namespace trestle::carry {

/// Which side a route takes messages from, and which it hands them to.
enum class Direction : std::uint8_t { dds_to_someip, someip_to_dds };

/// The direction's name as it stands above and in the configuration.
[[nodiscard]] constexpr const char* to_string(Direction direction) noexcept {
  return direction == Direction::dds_to_someip ? "dds_to_someip" : "someip_to_dds";
}

/// The same of a mapping of fields.
[[nodiscard]] constexpr messages::MapDirection map_direction(Direction direction) noexcept {
  return direction == Direction::dds_to_someip ? messages::MapDirection::to_payload
                                               : messages::MapDirection::to_ros;
}

/// The bridge on the SOME/IP side: what the file says of its Node. node_config() sets what follows from the
/// routes.
struct SomeipSettings : sd::NodeConfig {
  std::optional<std::size_t> receive_buffer{};  ///< bytes, of each UDP socket; nothing: by what may come
  std::optional<std::size_t> send_buffer{};     ///< likewise, by what is sent
  bool tell_dds_domain = true;  ///< bridges of the same one wait until they have found each other there
  /// The limits that the file sets, by name: load_limits.hpp.
  std::map<std::string, std::uint64_t, std::less<>> given_limits{};
  documents::Mark mark{};            ///< of the address
  documents::Mark interface_mark{};  ///< of the interface, if there is one
};

/// ROS 2's security: the keys and rights of an enclave in a keystore that `ros2 security` made.
struct SecuritySettings {
  std::string keystore;  ///< a folder, absolute or relative to the working directory; empty: no security
  std::string enclave = "/";
  friend bool operator==(const SecuritySettings&, const SecuritySettings&) = default;
};

/// The DDS side: which domain we join, and by which ways. participant_config() sets what follows from the
/// rest: `enclave`, `gid_bytes` and `security_folder`.
struct DdsSettings : dds::ParticipantConfig {
  DdsSettings() {
    node = "/trestle";
    profile = "trestle";
    frees_samples = true;
  }
  bool has_domain = false;  ///< `domain` is given
  SecuritySettings security{};
  std::string ros_distro{};  ///< of the nodes in the domain, "jazzy"; empty: not known
  documents::Mark mark;      ///< of the interfaces, or where all of this begins
};

/// Quality of service of a route's DDS reader or writer.
struct QosSettings : dds::Qos {
  /// dds_to_someip: what stands above holds until a publisher is known; then it is what all of them offer.
  bool reliability_as_published = false;
  bool durability_as_published = false;  ///< likewise
  friend constexpr bool operator==(const QosSettings&, const QosSettings&) = default;
};

/// How messages that don't fit one datagram travel.
struct TpSettings : someip::TpPacing {
  /// Payload bytes; larger messages are dropped and counted.
  std::size_t max_message = std::size_t{16} << 20U;
  friend constexpr bool operator==(const TpSettings&, const TpSettings&) = default;
};

/// Where an eventgroup's events go when many want them.
struct MulticastSettings {
  Endpoint group;
  std::size_t threshold = 2;  ///< from how many subscribers on; 1: always  [feat_req_someip_813]
  friend constexpr bool operator==(const MulticastSettings&, const MulticastSettings&) = default;
};

using describe::E2eSettings;

/// Where the states of methods and of end-to-end protection are published.
struct DiagnosticsSettings {
  bool wanted = false;  ///< also where nothing has such protection
  std::string topic = "/diagnostics";
  Duration period = std::chrono::seconds{1};  ///< and at each change of a state
  documents::Mark mark;                       ///< of the topic
};

/// Where the running bridge is looked at over HTTP.
struct ConsoleSettings {
  Endpoint at{IpAddress::v4(127, 0, 0, 1), default_port};
  std::string token_file{};  ///< what whoever asks has to have; empty: only this host may ask
  documents::Mark mark{};
  static constexpr std::uint16_t default_port = 9464;  ///< of exporters of OpenTelemetry
};

/// Which of a route's ends exist only while there is somebody at the other one.
struct Presence {
  /// dds_to_someip: the service is offered only while the topic has a publisher, and so have those of all
  /// other such routes of the service instance.
  bool offer_while_published = false;
  /// someip_to_dds: the topic is written to only while the service is offered: nodes see it come and go.
  bool write_while_offered = false;
  /// someip_to_dds: the eventgroup is subscribed to only while the topic has a subscriber.
  bool subscribe_while_read = false;
  friend constexpr bool operator==(const Presence&, const Presence&) = default;
};

/// The getter of a field.
struct FieldGetter {
  someip::MethodId id{};
  std::optional<E2eSettings> e2e{};
  friend bool operator==(const FieldGetter&, const FieldGetter&) = default;
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
  std::uint32_t minor = 0;  ///< someip_to_dds: perhaps sd::any_minor
  Transport transport = Transport::udp;
  /// dds_to_someip: the port of the offered service, UDP and TCP alike; routes of the same service instance
  /// share it. someip_to_dds: the UDP port to receive events at; 0 lets the system choose.
  std::uint16_t port = 0;
  std::optional<MulticastSettings> multicast;  ///< dds_to_someip over UDP; of the whole eventgroup
  TpSettings tp;
  messages::MessageRules rules;
  /// The payload is a message of another type, and this is how they become each other. The rules are its.
  std::optional<messages::FieldMapping> mapping{};
  QosSettings qos;
  Presence presence;
  std::optional<E2eSettings> e2e;
  /// dds_to_someip, transient local: the getter of the field whose notifier the event is. It is answered with
  /// the last sample.
  std::optional<FieldGetter> getter;
  /// dds_to_someip: addresses of other bridges; what they brought to the topic from SOME/IP is carried, too.
  std::vector<IpAddress> from_bridges{};
  /// Who may subscribe to the eventgroup (and call the getter), or offer the service; empty: everybody.
  std::vector<sd::Subnet> peers{};
  documents::Mark mark;  ///< where the route begins, for messages about it
};

/// Ids of services, both ends included.
struct ServiceRange {
  someip::ServiceId first{};
  someip::ServiceId last{};
  [[nodiscard]] constexpr bool has(someip::ServiceId id) const noexcept { return first <= id && id <= last; }
  friend constexpr bool operator==(const ServiceRange&, const ServiceRange&) = default;
};

/// Topics by their names, each of which gets a route of its own: dds_to_someip while somebody else publishes
/// it, someip_to_dds if the lock file has it. A topic belongs to the first pattern that matches it.
struct TopicPattern {
  std::string topics;                ///< "/sensing/**", see topic_pattern.hpp
  std::vector<std::string> exclude;  ///< patterns of those that it leaves out
  ServiceRange services;             ///< dds_to_someip: what the ids of their services are chosen from
  std::size_t max_routes = 200;      ///< dds_to_someip: topics that get an id at most, ever
  bool follow_reliability = false;   ///< dds_to_someip: as the topic's publishers have it
  bool follow_durability = false;    ///< likewise; someip_to_dds: as the lock file says
  Route route;                       ///< what the routes have in common: all but topic, type and service
  documents::Mark mark;              ///< where the pattern begins, for messages about it
};

/// A discovered topic and the id that its service has for ever.
struct LockedTopic {
  std::string topic;
  std::string type;
  someip::ServiceId service{};
  bool transient_local = false;  ///< when it got its id: latched by its publishers, or by the pattern
  documents::Mark mark{};        ///< in the lock file; none if it was not read from there
};

/// Who answers the calls of a method.
enum class Server : std::uint8_t {
  someip,  ///< a SOME/IP service: ROS clients call it
  ros,     ///< a ROS service: SOME/IP clients call it
};

/// How ROS requests and replies find each other: see dds::RosForm.
enum class ServiceForm : std::uint8_t { automatic, fastrtps, cyclonedds };

/// One ROS service, joined with one SOME/IP method.
struct MethodRoute {
  std::string ros_service;  ///< absolute: "/arm/set_mode"
  std::string type;         ///< "std_srvs/srv/SetBool"
  /// Otherwise the method is the getter or setter of a field ...
  messages::FieldAccess access = messages::FieldAccess::none;
  std::string value_type{};  ///< ... whose values are messages of this type
  Server server = Server::someip;
  someip::ServiceId service{};
  someip::InstanceId instance{};
  someip::MethodId method{};
  std::uint8_t major = 1;
  std::uint32_t minor = 0;  ///< server: someip: perhaps sd::any_minor
  /// server: ros: by which it is offered, never nothing. server: someip: nothing is whatever is offered.
  std::optional<Transport> transport;
  std::uint16_t port = 0;        ///< server: ros: of the offered service
  bool offer_always = false;     ///< server: ros: not only while the ROS service is there
  bool fire_and_forget = false;  ///< the method has no answer
  Duration timeout = std::chrono::seconds{5};
  std::size_t max_calls = 256;  ///< that wait for an answer at once
  TpSettings tp;                ///< of requests with server: someip, of answers with server: ros
  ServiceForm form = ServiceForm::automatic;
  messages::MessageRules rules;  ///< of both messages, or of the field's value
  std::optional<E2eSettings> e2e;
  /// Of the setter of a field with server: someip: the getter that is called for the present value after the
  /// server has refused one.
  std::optional<FieldGetter> getter;
  std::optional<someip::MethodId> notifier;  ///< likewise, without a getter: what has told which value it has
  /// server: ros: addresses of other bridges; the ROS service may be one that they make of SOME/IP ones.
  std::vector<IpAddress> from_bridges{};
  std::vector<sd::Subnet> peers{};  ///< who may call it, or offer the service; empty: everybody
  documents::Mark mark;             ///< where the method begins, for messages about it
};

/// A whole configuration file.
struct BridgeConfig {
  std::string file;  ///< as named by the user, for messages
  SomeipSettings someip;
  DdsSettings dds;
  DiagnosticsSettings diagnostics;
  std::optional<ConsoleSettings> console{};  ///< nothing: there is none
  messages::TypePlaces types;  ///< folders with .msg packages, and the interfaces that are named
  /// In the file's order, as the methods and patterns, of which there is at least one. Then those that the
  /// lock file and patterns from SOME/IP make together.
  std::vector<Route> routes;
  std::vector<MethodRoute> methods;
  std::vector<TopicPattern> patterns;
  std::string lock_file;            ///< absolute or relative to the working directory; there with patterns
  std::vector<LockedTopic> locked;  ///< what it had when it was read, sorted by topic
};

}  // namespace trestle::carry
