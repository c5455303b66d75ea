// bridge/describe/write/routes: route files for `trestle bridge`.
//
//   route_entries.hpp  what one member of a service is in a route file, as YAML
//   action_entries.hpp  the parts of an action as one entry
//   lost_names.hpp, lost_settings.hpp  what a file lacks that does not name the descriptions
//   write_routes.hpp   a whole file
//
// A bridge that is given descriptions in place of a file takes the same entries: what is written and what is
// used can't differ.
#pragma once
#include <yaml-cpp/yaml.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bridge/describe/lower.hpp"
#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// What the bridge is in SOME/IP.
enum class Side : std::uint8_t {
  client,  ///< it uses a service of the car: events become topics, ROS nodes call methods
  server,  ///< it offers a service of ROS nodes: topics become events, ROS services answer
};

struct RouteOptions {
  /// Nothing: client of provided instances, server of required ones and of what ROS nodes have.
  std::optional<Side> side{};
  std::string prefix = "/";          ///< of topics and services; "/car/"
  std::uint16_t first_port = 30501;  ///< of offered services, for those that have no port
};

/// The port at which we offer the service, by UDP and TCP alike: that of the instance if we take its place,
/// of UDP if it has two; else `otherwise`.
[[nodiscard]] std::uint16_t offer_port(const Instance& instance, std::uint16_t otherwise);

/// An entry of a route file.
struct RouteEntry {
  std::string list;               ///< where it belongs: "routes", "methods", "fields", "actions"
  std::string element;            ///< "Door.moved"
  std::string member;             ///< "moved"; member_key()
  std::string service;            ///< full name: "car.Door"
  someip::InstanceId instance{};  ///< of the service
  YAML::Node node;
};

/// Takes out entries. std::erase_if is not for them: it assigns one to another, and a YAML::Node that is
/// assigned to changes with it all that it shares its content with.
template <typename IsOut>
void take_out(std::vector<RouteEntry>& entries, IsOut is_out) {
  std::vector<RouteEntry> kept;
  kept.reserve(entries.size());
  for (RouteEntry& entry : entries) {
    if (!is_out(entry)) {
      kept.push_back(std::move(entry));
    }
  }
  entries.swap(kept);
}

/// A member of a service. Members of different kinds may have one name.
struct RouteMember {
  LoweredMember::Kind kind = LoweredMember::Kind::event;
  std::size_t index = 0;              ///< of the service's events, methods or fields
  bool is_notifier_of_field = false;  ///< the notifier alone, as an event
};

/// Makes entries. Topics and services have the names of the members, after that of the service; where several
/// services or members of the model would have one name, they get what tells them apart: the scope, the id,
/// a number.
class RouteEntries {
 public:
  /// All of these outlive it.
  RouteEntries(const Model& model, const Lowered& lowered, const RouteOptions& options);

  /// The entries of one instance, those of events, methods and fields in this order.
  /// @param port  of the service, where the bridge is the server.
  [[nodiscard]] std::vector<RouteEntry> of(const Service& service, const Instance& instance, Side side,
                                           std::uint16_t port, std::vector<NotCarried>& not_carried) const;
  /// That of one member; nothing: it cannot be carried.
  [[nodiscard]] std::optional<RouteEntry> of(const Service& service, const Instance& instance, Side side,
                                             std::uint16_t port, RouteMember member,
                                             std::vector<NotCarried>& not_carried) const;

  /// "/car/door", with the instance where the service has several.
  [[nodiscard]] std::string prefix_of(const Service& service, const Instance& instance) const;
  /// That of the options, with a / at its end.
  [[nodiscard]] std::string prefix() const {
    return options_.prefix.ends_with('/') ? options_.prefix : options_.prefix + "/";
  }
  [[nodiscard]] const Model& model() const noexcept { return model_; }
  [[nodiscard]] const Lowered& lowered() const noexcept { return lowered_; }

 private:
  const Model& model_;
  const Lowered& lowered_;
  const RouteOptions& options_;
  std::map<const Service*, std::string> names_{};  ///< "door", "org_example/door"
  std::map<std::string, std::set<someip::InstanceId>, std::less<>> instances_{};  ///< by full name
};

/// The entries of all instances of the model, one of each service and id.
[[nodiscard]] std::vector<RouteEntry> route_entries(const Model& model, const Lowered& lowered,
                                                    const RouteOptions& options,
                                                    std::vector<NotCarried>& not_carried);

}  // namespace trestle::describe
