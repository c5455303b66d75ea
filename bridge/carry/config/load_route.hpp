#pragma once
#include <yaml-cpp/yaml.h>
#include "bridge/carry/config/bridge_config.hpp"

#include <map>
#include <string>

#include "bridge/documents/format.hpp"
#include "bridge/documents/problems.hpp"

namespace trestle::documents {
class Section;
}  // namespace trestle::documents

namespace trestle::carry {

/// A route as it was read, which may be incomplete.
struct RouteInFile {
  Route route;
  /// The keys whose values are good, with their places. Values of other keys must not be used.
  std::map<std::string, documents::Mark, std::less<>> good;
  documents::Mark type_mark;  ///< of the type's name itself, which may be merged in from elsewhere
};

/// A ROS topic, absolute.
[[nodiscard]] documents::Format<std::string> topic_name();

/// The type of its messages.
[[nodiscard]] documents::Format<std::string> type_name();

[[nodiscard]] documents::Format<Transport> udp_or_tcp();

/// Whether it is transient local.
[[nodiscard]] documents::Format<bool> durability();

/// Warns of an event whose id looks like that of a method.
void check_event_id(const documents::Section& section, someip::MethodId event, documents::Problems& problems);

/// The largest payload.
[[nodiscard]] documents::Format<std::size_t> message_size();
/// Reads how large messages are sent in segments, which `tp` tells.
void load_pacing(documents::Section& tp, TpSettings& settings);

/// Reads what routes and patterns of them have in common: port, version, wire, tp. The direction must have
/// been read.
void load_carriage(documents::Section& section, RouteInFile& into, documents::Problems& problems);
/// After the port. @param format  of the words that there are.
void load_transport(documents::Section& section, const documents::Format<Transport>& format, Route& route,
                    documents::Problems& problems);
/// @param can_follow  whether there are publishers that `as_published` can mean.
void load_qos(const YAML::Node& node, QosSettings& settings, bool can_follow, documents::Problems& problems);
/// @param known  the route's direction, if it is good.
void load_presence(documents::Section& section, std::optional<Direction> known, Presence& into,
                   documents::Problems& problems);

/// Reads `from_bridges`. @param is_right whether the key may be there; if not, the error names `whom`.
void load_from_bridges(documents::Section& section, bool is_right, const char* whom,
                       std::vector<IpAddress>& into, documents::Problems& problems);

/// Reads `multicast` of a thing with an eventgroup. Call it after direction and transport have been read.
void load_multicast(documents::Section& section, RouteInFile& into, documents::Problems& problems);
/// Reads whether somebody has to read the topic. @param is_right  whether the key may be there ...
/// @param whom  where it may be: "routes with direction: someip_to_dds".
void load_subscribe(documents::Section& section, bool is_right, const char* whom, Presence& into,
                    documents::Problems& problems);

/// Reads one element of `routes`.
[[nodiscard]] RouteInFile load_route(const YAML::Node& node, documents::Problems& problems);

}  // namespace trestle::carry
