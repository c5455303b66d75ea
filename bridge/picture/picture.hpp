// bridge/picture: what a running bridge tells of itself.
//
//   picture.hpp        all of it at one moment, as plain values; made by bridge/carry/runtime
//   picture_json.hpp   the same as JSON, both ways
//   id_names.hpp       what interface descriptions call the ids in it
//   seen_message.hpp   a copy of a message, for viewers of a route
//   causes.hpp         why nothing flows on a route, in words: from the picture alone
//
// Knows no socket, no DDS and no SOME/IP: status, console and metrics read nothing else.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace trestle::carry {

/// Quality of service of a reader or writer. Of times, 0 is none.
struct QosPicture {
  bool reliable = true;
  bool transient_local = false;
  std::uint32_t depth = 0;  ///< 0: not known, as of others
  bool keep_all = false;
  double deadline_s = 0;
  double liveliness_s = 0;
  bool manual_liveliness = false;
  friend bool operator==(const QosPicture&, const QosPicture&) = default;
};

/// Somebody else's writer in DDS.
struct WriterPicture {
  std::string topic;  ///< the ROS name where it has one
  std::string type;   ///< likewise
  std::string node;   ///< empty: not known
  QosPicture qos;
  bool bridge = false;   ///< the end of another bridge
  bool refused = false;  ///< its definition of the type is another: `types: strict`
};

/// A service that somebody else offers.
struct OfferPicture {
  std::uint16_t service = 0;
  std::uint16_t instance = 0;
  std::uint32_t major = 0;
  std::uint32_t minor = 0;
  std::string host;
};

/// A service of ours.
struct OwnOfferPicture {
  std::uint16_t service = 0;
  std::uint16_t instance = 0;
  std::uint32_t major = 0;
  std::uint32_t minor = 0;
  std::uint32_t udp_port = 0;  ///< 0: none, or one that the system chose
  std::uint32_t tcp_port = 0;
  bool offered = false;  ///< now
};

/// Another host in SOME/IP service discovery.
struct HostPicture {
  std::string address;
  std::uint32_t port = 0;
  double seen_s = 0;             ///< ago
  std::uint32_t offers = 0;      ///< services of it that are known
  std::uint32_t subscribed = 0;  ///< its subscriptions to ours
};

/// Another participant in DDS.
struct ParticipantPicture {
  std::string name;
  std::string guid;                    ///< its prefix, as hexadecimal digits
  std::vector<std::string> addresses;  ///< without ports
};

/// A counter.
struct CounterPicture {
  std::string name;
  std::uint64_t count = 0;
  std::string kind;  ///< "traffic", "loss", "doubt" (perhaps lost), or "now": how many there are
};

/// How long something took, of all messages since the start, in nanoseconds.
struct LatencyPicture {
  /// Values that are counted together.
  struct Bucket {
    std::int64_t up_to_ns = 0;  ///< the largest value of it
    std::uint64_t count = 0;
  };
  std::uint64_t count = 0;
  std::int64_t min_ns = 0;
  std::int64_t p50_ns = 0;
  std::int64_t p90_ns = 0;
  std::int64_t p99_ns = 0;
  std::int64_t p999_ns = 0;
  std::int64_t max_ns = 0;
  double sum_ns = 0;
  std::vector<Bucket> buckets;  ///< that are not empty, by value
};

/// A message that was among the slowest of the last one or two minutes.
struct SlowMessagePicture {
  std::int64_t at_ns = 0;       ///< when it came, since 1970
  std::int64_t source_ns = -1;  ///< of these: since its source says that it was written; -1: not known
  std::int64_t waited_ns = 0;   ///< from when it came until its conversion
  std::int64_t convert_ns = 0;
  std::int64_t send_ns = 0;  ///< until it was handed on
  std::uint64_t bytes = 0;
  std::uint32_t session = 0;  ///< in SOME/IP
};

/// The end of a route in SOME/IP.
struct SomeipEndPicture {
  // Of a service of others:
  std::vector<OfferPicture> offers;  ///< of this service, of whatever instance and version
  bool wanted = false;               ///< it is to be subscribed to now
  bool subscribed = false;
  bool refused = false;        ///< a server has refused the subscription
  bool over_tcp_only = false;  ///< it is offered, but not over TCP as the route wants
  std::uint64_t other_events = 0;
  std::vector<std::uint16_t> other_ids;  ///< of these, the first few
  // Of a service of ours:
  bool offered = false;
  std::uint32_t subscribers = 0;
};

/// The end of a route in DDS.
struct DdsEndPicture {
  QosPicture qos;
  bool open = false;                   ///< there is a reader, writer, client or server
  std::uint32_t matched = 0;           ///< counterparts
  std::uint64_t incompatible_qos = 0;  ///< readers that do not match, of a writer
  std::vector<WriterPicture> writers;  ///< of the topic, whatever their type, of a reader
};

/// A pattern of topics.
struct PatternEndPicture {
  std::uint32_t routes = 0;  ///< that it has now
  std::uint32_t topics = 0;  ///< that match, and that others publish
  bool brought = false;      ///< what matches comes from other bridges
  bool locked = true;        ///< someip_to_dds: the lock file has topics for it
  std::string lock_file;
};

