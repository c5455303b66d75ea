#include "bridge/carry/config/elements.hpp"
#include "bridge/carry/config/topic_pattern.hpp"
#include "bridge/messages/types/characters.hpp"

namespace trestle::carry {
namespace {

/// Also accepts the names of topics in DDS: "rt/sensing/**".
documents::Format<std::string> topic_pattern() {
  return {
      "a pattern of topics such as /sensing/** (absolute; * stands for one level or a part of it, ** for "
      "any number of levels)",
      [](std::string_view text) -> std::optional<std::string> {
        if (text.starts_with("rt/")) {
          text.remove_prefix(2);
        }
        return is_topic_pattern(text) ? std::optional<std::string>{text} : std::nullopt;
      }};
}

/// "0x6000-0x6fff"
documents::Format<ServiceRange> service_range() {
  return {
      "a range of ids such as 0x6000-0x6fff, within 0x0001 to 0xfffd",
      [](std::string_view text) -> std::optional<ServiceRange> {
        const auto id = service_id();
        const std::size_t dash = text.find('-');
        if (dash == std::string_view::npos) {
          return std::nullopt;
        }
        const auto first = id.read(messages::trimmed(text.substr(0, dash)));
        const auto last = id.read(messages::trimmed(text.substr(dash + 1)));
        return first && last && *first <= *last ? std::optional{ServiceRange{*first, *last}} : std::nullopt;
      }};
}

/// @param qos  of the pattern's routes.
void load_pattern_qos(const YAML::Node& node, QosSettings& qos, TopicPattern& pattern, bool inbound,
                      documents::Problems& problems) {
  load_qos(node, qos, !inbound, problems);
  documents::Problems told_already{""};
  const documents::Section given{node, "qos", told_already};
  pattern.follow_durability = inbound && given.is_missing("durability");
}

}  // namespace

PatternInFile load_pattern(const YAML::Node& node, documents::Problems& problems) {
  PatternInFile result;
  TopicPattern& pattern = result.pattern;
  Route& route = pattern.route;
  Element element{node, "pattern", result.good, problems};
  pattern.mark = element.mark();
  route.mark = element.mark();
  element.require("topics", topic_pattern(), pattern.topics);
  std::vector<documents::Mark> marks;
  element.read_list("exclude", topic_pattern(), pattern.exclude, marks);
  element.require("direction", direction(), route.direction);
  const bool outbound = element.has("direction") && route.direction == Direction::dds_to_someip;
  const bool inbound = element.has("direction") && !outbound;
  if (outbound) {
    element.require("services", service_range(), pattern.services);
    element.read("max_routes", documents::as<std::size_t>(documents::whole_number(1, 1000)),
                 pattern.max_routes);
    route.qos.reliability_as_published = true;
    route.qos.durability_as_published = true;
    route.presence.offer_while_published = true;
  }
  pattern.follow_durability = true;
  route.instance = someip::InstanceId{1};
  route.eventgroup = someip::EventgroupId{1};
  route.event = someip::MethodId{0x8001};
  element.read("instance", id_of<someip::InstanceId>(), route.instance);
  element.read("eventgroup", id_of<someip::EventgroupId>(), route.eventgroup);
  element.read("event", id_of<someip::MethodId>(0x8001), route.event);
  load_carriage(element, route, problems);
  load_transport(element, udp_or_tcp(), route, problems);
  if (inbound) {
    route.presence.write_while_offered = true;
    load_presence(element, route.direction, route.presence, problems);
  }
  load_from_bridges(element, !inbound, "patterns with direction: dds_to_someip", route.from_bridges,
                    problems);
  if (const YAML::Node qos = element.child("qos")) {
    load_pattern_qos(qos, route.qos, pattern, inbound, problems);
  }
  pattern.follow_reliability = route.qos.reliability_as_published;
  pattern.follow_durability = inbound ? pattern.follow_durability : route.qos.durability_as_published;
  if (element.has("direction")) {
    element.finish();  // which keys there are depends on it
  }
  return result;
}

}  // namespace trestle::carry
