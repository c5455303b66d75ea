#pragma once
#include <yaml-cpp/yaml.h>

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/documents/section.hpp"

/// The elements of the lists in a configuration, each read from its mapping; load.hpp puts them together.
namespace trestle::carry {

/// Keys whose values are good, with their places. Values of other keys must not be used.
using GoodKeys = std::map<std::string, documents::Mark, std::less<>>;

/// A route as it was read, which may be incomplete.
struct RouteInFile {
  Route route;
  GoodKeys good;
  documents::Mark type_mark;  ///< of the type's name itself, which may be merged in from elsewhere
};

/// A pattern; incomplete as a RouteInFile.
struct PatternInFile {
  TopicPattern pattern;
  GoodKeys good;
};

/// A method; incomplete as a RouteInFile.
struct MethodInFile {
  MethodRoute method;
  GoodKeys good;
  documents::Mark type_mark;
  const char* type_key = "type";  ///< what that place is the value of
};

/// A field as what it is made of: a latched topic that is a notifier, and services that are getter and
/// setter.
struct FieldInFile {
  std::optional<RouteInFile> route;   ///< if it has a notifier
  std::vector<MethodInFile> methods;  ///< getter, unless the route answers it, and setter
};

/// A ROS action as what it is made of on both sides: three services and two topics.
struct ActionInFile {
  std::array<MethodInFile, 3> methods;  ///< send_goal, cancel_goal, get_result
  std::array<RouteInFile, 2> routes;    ///< feedback, status
};

[[nodiscard]] RouteInFile load_route(const YAML::Node& node, documents::Problems& problems);
[[nodiscard]] PatternInFile load_pattern(const YAML::Node& node, documents::Problems& problems);
[[nodiscard]] MethodInFile load_method(const YAML::Node& node, documents::Problems& problems);
[[nodiscard]] FieldInFile load_field(const YAML::Node& node, documents::Problems& problems);
[[nodiscard]] ActionInFile load_action(const YAML::Node& node, documents::Problems& problems);

// What several kinds of elements have in common.

/// The mapping of an element, which takes note of the keys whose values are good.
class Element : public documents::Section {
 public:
  Element(const YAML::Node& node, const char* name, GoodKeys& good, documents::Problems& problems)
      : Section{node, name, problems}, name_{name}, good_{good} {}

  template <typename T>
  bool require(const char* key, const documents::Format<T>& format, T& into) {
    return Section::require(key, format, into) && note(key);
  }
  template <typename T>
  bool read_good(const char* key, const documents::Format<T>& format, T& into) {
    return read(key, format, into) && note(key);
  }
  /// @return true.
  bool note(const char* key) { return note(key, key); }
  /// The same of a key under which others look for it.
  bool note(const char* key, const char* as) {
    good_.emplace(as, use_mark(key));
    return true;
  }
  [[nodiscard]] bool has(const char* key) const { return good_.contains(key); }
  /// "route", "method", ...
  [[nodiscard]] const std::string& name() const noexcept { return name_; }

