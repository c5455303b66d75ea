#pragma once
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "fuzz/mutate/mutate.hpp"
#include "someip/wire/endpoint.hpp"

namespace trestle::conform {

/// How the bytes of a step reach the device.
enum class Way : std::uint8_t {
  sd_unicast,    ///< from the tester's port of service discovery
  sd_multicast,  ///< the same, to the group
  udp,           ///< from the tester's UDP port
  tcp,           ///< on the connection to that port, which is made when there is none
  tcp_close,     ///< ends that connection
};

/// One thing that is done to the device.
struct Step {
  Way way = Way::udp;
  std::uint16_t port = 0;  ///< of the device; of udp, tcp and tcp_close
  fuzz::Bytes bytes{};
  std::chrono::milliseconds pause{0};  ///< after it
  /// A message of service discovery goes out with the tester's next Session ID and Reboot flag, so that the
  /// device does not take each for a restart of the tester.
  bool counted = false;
};

/// What is done to the device one after the other, and the state that it begins with.
struct Sequence {
  std::string state{};
  std::vector<Step> steps{};
};

}  // namespace trestle::conform
