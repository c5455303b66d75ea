#include "bridge/inspect/tools/sighting_text.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "bridge/describe/eventgroup_title.hpp"
#include "bridge/inspect/decode/names_json.hpp"
#include "sd/net/discovery_text.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::inspect {
namespace {

std::string version(const traffic::SeenService& service) {
  return fmt::format("{}.{}", service.major == sd::any_major ? "*" : std::to_string(service.major),
                     service.minor == sd::any_minor ? "*" : std::to_string(service.minor));
}

std::string by(const traffic::SeenService& service) {
  return "by " + someip::to_string(service.peer.address);
}

template <typename Seen>
std::string lifetime(const Seen& seen) {
  return seen.expires_ever() ? fmt::format("ttl {} s", seen.ttl_s) : "until reboot";
}

/// With two spaces before them, if there are any.
template <typename Seen>
std::string endpoints_of(const Seen& seen) {
  const std::string text = endpoints(seen.udp, seen.tcp);
  return text.empty() ? text : "  " + text;
}

template <typename Seen>
void add_endpoints(nlohmann::ordered_json& object, const Seen& seen) {
  if (seen.udp) {
    object["udp"] = someip::to_string(*seen.udp);
  }
  if (seen.tcp) {
    object["tcp"] = someip::to_string(*seen.tcp);
  }
}

/// A subscription, after what happened to it.
std::string describe(traffic::Sighting::Kind kind, const traffic::SeenSubscription& one,
                     const describe::Interfaces* names) {
  std::string text =
      fmt::format("{:<12}  {}  eventgroup {}  by {}  at {}", to_string(kind),
                  service_text(one.service, one.instance, one.major, names),
                  eventgroup_text(one.service, one.eventgroup, names),
                  someip::to_string(one.subscriber.address), someip::to_string(one.server.address));
  if (kind == traffic::Sighting::Kind::subscribed) {
    text += endpoints_of(one) + "  " + lifetime(one);
  }
  if (kind == traffic::Sighting::Kind::acknowledged && one.multicast) {
    text += "  multicast " + someip::to_string(*one.multicast);
  }
  return text;
}

}  // namespace

std::string service_text(someip::ServiceId service, someip::InstanceId instance, std::uint8_t major,
                         const describe::Interfaces* names) {
  if (names == nullptr || names->service(service) == nullptr) {
    return sd::to_string(service, instance);
  }
  return names->name_of(service, major) + "." +
         (instance == someip::any_instance ? "*" : sd::hexadecimal(someip::value(instance)));
}

std::string eventgroup_text(someip::ServiceId service, someip::EventgroupId eventgroup,
                            const describe::Interfaces* names) {
  const auto title = describe::title_of(names == nullptr ? nullptr : names->service(service), eventgroup);
  if (title.is_name) {
    return title.text;
  }
  const std::string id = sd::hexadecimal(someip::value(eventgroup));
  return title.text.empty() ? id : fmt::format("{} ({})", id, title.text);
}

std::string time_text(TimePoint time) {
  const auto since_1970 = std::chrono::floor<std::chrono::milliseconds>(time.time_since_epoch());
  return fmt::format(
      "{:%FT%T}.{:03}Z",
      fmt::gmtime(static_cast<std::time_t>(std::chrono::floor<std::chrono::seconds>(since_1970).count())),
      since_1970.count() % 1000);
}

std::string endpoints(const std::optional<Endpoint>& udp, const std::optional<Endpoint>& tcp,
                      const std::optional<Endpoint>& multicast) {
  std::string text;
  const auto add = [&](const char* what, const std::optional<Endpoint>& endpoint) {
    if (endpoint) {
      text += fmt::format("{}{} {}", text.empty() ? "" : "  ", what, someip::to_string(*endpoint));
    }
  };
  add("udp", udp);
  add("tcp", tcp);
  add("multicast", multicast);
  return text;
}

std::string describe(const traffic::SeenService& service, const describe::Interfaces* names) {
  return service_text(service.service, service.instance, service.major, names) + "  " + version(service) +
         endpoints_of(service) + "  " + by(service) + "  " + lifetime(service);
}

std::string describe(const traffic::Sighting& sighting, const describe::Interfaces* names) {
  if (sighting.subscription) {
    return describe(sighting.kind, *sighting.subscription, names);
  }
  const traffic::SeenService& service = sighting.service;
  if (sighting.kind == traffic::Sighting::Kind::offered ||
      sighting.kind == traffic::Sighting::Kind::changed) {
    return fmt::format("{:<12}  {}", to_string(sighting.kind), describe(service, names));
  }
  return fmt::format("{:<12}  {}  {}  {}", to_string(sighting.kind),
                     service_text(service.service, service.instance, service.major, names), version(service),
                     by(service));
}