/// Why nothing flows.
struct CausePicture {
  std::string name = "none";  ///< of the list in docs/status.md
  std::string words;          ///< empty: nothing is amiss
};

/// How a route is.
enum class RouteState : std::uint8_t {
  flowing,  ///< something was carried in the last seconds
  idle,     ///< nothing is amiss, and there is nothing to carry; or it waits on purpose
  waiting,  ///< nothing has come yet, or nobody takes it: the cause says why
  failing,  ///< messages come and are not carried, by a fault: the cause says which
};

/// A route, method, getter or pattern of the configuration.
struct RoutePicture {
  /// "topic_to_event", "event_to_topic", "service_to_method", "method_to_service", "getter_to_topic" or
  /// "pattern".
  std::string kind;
  std::string name;       ///< topic, ROS service or pattern
  std::string direction;  ///< "dds_to_someip" or "someip_to_dds"
  std::string type;
  std::uint16_t service = 0;
  std::uint16_t instance = 0;
  std::uint16_t member = 0;  ///< event or method
  std::uint16_t eventgroup = 0;
  // In the interface descriptions of the configuration; empty: they do not have it.
  std::string service_name;
  std::string member_name;            ///< "moved"; of a part of a field "opening.get"
  std::string eventgroup_name;        ///< where it has no name: what is in it, "moved, level"
  bool service_id_is_chosen = false;  ///< they do not give it: Trestle chose it
  bool member_id_is_chosen = false;
  bool eventgroup_id_is_chosen = false;
  std::uint32_t major = 0;
  std::uint32_t minor = 0;  ///< 0xffffffff: any
  std::string transport;    ///< "udp", "tcp" or empty: as offered
  std::uint32_t line = 0;   ///< in the configuration; 0: none

  std::uint64_t received = 0;
  std::uint64_t carried = 0;
  std::uint64_t bytes = 0;  ///< of these, in SOME/IP form or DDS form, as they were sent
  double per_second = 0;    ///< carried
  double bytes_per_second = 0;
  std::int64_t last_ns = 0;          ///< when the last one came, since 1970; 0: none has
  std::int64_t last_carried_ns = 0;  ///< likewise, that was carried
  std::vector<CounterPicture> counters;
  LatencyPicture conversion;
  /// dds_to_someip: from when the source says that it wrote it until it was handed to the system, which needs
  /// clocks that agree. someip_to_dds: from when it was received as a whole until DDS had it.
  LatencyPicture path;
  std::vector<SlowMessagePicture> slowest;  ///< the slowest first

  SomeipEndPicture someip;
  DdsEndPicture dds;
  PatternEndPicture pattern;
  std::uint32_t in_use = 0;  ///< messages that wait, or calls that are under way ...
  std::uint32_t limit = 0;   ///< ... of so many
  RouteState state = RouteState::idle;
  CausePicture cause;
};

/// SOME/IP around the bridge.
struct SomeipPicture {
  std::string address;
  std::string interface;  ///< empty: the one that has the address
  /// Not empty: the interface that has our address, instead of the configured one; in words.
  std::string other_interface;
  std::uint32_t port = 30490;            ///< of service discovery
  std::uint64_t discovery_received = 0;  ///< SD messages of others that were heard
  std::uint64_t outside_subnet = 0;      ///< datagrams from addresses that are no peer's, which were not
  std::uint64_t reboots = 0;             ///< of others, that were noticed
  std::uint32_t heard = 0;               ///< other hosts
  std::vector<HostPicture> hosts;
  std::vector<OfferPicture> offers;  ///< of others
  std::vector<OwnOfferPicture> own_offers;
};

/// DDS around the bridge.
struct DdsPicture {
  std::uint32_t domain = 0;
  std::string guid;         ///< of our participant: what its GUIDs begin with
  std::uint32_t heard = 0;  ///< other participants
  std::vector<ParticipantPicture> participants;
  std::uint32_t writers = 0;  ///< of others, on any topic
  std::uint64_t not_remembered = 0;
};

/// A limit, and how full it is.
struct LimitPicture {
  std::string name;
  std::uint64_t used = 0;
  std::uint64_t limit = 0;
};

/// What was counted for all routes together.
struct CounterGroupPicture {
  std::string name;
  std::vector<CounterPicture> counters;
};

/// A running bridge at one moment.
struct Picture {
  /// Of the JSON form. Members may be added without a new version; it changes when one is removed, renamed or
  /// means something else.
  static constexpr std::uint32_t version = 1;
  std::string program;  ///< its version
  std::uint32_t pid = 0;
  std::string configuration;  ///< file, as it was named
  std::int64_t at_ns = 0;     ///< since 1970
  double running_s = 0;       ///< since the start, or since the configuration was read again
  bool stopping = false;
  SomeipPicture someip;
  DdsPicture dds;
  std::vector<RoutePicture> routes;
  std::vector<LimitPicture> limits;
  std::vector<CounterGroupPicture> counters;
};

}  // namespace trestle::carry
