#pragma once
#include <string>

#include "bridge/tools/network_view.hpp"

namespace trestle::bridge {

/// "0x1111.0x0001  1.0  udp 10.0.0.5:30509  by 10.0.0.5  ttl 3 s"
[[nodiscard]] std::string describe(const SeenService& service);
/// "offered 0x1111.0x0001  1.0 ..." on one line.
[[nodiscard]] std::string describe(const Sighting& sighting);
/// The same as a JSON object on one line. docs/tools.md lists its fields.
/// @param time  when it was seen; empty: left out.
[[nodiscard]] std::string to_json(const Sighting& sighting, const std::string& time = {});

}  // namespace trestle::bridge
