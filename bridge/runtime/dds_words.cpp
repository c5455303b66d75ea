#include "bridge/runtime/dds_words.hpp"

#include <fmt/format.h>

namespace trestle::bridge {

std::string in_words(const dds::Event& event) {
  using Kind = dds::Event::Kind;
  // `detail` of a match says which end of the topic is ours.
  const bool ours_reads = event.detail == "reader";
  const char* const theirs = ours_reads ? "publisher" : "subscriber";
  switch (event.kind) {
    case Kind::peer_found:
      return fmt::format("participant '{}' ({}) has appeared", event.detail, event.peer);
    case Kind::peer_lost:
      return fmt::format("participant '{}' ({}) has gone", event.detail, event.peer);
    case Kind::matched:
      return fmt::format("{}: found a {} ({}); there {} {} now", event.topic, theirs, event.peer,
                         event.matched == 1 ? "is" : "are", event.matched);
    case Kind::unmatched:
      return fmt::format("{}: lost a {} ({}); there {} {} now", event.topic, theirs, event.peer,
                         event.matched == 1 ? "is" : "are", event.matched);
    case Kind::incompatible_qos:
      return fmt::format("{}: the quality of service of {} does not go with the route's `qos`: {}",
                         event.topic,
                         event.peer.empty()   ? "a peer"
                         : event.node.empty() ? fmt::format("a peer ({})", event.peer)
                                              : fmt::format("node {} ({})", event.node, event.peer),
                         event.detail);
    case Kind::deadline_missed:
      return fmt::format("{}: nothing was {} for longer than the deadline in the route's `qos`", event.topic,
                         ours_reads ? "published" : "carried");
    case Kind::liveliness_lost:
      return ours_reads
                 ? fmt::format("{}: a publisher ({}) has not shown that it is alive for its lease",
                               event.topic, event.peer)
                 : fmt::format("{}: nothing was carried for longer than `liveliness_lease`", event.topic);
    case Kind::incompatible_type:
      return fmt::format("{}: a peer ({}) has this topic with type {}, the route has {}: they don't meet",
                         event.topic, event.peer, event.detail, event.type);
  }
  return {};
}

}  // namespace trestle::bridge
