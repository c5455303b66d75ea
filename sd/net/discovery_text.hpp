#pragma once
#include <string>

#include "sd/core/events.hpp"
#include "sd/core/service_discovery.hpp"

namespace trestle::sd {

/// "0x12ab"
[[nodiscard]] std::string hexadecimal(std::uint16_t number);
/// "0x1234.0x0001", "0x1234.*" for any instance.
[[nodiscard]] std::string to_string(ServiceId service, InstanceId instance);
/// "1.0", "1.any"
[[nodiscard]] std::string version_text(std::uint8_t major, std::uint32_t minor);
/// "UDP 127.0.0.1:40001 and TCP 127.0.0.1:40002": where a service is.
[[nodiscard]] std::string endpoints_text(const RemoteService& service);
/// "0x1234.0x0001 version 1.0 is offered by 127.0.0.1 at 127.0.0.1:40001"
[[nodiscard]] std::string describe(const RemoteService& service);
/// "table full: LIMITS", where these are the settings that help; other errors by their name alone.
[[nodiscard]] std::string refusal_text(SdError error, const std::string& limits);

}  // namespace trestle::sd
