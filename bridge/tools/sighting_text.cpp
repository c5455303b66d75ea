#include "bridge/tools/sighting_text.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "sd/net/discovery_text.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::bridge {
namespace {

std::string version(const SeenService& service) {
  return fmt::format("{}.{}", service.major == sd::any_major ? "*" : std::to_string(service.major),
                     service.minor == sd::any_minor ? "*" : std::to_string(service.minor));
}

std::string by(const SeenService& service) {
  return "by " + someip::to_string(service.peer.address);
}

std::string lifetime(const SeenService& service) {
  return service.expires_ever() ? fmt::format("ttl {} s", service.ttl_s) : "until reboot";
}

}  // namespace

std::string describe(const SeenService& service) {
  std::string text = sd::to_string(service.service, service.instance) + "  " + version(service);
  if (service.udp) {
    text += "  udp " + someip::to_string(*service.udp);
  }
  if (service.tcp) {
    text += "  tcp " + someip::to_string(*service.tcp);
  }
  return text + "  " + by(service) + "  " + lifetime(service);
}

std::string describe(const Sighting& sighting) {
  const SeenService& service = sighting.service;
  const std::string id = sd::to_string(service.service, service.instance);
  switch (sighting.kind) {
    case Sighting::Kind::offered:
    case Sighting::Kind::changed:
      return fmt::format("{:<12}  {}", to_string(sighting.kind), describe(service));
    case Sighting::Kind::looked_for:
      return fmt::format("{:<12}  {}  {}  {}", to_string(sighting.kind), id, version(service), by(service));
    case Sighting::Kind::stopped:
    case Sighting::Kind::expired:
    case Sighting::Kind::rebooted:
      break;
    case Sighting::Kind::subscribed:
    case Sighting::Kind::unsubscribed:
      return fmt::format("{:<12}  {}  eventgroup {}  {}", to_string(sighting.kind), id,
                         sd::hexadecimal(someip::value(*sighting.eventgroup)), by(service));
  }
  return fmt::format("{:<12}  {}  {}  {}", to_string(sighting.kind), id, version(service), by(service));
}

std::string to_json(const Sighting& sighting, const std::string& time) {
  const SeenService& service = sighting.service;
  nlohmann::ordered_json object;
  if (!time.empty()) {
    object["time"] = time;
  }
  object["seen"] = to_string(sighting.kind);
  object["service"] = sd::hexadecimal(someip::value(service.service));
  object["instance"] = sd::hexadecimal(someip::value(service.instance));
  object["major_version"] = service.major;
  if (sighting.eventgroup) {
    object["eventgroup"] = sd::hexadecimal(someip::value(*sighting.eventgroup));
  } else {
    object["minor_version"] = service.minor;
  }
  if (service.udp) {
    object["udp"] = someip::to_string(*service.udp);
  }
  if (service.tcp) {
    object["tcp"] = someip::to_string(*service.tcp);
  }
  object["peer"] = someip::to_string(service.peer);
  object["ttl"] = service.ttl_s;
  return object.dump();
}

}  // namespace trestle::bridge
