#pragma once
#include <yaml-cpp/yaml.h>

#include <map>
#include <string>

#include "bridge/documents/format.hpp"
#include "bridge/documents/problems.hpp"

namespace trestle::bridge {

class Section;

/// A route as it was read, which may be incomplete.
struct RouteInFile {
  Route route;
  /// The keys whose values are good, and where the route says so: what is missing here must not be looked at.
  std::map<std::string, Mark, std::less<>> good;
  Mark type_mark;  ///< of the type's name itself, which may be merged in from elsewhere
};

/// A ROS topic, absolute.
[[nodiscard]] Format<std::string> topic_name();

/// The type of its messages.
[[nodiscard]] Format<std::string> type_name();

[[nodiscard]] Format<Transport> udp_or_tcp();

/// Whether it is transient local.
[[nodiscard]] Format<bool> durability();

/// Warns of an event whose id looks like that of a method.
void check_event_id(const Section& section, someip::MethodId event, Problems& problems);

/// The largest payload.
[[nodiscard]] Format<std::size_t> message_size();
/// Reads how large messages are sent in segments, which `tp` tells.
void load_pacing(Section& tp, TpSettings& settings);

/// Reads what routes and patterns of them have in common: port, version, wire, tp. The direction must have
/// been read.
void load_carriage(Section& section, RouteInFile& into, Problems& problems);
/// After the port. @param format  of the words that there are.
void load_transport(Section& section, const Format<Transport>& format, Route& route, Problems& problems);
/// @param can_follow  whether there are publishers that `as_published` can mean.
void load_qos(const YAML::Node& node, QosSettings& settings, bool can_follow, Problems& problems);
/// @param known  the route's direction, if it is good.
void load_presence(Section& section, std::optional<Direction> known, Presence& into, Problems& problems);

/// Reads `from_bridges`. @param is_right  the key is for such a thing; else it is an error that names `whom`.
void load_from_bridges(Section& section, bool is_right, const char* whom, std::vector<IpAddress>& into,
                       Problems& problems);

/// Reads `multicast` of what is carried by an eventgroup. After direction and transport.
void load_multicast(Section& section, RouteInFile& into, Problems& problems);
/// Reads whether somebody has to read the topic. @param is_right  whether the key may be there ...
/// @param whom  ... else what it is for: "routes with direction: someip_to_dds".
void load_subscribe(Section& section, bool is_right, const char* whom, Presence& into, Problems& problems);

/// Reads one element of `routes`.
[[nodiscard]] RouteInFile load_route(const YAML::Node& node, Problems& problems);

}  // namespace trestle::bridge
