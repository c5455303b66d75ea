#include "bridge/carry/runtime/dds_words.hpp"

#include <fmt/format.h>

#include "bridge/documents/format.hpp"

namespace trestle::carry {
namespace {

/// What to write in the configuration so that both go together: "write `qos: {...}`"; empty if the peer's
/// quality of service is not known.
std::string mend(const dds::Happening& event) {
  const auto differs = [&](const char* policy) { return event.detail.find(policy) != std::string::npos; };
  if (!differs("reliability") && !differs("durability") && !differs("deadline") && !differs("liveliness")) {
    return "no route has that: take it out of the peer's settings (of its XML profile, if it is a ROS 2 "
           "node)";
  }
  if (!event.theirs) {
    return {};
  }
  const dds::Qos& theirs = *event.theirs;
  std::string keys;
  std::string without;
  const auto write = [&](const std::string& key, const std::string& value) {
    keys += (keys.empty() ? "" : ", ") + key + ": " + value;
  };
  const auto time = [&](const std::string& key, std::chrono::nanoseconds of_peer) {
    // What the configuration takes.
    if (of_peer >= std::chrono::milliseconds{1} && of_peer <= std::chrono::hours{24}) {
      write(key, documents::to_string(of_peer));
    } else {
      without += (without.empty() ? "`" : ", `") + key + "`";
    }
  };
  bool says_reliability = differs("reliability");
  bool says_durability = differs("durability");
  const dds::Qos ours = event.ours.value_or(dds::Qos{});
  bool reliable = says_reliability ? !event.ours_reads : ours.reliable;
  bool latched = says_durability ? !event.ours_reads : ours.transient_local;
  if (latched && !reliable) {  // which the configuration does not take
    (event.ours_reads ? says_durability : says_reliability) = true;
    (event.ours_reads ? latched : reliable) = !event.ours_reads;
  }
  if (says_reliability) {
    write("reliability", reliable ? "reliable" : "best_effort");
  }
  if (says_durability) {
    write("durability", latched ? "transient_local" : "volatile");
  }
  if (differs("deadline")) {
    time("deadline", theirs.deadline);
  }
  if (differs("liveliness")) {
    write("liveliness", theirs.manual_liveliness ? "manual_by_topic" : "automatic");
    time("liveliness_lease", theirs.liveliness_lease);
  }
  const std::string to_write = keys.empty() ? "" : "write `qos: {" + keys + "}`";
  const std::string to_leave = without.empty() ? "" : "leave out " + without;
  return to_write + (to_write.empty() || to_leave.empty() ? "" : " and ") + to_leave;
}

}  // namespace

std::string in_words(const dds::Happening& event) {
  using Kind = dds::Happening::Kind;
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
      return fmt::format("{}: the quality of service of {} does not go with the route's `qos`: {}{}{}",
                         event.topic,
                         event.peer.empty()   ? "a peer"
                         : event.node.empty() ? fmt::format("a peer ({})", event.peer)
                                              : fmt::format("node {} ({})", event.node, event.peer),
                         event.detail, mend(event).empty() ? "" : "; ", mend(event));
    case Kind::deadline_missed:
      return fmt::format("{}: nothing was {} for longer than the deadline in the route's `qos`", event.topic,
                         ours_reads ? "published" : "carried");
    case Kind::liveliness_lost:
      return ours_reads
                 ? fmt::format("{}: a publisher ({}) has not shown that it is alive for its lease",
                               event.topic, event.peer)
                 : fmt::format("{}: nothing was carried for longer than `liveliness_lease`", event.topic);
    case Kind::small_send_buffer:
      return event.detail;
    case Kind::other_type_hash:
      return fmt::format(
          "{}: the {} of this topic in {} has another definition of {}: its hash is {}, the route's is {}; "
          "{}. Give the bridge the same definition (`types`){}",
          event.topic, event.ours_reads ? "publisher" : "subscriber",
          event.node.empty() ? event.peer : fmt::format("node {} ({})", event.node, event.peer), event.type,
          event.detail, event.hash,
          event.refused ? "it is refused (`dds: {types: strict}`)" : "fields may be mixed up",
          event.refused ? "" : ", or refuse it: write `dds: {types: strict}`");
    case Kind::incompatible_type:
      return fmt::format("{}: a peer ({}) has this topic with type {}, the route has {}: they don't meet",
                         event.topic, event.peer, event.detail, event.type);
  }
  return {};
}

}  // namespace trestle::carry
