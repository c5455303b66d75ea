#include "bridge/carry/config/load_pattern.hpp"

#include "bridge/carry/config/load_route.hpp"
#include "bridge/carry/config/topic_pattern.hpp"
#include "bridge/documents/format.hpp"
#include "bridge/documents/section.hpp"

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
        const auto id = documents::as<someip::ServiceId>(documents::id_number(0x0001, 0xfffd));
        const std::size_t dash = text.find('-');
        if (dash == std::string_view::npos) {
          return std::nullopt;
        }
        const auto trimmed = [](std::string_view part) {
          const std::size_t begin = std::min(part.find_first_not_of(' '), part.size());
          return part.substr(begin, part.find_last_not_of(' ') + 1 - begin);
        };
        const auto first = id.read(trimmed(text.substr(0, dash)));
        const auto last = id.read(trimmed(text.substr(dash + 1)));
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
  RouteInFile common;
  Route& route = common.route;
  documents::Section section{node, "pattern", problems};
  pattern.mark = section.mark();
  route.mark = section.mark();
  const auto require = [&](const char* key, const auto& format, auto& into) {
    if (section.require(key, format, into)) {
      common.good.emplace(key, section.use_mark(key));
    }
  };
  require("topics", topic_pattern(), pattern.topics);
  std::vector<documents::Mark> marks;
  section.read_list("exclude", topic_pattern(), pattern.exclude, marks);
  require("direction",
          documents::one_of<Direction>(
              {{"dds_to_someip", Direction::dds_to_someip}, {"someip_to_dds", Direction::someip_to_dds}}),
          route.direction);
  const bool outbound = common.good.contains("direction") && route.direction == Direction::dds_to_someip;
  const bool inbound = common.good.contains("direction") && !outbound;
  if (outbound) {
    require("services", service_range(), pattern.services);
    section.read("max_routes", documents::as<std::size_t>(documents::whole_number(1, 1000)),
                 pattern.max_routes);
    route.qos.reliability_as_published = true;
    route.qos.durability_as_published = true;
    route.presence.offer_while_published = true;
  }
  pattern.follow_durability = true;
  route.instance = someip::InstanceId{1};
  route.eventgroup = someip::EventgroupId{1};
  route.event = someip::MethodId{0x8001};
  section.read("instance", documents::as<someip::InstanceId>(documents::id_number(0x0001, 0xfffe)),
               route.instance);
  section.read("eventgroup", documents::as<someip::EventgroupId>(documents::id_number(0x0001, 0xfffe)),
               route.eventgroup);
  section.read("event", documents::as<someip::MethodId>(documents::id_number(0x8001, 0xfffe)), route.event);
  load_carriage(section, common, problems);
  load_transport(section, udp_or_tcp(), route, problems);
  if (inbound) {
    route.presence.write_while_offered = true;
    load_presence(section, route.direction, route.presence, problems);
  }
  load_from_bridges(section, !inbound, "patterns with direction: dds_to_someip", route.from_bridges,
                    problems);
  if (const YAML::Node qos = section.child("qos")) {
    load_pattern_qos(qos, route.qos, pattern, inbound, problems);
  }
  pattern.follow_reliability = route.qos.reliability_as_published;
  pattern.follow_durability = inbound ? pattern.follow_durability : route.qos.durability_as_published;
  if (common.good.contains("direction")) {
    section.finish();  // which keys there are depends on it
  }
  pattern.route = std::move(route);
  result.good = std::move(common.good);
  return result;
}

}  // namespace trestle::carry
