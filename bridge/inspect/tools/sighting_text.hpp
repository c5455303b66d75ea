#pragma once
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "bridge/inspect/tools/traffic_view.hpp"
#include "bridge/traffic/network_view.hpp"

/// What is seen of a network, in words and in JSON. docs/tools.md documents both.
namespace trestle::inspect {

/// "2026-11-21T09:20:44.321Z", of wall-clock time.
[[nodiscard]] std::string time_text(TimePoint time);

/// "0x1234.0x0001  1.0  udp 10.0.0.5:30509  by 10.0.0.5  ttl 3 s"
[[nodiscard]] std::string describe(const traffic::SeenService& service);
/// The same, after what happened to it: "offered     ".
[[nodiscard]] std::string describe(const traffic::Sighting& sighting);

/// "udp 10.0.0.5:30509  tcp 10.0.0.5:30510", of those that there are.
[[nodiscard]] std::string endpoints(const std::optional<Endpoint>& udp, const std::optional<Endpoint>& tcp,
                                    const std::optional<Endpoint>& multicast = {});

/// Adds the fields of a service, "service" to "ttl", to an object.
void add_service(nlohmann::ordered_json& object, const traffic::SeenService& service);
void add_subscription(nlohmann::ordered_json& object, const traffic::SeenSubscription& subscription);
/// One line.
/// @param time  empty: without.
[[nodiscard]] std::string to_json(const traffic::Sighting& sighting, const std::string& time = {});

/// Which instance of a service is at an endpoint, which is not told in messages.
class InstanceNames {
 public:
  explicit InstanceNames(const traffic::NetworkView& network);
  [[nodiscard]] std::optional<someip::InstanceId> instance_of(const SeenTraffic& row) const;
  /// "0x1234.0x0001", or "0x1234.?" when nobody offered it.
  [[nodiscard]] std::string of(const SeenTraffic& row) const;

 private:
  std::map<std::tuple<someip::ServiceId, Transport, Endpoint>, someip::InstanceId> instances_;
};

}  // namespace trestle::inspect
