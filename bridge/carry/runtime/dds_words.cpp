#include "bridge/carry/runtime/dds_words.hpp"

#include <fmt/format.h>

#include "bridge/documents/format.hpp"

namespace trestle::carry {
namespace {

/// What to write in the configuration so that both go together: "write `qos: {...}`"; empty if the peer's
/// quality of service is not known.
std::string mend(const dds::Happening& happening) {
  const auto differs = [&](const char* policy) { return happening.detail.find(policy) != std::string::npos; };
  if (!differs("reliability") && !differs("durability") && !differs("deadline") && !differs("liveliness")) {
    return "no route has that: take it out of the peer's settings (of its XML profile, if it is a ROS 2 "
           "node)";
  }
  if (!happening.theirs) {
    return {};
  }
  const dds::Qos& theirs = *happening.theirs;
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
  const dds::Qos ours = happening.ours.value_or(dds::Qos{});
  bool reliable = says_reliability ? !happening.ours_reads : ours.reliable;
  bool latched = says_durability ? !happening.ours_reads : ours.transient_local;
  if (latched && !reliable) {  // which the configuration does not take
    (happening.ours_reads ? says_durability : says_reliability) = true;
    (happening.ours_reads ? latched : reliable) = !happening.ours_reads;
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

std::string in_words(const dds::Happening& happening) {
  using Kind = dds::Happening::Kind;
  // `detail` of a match says which end of the topic is ours.
  const bool ours_reads = happening.detail == "reader";
  const char* const theirs = ours_reads ? "publisher" : "subscriber";
  switch (happening.kind) {
    case Kind::peer_found:
      return fmt::format("participant '{}' ({}) has appeared", happening.detail, happening.peer);
    case Kind::peer_lost:
      return fmt::format("participant '{}' ({}) has gone", happening.detail, happening.peer);
    case Kind::matched:
      return fmt::format("{}: found a {} ({}); there {} {} now", happening.topic, theirs, happening.peer,
                         happening.matched == 1 ? "is" : "are", happening.matched);
    case Kind::unmatched:
      return fmt::format("{}: lost a {} ({}); there {} {} now", happening.topic, theirs, happening.peer,
                         happening.matched == 1 ? "is" : "are", happening.matched);
    case Kind::incompatible_qos:
      return fmt::format(
          "{}: the quality of service of {} does not go with the route's `qos`: {}{}{}", happening.topic,
          happening.peer.empty()   ? "a peer"
          : happening.node.empty() ? fmt::format("a peer ({})", happening.peer)
                                   : fmt::format("node {} ({})", happening.node, happening.peer),
          happening.detail, mend(happening).empty() ? "" : "; ", mend(happening));
    case Kind::deadline_missed:
      return fmt::format("{}: nothing was {} for longer than the deadline in the route's `qos`",
                         happening.topic, ours_reads ? "published" : "carried");
    case Kind::liveliness_lost:
      return ours_reads
                 ? fmt::format("{}: a publisher ({}) has not shown that it is alive for its lease",
                               happening.topic, happening.peer)
                 : fmt::format("{}: nothing was carried for longer than `liveliness_lease`", happening.topic);
    case Kind::small_send_buffer:
      return happening.detail;
    case Kind::other_type_hash:
      return fmt::format(
          "{}: the {} of this topic in {} has another definition of {}: its hash is {}, the route's is {}; "
          "{}. Give the bridge the same definition (`types`){}",
          happening.topic, happening.ours_reads ? "publisher" : "subscriber",
          happening.node.empty() ? happening.peer
                                 : fmt::format("node {} ({})", happening.node, happening.peer),
          happening.type, happening.detail, happening.hash,
          happening.refused ? "it is refused (`dds: {types: strict}`)" : "fields may be mixed up",
          happening.refused ? "" : ", or refuse it: write `dds: {types: strict}`");
    case Kind::incompatible_type:
      return fmt::format("{}: a peer ({}) has this topic with type {}, the route has {}: they don't meet",
                         happening.topic, happening.peer, happening.detail, happening.type);
  }
  return {};
}

}  // namespace trestle::carry
