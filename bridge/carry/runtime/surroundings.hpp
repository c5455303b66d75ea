#pragma once
#include <map>
#include <span>
#include <string>
#include <vector>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/carry/runtime/counters.hpp"
#include "bridge/picture/picture.hpp"
#include "dds_adapter/participant.hpp"
#include "sd/net/service_spec.hpp"

namespace trestle::carry {

/// What both networks have around the bridge, of one look at them, ordered for the routes to find theirs.
struct Surroundings {
  std::map<someip::ServiceId, std::vector<sd::SeenOffer>> offers{};  ///< of others
  std::map<std::string, std::vector<dds::FoundWriter>> writers{};    ///< of others, by topic on the DDS wire
  Picture networks{};                                                ///< without routes and lists

  [[nodiscard]] std::span<const sd::SeenOffer> offers_of(someip::ServiceId service) const {
    const auto found = offers.find(service);
    return found == offers.end() ? std::span<const sd::SeenOffer>{} : std::span{found->second};
  }
  [[nodiscard]] std::span<const dds::FoundWriter> writers_of(const std::string& topic) const {
    const auto found = writers.find(topic);
    return found == writers.end() ? std::span<const dds::FoundWriter>{} : std::span{found->second};
  }
};

/// So many writers of a topic, and offers of a service, stand in the picture of a route.
inline constexpr std::size_t most_in_picture = 32;

[[nodiscard]] QosPicture picture_of(const dds::Qos& qos);
[[nodiscard]] WriterPicture picture_of(const dds::FoundWriter& writer);
[[nodiscard]] OfferPicture picture_of(const sd::SeenOffer& offer);
[[nodiscard]] std::vector<OfferPicture> pictures_of(std::span<const sd::SeenOffer> offers);
[[nodiscard]] std::vector<CounterPicture> pictures_of(const std::vector<Counter>& counters);
/// What the configuration says of it.
[[nodiscard]] RoutePicture picture_of(const Route& route);
[[nodiscard]] RoutePicture picture_of(const MethodRoute& method);
[[nodiscard]] RoutePicture picture_of(const TopicPattern& pattern);

}  // namespace trestle::carry
