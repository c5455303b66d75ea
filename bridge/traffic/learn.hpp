#pragma once
#include "bridge/traffic/capture_reader.hpp"
#include "bridge/traffic/network_view.hpp"

namespace trestle::traffic {

/// Endpoints that discovery announces carry SOME/IP, whatever their bytes look like.
inline void learn(CaptureReader& reader, const Sighting& sighting) {
  const auto& udp = sighting.subscription ? sighting.subscription->udp : sighting.service.udp;
  const auto& tcp = sighting.subscription ? sighting.subscription->tcp : sighting.service.tcp;
  if (udp) {
    reader.learn(Transport::udp, *udp);
  }
  if (tcp) {
    reader.learn(Transport::tcp, *tcp);
  }
  if (sighting.subscription && sighting.subscription->multicast) {
    reader.learn(Transport::udp, *sighting.subscription->multicast);
  }
}

}  // namespace trestle::traffic