void add_service(nlohmann::ordered_json& object, const traffic::SeenService& service,
                 const describe::Interfaces* names) {
  object["service"] = sd::hexadecimal(someip::value(service.service));
  if (names != nullptr && names->service(service.service) != nullptr) {
    object["service_name"] = names->name_of(service.service, service.major);
  }
  object["instance"] = sd::hexadecimal(someip::value(service.instance));
  object["major_version"] = service.major;
  object["minor_version"] = service.minor;
  add_endpoints(object, service);
  object["peer"] = someip::to_string(service.peer);
  object["ttl"] = service.ttl_s;
}

void add_subscription(nlohmann::ordered_json& object, const traffic::SeenSubscription& one,
                      const describe::Interfaces* names) {
  object["service"] = sd::hexadecimal(someip::value(one.service));
  if (names != nullptr && names->service(one.service) != nullptr) {
    object["service_name"] = names->name_of(one.service, one.major);
  }
  object["instance"] = sd::hexadecimal(someip::value(one.instance));
  object["major_version"] = one.major;
  object["eventgroup"] = sd::hexadecimal(someip::value(one.eventgroup));
  add_eventgroup_name(object, names, one.service, one.eventgroup);
  add_endpoints(object, one);
  if (one.multicast) {
    object["multicast"] = someip::to_string(*one.multicast);
  }
  object["peer"] = someip::to_string(one.subscriber);
  object["server"] = someip::to_string(one.server);
  object["ttl"] = one.ttl_s;
}

std::string to_json(const traffic::Sighting& sighting, const std::string& time,
                    const describe::Interfaces* names) {
  nlohmann::ordered_json object;
  if (!time.empty()) {
    object["time"] = time;
  }
  object["seen"] = to_string(sighting.kind);
  if (sighting.subscription) {
    add_subscription(object, *sighting.subscription, names);
  } else {
    add_service(object, sighting.service, names);
  }
  return object.dump();
}

InstanceNames::InstanceNames(const traffic::NetworkView& network, const describe::Interfaces* names)
    : names_{names} {
  for (const auto& [key, service] : network.services()) {
    if (service.udp) {
      instances_.try_emplace({service.service, Transport::udp, *service.udp}, service.instance);
    }
    if (service.tcp) {
      instances_.try_emplace({service.service, Transport::tcp, *service.tcp}, service.instance);
    }
  }
}

std::optional<someip::InstanceId> InstanceNames::instance_of(const SeenTraffic& row) const {
  const auto found = instances_.find({row.service, row.transport, row.server});
  return found == instances_.end() ? std::nullopt : std::optional{found->second};
}

std::string InstanceNames::of(const SeenTraffic& row) const {
  const auto instance = instance_of(row);
  if (const describe::ServiceElement* const known = element(row)) {
    return names_->name_of(known->service) +
           (instance ? "." + sd::hexadecimal(someip::value(*instance)) : std::string{".?"});
  }
  if (instance) {
    return service_text(row.service, *instance, 0, names_);
  }
  const bool is_named = names_ != nullptr && names_->service(row.service) != nullptr;
  return (is_named ? names_->name_of(row.service) : sd::hexadecimal(someip::value(row.service))) + ".?";
}

const describe::ServiceElement* InstanceNames::element(const SeenTraffic& row) const {
  // The rows do not tell versions apart.
  return names_ == nullptr ? nullptr : names_->element(row.service, 0, row.method);
}

std::string InstanceNames::traffic_of(const SeenTraffic& row) const {
  const char* const kind = row.event ? "event" : "method";
  const describe::ServiceElement* const known = element(row);
  if (known == nullptr) {
    return fmt::format("{} {}", kind, sd::hexadecimal(someip::value(row.method)));
  }
  return fmt::format("{} {}{}{}", kind, known->member_name, known->is_field() ? "." : "",
                     describe::field_part(known->part));
}

void InstanceNames::add_names(nlohmann::ordered_json& object, const SeenTraffic& row) const {
  if (const describe::ServiceElement* const known = element(row)) {
    inspect::add_names(object, *names_, *known);
  } else if (names_ != nullptr && names_->service(row.service) != nullptr) {
    object["service_name"] = names_->name_of(row.service);
  }
}

}  // namespace trestle::inspect