 private:
  std::string name_;
  GoodKeys& good_;
};

/// A ROS topic, absolute, and the type of its messages.
[[nodiscard]] documents::Format<std::string> topic_name();
[[nodiscard]] documents::Format<std::string> type_name();
/// A ROS service, absolute, and its type.
[[nodiscard]] documents::Format<std::string> service_name();
[[nodiscard]] documents::Format<std::string> service_type_name();
[[nodiscard]] documents::Format<Direction> direction();
[[nodiscard]] documents::Format<Transport> udp_or_tcp();
/// Whether it is transient local.
[[nodiscard]] documents::Format<bool> durability();
/// The largest payload.
[[nodiscard]] documents::Format<std::size_t> message_size();
[[nodiscard]] documents::Format<std::uint16_t> port_number();
/// 0x0000 and 0xffff name no service; 0xfffe is reserved for services that are not SOME/IP.
/// [feat_req_someip_627]
[[nodiscard]] documents::Format<someip::ServiceId> service_id();
/// Of instances, eventgroups, methods and events.  [feat_req_someip_579]
template <typename Id>
[[nodiscard]] documents::Format<Id> id_of(std::uint64_t min = 0x0001, std::uint64_t max = 0xfffe) {
  return documents::as<Id>(documents::id_number(min, max));
}

/// Warns of an event whose id looks like that of a method.
void check_event_id(const documents::Section& section, someip::MethodId event, documents::Problems& problems);
/// Warns of a method whose id, under `key`, looks like that of an event.
void check_method_id(const documents::Section& section, const char* key, someip::MethodId method,
                     documents::Problems& problems);

/// Reads how large messages are sent in segments, which `tp` tells.
void load_pacing(documents::Section& tp, TpSettings& settings);
/// Reads `major` and `minor` of a service.
/// @param asked_for  whether somebody else offers it: then `minor` may be any, and is sd::any_minor unless
/// given.
void load_version(Element& element, bool asked_for, std::uint8_t& major, std::uint32_t& minor);

/// Reads what routes and patterns of them have in common: port, version, wire, tp, peers. The direction must
/// have been read.
void load_carriage(Element& element, Route& route, documents::Problems& problems);
/// After the port. @param format  of the words that there are.
void load_transport(documents::Section& section, const documents::Format<Transport>& format, Route& route,
                    documents::Problems& problems);
/// @param can_follow  whether there are publishers that `as_published` can mean.
void load_qos(const YAML::Node& node, QosSettings& settings, bool can_follow, documents::Problems& problems);
/// @param known  the route's direction, if it is good.
void load_presence(documents::Section& section, std::optional<Direction> known, Presence& into,
                   documents::Problems& problems);
/// Reads `from_bridges`. @param is_right whether the key may be there; if not, the error names `whom`.
void load_from_bridges(documents::Section& section, bool is_right, const std::string& whom,
                       std::vector<IpAddress>& into, documents::Problems& problems);
/// Reads `map` of a route, and what belongs to it: `payload`, `drop`, `constants`, `others`.
void load_map(Element& element, std::optional<messages::FieldMapping>& into, documents::Problems& problems);
/// Reads `multicast` of a thing with an eventgroup. Call it after direction and transport have been read.
void load_multicast(Element& element, Route& route, documents::Problems& problems);
/// Reads whether somebody has to read the topic. @param is_right  whether the key may be there ...
/// @param whom  where it may be: "routes with direction: someip_to_dds".
void load_subscribe(documents::Section& section, bool is_right, const char* whom, Presence& into,
                    documents::Problems& problems);

/// Reads who answers: `server`, and the ids of the service and its instance.
void load_service(Element& element, MethodRoute& method);
/// Reads what else methods, fields and actions have in common: how they are offered, version, limits of
/// calls, rules.
void load_calls(Element& element, MethodRoute& method, documents::Problems& problems);
/// A topic of a field or an action, with what is common to its methods.
[[nodiscard]] RouteInFile route_beside(const MethodInFile& common, std::string topic, std::string type);

/// Reads `e2e` of a route.
/// @param known  the route's direction, if it is good.
[[nodiscard]] std::optional<E2eSettings> load_e2e(const YAML::Node& node, std::optional<Direction> known,
                                                  documents::Problems& problems);
/// Reads `e2e` of a method.
/// @param known  its `server`, if that is good.
[[nodiscard]] std::optional<E2eSettings> load_method_e2e(const YAML::Node& node, std::optional<Server> known,
                                                         documents::Problems& problems);

/// An event or a method that a field or an action has.
struct E2ePart {
  const char* key;
  bool is_event = false;
  std::optional<E2eSettings>* into = nullptr;
};
/// Reads `e2e` of a field or an action, which has a mapping for each of its parts.
/// @param known  whose they are, if that is good.
void load_e2e_of_parts(documents::Section& section, std::optional<Server> known,
                       std::initializer_list<E2ePart> parts, documents::Problems& problems);

}  // namespace trestle::carry
