#pragma once
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "bridge/describe/interfaces.hpp"
#include "bridge/inspect/tools/traffic_view.hpp"
#include "bridge/traffic/network_view.hpp"

/// What is seen of a network, in words and in JSON. docs/tools.md documents both. `names` are interface
/// descriptions, by which services have names; null: none.
namespace trestle::inspect {

/// "2026-11-21T09:20:44.321Z", of wall-clock time.
[[nodiscard]] std::string time_text(TimePoint time);

/// "0x1234.0x0001  1.0  udp 10.0.0.5:30509  by 10.0.0.5  ttl 3 s"
[[nodiscard]] std::string describe(const traffic::SeenService& service,
                                   const describe::Interfaces* names = nullptr);
/// The same, after what happened to it: "offered     ".
[[nodiscard]] std::string describe(const traffic::Sighting& sighting,
                                   const describe::Interfaces* names = nullptr);

/// "0x1234.0x0001", or "Door.0x0001".
[[nodiscard]] std::string service_text(someip::ServiceId service, someip::InstanceId instance,
                                       std::uint8_t major, const describe::Interfaces* names);
/// "0x0001", or its name.
[[nodiscard]] std::string eventgroup_text(someip::ServiceId service, someip::EventgroupId eventgroup,
                                          const describe::Interfaces* names);

/// "udp 10.0.0.5:30509  tcp 10.0.0.5:30510", of those that there are.
[[nodiscard]] std::string endpoints(const std::optional<Endpoint>& udp, const std::optional<Endpoint>& tcp,
                                    const std::optional<Endpoint>& multicast = {});

/// Adds the fields of a service, "service" to "ttl", to an object.
void add_service(nlohmann::ordered_json& object, const traffic::SeenService& service,
                 const describe::Interfaces* names = nullptr);
void add_subscription(nlohmann::ordered_json& object, const traffic::SeenSubscription& subscription,
                      const describe::Interfaces* names = nullptr);
/// One line.
/// @param time  empty: without.
[[nodiscard]] std::string to_json(const traffic::Sighting& sighting, const std::string& time = {},
                                  const describe::Interfaces* names = nullptr);

/// Which instance of a service is at an endpoint, which is not told in messages; and what things are called.
class InstanceNames {
 public:
  explicit InstanceNames(const traffic::NetworkView& network, const describe::Interfaces* names = nullptr);
  [[nodiscard]] std::optional<someip::InstanceId> instance_of(const SeenTraffic& row) const;
  /// "0x1234.0x0001", or "0x1234.?" when nobody offered it.
  [[nodiscard]] std::string of(const SeenTraffic& row) const;
  /// "event 0x8001", "method open".
  [[nodiscard]] std::string traffic_of(const SeenTraffic& row) const;
  /// Adds "service_name" and the name of the event, method or field.
  void add_names(nlohmann::ordered_json& object, const SeenTraffic& row) const;

 private:
  [[nodiscard]] const describe::ServiceElement* element(const SeenTraffic& row) const;

  const describe::Interfaces* names_;
  std::map<std::tuple<someip::ServiceId, Transport, Endpoint>, someip::InstanceId> instances_;
};

}  // namespace trestle::inspect
