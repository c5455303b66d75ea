#pragma once
#include <map>
#include <span>
#include <string>
#include <vector>

#include "bridge/carry/config/bridge_config.hpp"
#include "dds_adapter/participant.hpp"
#include "sd/net/service_spec.hpp"

namespace trestle::carry {

/// Why nothing comes to a route, as far as it is known.
struct SilenceReason {
  enum class Kind : std::uint8_t {
    none,  ///< nothing is amiss: it waits on purpose
    other_interface,
    not_offered,
    offered_otherwise,  ///< another instance or version
    not_subscribed,
    other_events,
    no_event,
    no_participant,
    no_publisher,
    other_type,
    refused_type,  ///< `types: strict`
    other_qos,
    no_sample,
    not_locked,    ///< of a pattern from SOME/IP: the lock file has no topic for it
    no_match,      ///< of a pattern to SOME/IP
    only_bridges,  ///< likewise
    no_route,      ///< likewise: what matches is refused
  };
  Kind kind = Kind::none;
  std::string details;  ///< of this route; another one is told of again
  friend bool operator==(const SilenceReason&, const SilenceReason&) = default;
};
inline constexpr std::size_t silence_kinds = 17;

/// What both networks have around the bridge, of one look at them.
struct Surroundings {
  std::map<someip::ServiceId, std::vector<sd::SeenOffer>> offers{};  ///< of others
  std::map<std::string, std::vector<dds::FoundWriter>> writers{};    ///< of others, by topic on the DDS wire
  std::size_t participants = 0;                                      ///< others
  std::string other_interface{};  ///< not empty: the one that has our address, instead of the configured
  [[nodiscard]] std::span<const sd::SeenOffer> offers_of(someip::ServiceId service) const {
    const auto found = offers.find(service);
    return found == offers.end() ? std::span<const sd::SeenOffer>{} : std::span{found->second};
  }
  [[nodiscard]] std::span<const dds::FoundWriter> writers_of(const std::string& topic) const {
    const auto found = writers.find(topic);
    return found == writers.end() ? std::span<const dds::FoundWriter>{} : std::span{found->second};
  }
};

/// What the SOME/IP side knows of a route from there.
struct SomeipSilence {
  std::string other_interface{};  ///< not empty: the one that has our address, instead of the configured
  std::span<const sd::SeenOffer> offers{};  ///< of the route's service, of whatever instance and version
  bool subscription = false;                ///< there is to be one
  bool subscribed = false;
  bool refused = false;        ///< a server has refused it
  bool over_tcp_only = false;  ///< it is offered, but not over TCP as the route wants
  sd::OtherEvents others{};
};
[[nodiscard]] SilenceReason why_silent(const Route& route, const SomeipSilence& known);

/// What the DDS side knows of a route from there.
struct DdsSilence {
  std::size_t participants = 0;                 ///< others
  std::span<const dds::FoundWriter> writers{};  ///< of the topic, whatever their type
  std::size_t matched = 0;
};
[[nodiscard]] SilenceReason why_silent(const Route& route, const DdsSilence& known);

/// What is known of a pattern.
struct PatternSilence {
  std::size_t routes = 0;        ///< that it has now
  std::size_t participants = 0;  ///< others
  std::size_t topics = 0;        ///< that match, and that others publish
  bool brought = false;          ///< what matches comes from other bridges
};
[[nodiscard]] SilenceReason why_silent(const PatternSilence& known);

/// The reason in words. @param routes  how many have it: with more than one without what is the route's own.
/// @param heard  hosts that take part in discovery, on the side where nothing comes from.
[[nodiscard]] std::string in_words(const SilenceReason& reason, std::size_t routes, std::size_t heard);

}  // namespace trestle::carry
