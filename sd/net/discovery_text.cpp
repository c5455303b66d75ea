#include "sd/net/discovery_text.hpp"

#include <array>
#include <cstdio>

#include "someip/net/address_text.hpp"

namespace trestle::sd {

std::string hexadecimal(std::uint16_t number) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "0x%04x", number);
  return text.data();
}

std::string to_string(ServiceId service, InstanceId instance) {
  return hexadecimal(value(service)) + "." +
         (instance == someip::any_instance ? "*" : hexadecimal(value(instance)));
}

std::string version_text(std::uint8_t major, std::uint32_t minor) {
  return (major == any_major ? "any" : std::to_string(major)) + "." +
         (minor == any_minor ? "any" : std::to_string(minor));
}

namespace {

std::string text_of(const MacGroupcastOption& mac) {
  std::string text;
  for (const std::uint8_t byte : mac.address) {
    std::array<char, 4> digits{};
    std::snprintf(digits.data(), digits.size(), "%02x", byte);
    text += (text.empty() ? "" : ":") + std::string{digits.data()};
  }
  return text + ", protocol " + hexadecimal(mac.protocol);
}

}  // namespace

std::string endpoints_text(const RemoteService& service) {
  return (service.udp ? "UDP " + someip::to_string(*service.udp) : "") +
         (service.udp && service.tcp ? " and " : "") +
         (service.tcp ? "TCP " + someip::to_string(*service.tcp) : "");
}

std::string describe(const RemoteService& service) {
  std::string text = to_string(service.service, service.instance) + " version " +
                     std::to_string(service.major) + "." + std::to_string(service.minor) + " is offered";
  if (service.udp) {
    text += " at UDP " + someip::to_string(*service.udp);
  }
  if (service.tcp) {
    text += " at TCP " + someip::to_string(*service.tcp);
  }
  if (const auto& mac = service.options.mac_groupcast) {
    text += " at MAC " + text_of(*mac);
  }
  if (const auto& rank = service.options.load_balancing) {
    text += ", priority " + std::to_string(rank->priority) + " weight " + std::to_string(rank->weight);
  }
  return text;
}

std::string refusal_text(SdError error, const std::string& limits) {
  const std::string name = to_string(error);
  return error == SdError::table_full ? name + ": " + limits : name;
}

}  // namespace trestle::sd
