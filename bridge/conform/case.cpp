#include "bridge/conform/case.hpp"

#include <algorithm>

#include "bridge/conform/profile.hpp"

namespace trestle::conform {
namespace {

bool any_group(const ServiceProfile& service, bool (*is_one)(const EventgroupProfile&)) {
  return std::ranges::any_of(service.eventgroups, is_one);
}

/// With '*' for any text.
bool matches(std::string_view text, std::string_view pattern) {
  const auto star = pattern.find('*');
  if (star == std::string_view::npos) {
    return text == pattern;
  }
  if (!text.starts_with(pattern.substr(0, star))) {
    return false;
  }
  const std::string_view rest = pattern.substr(star + 1);
  for (std::size_t at = star; at <= text.size(); ++at) {
    if (matches(text.substr(at), rest)) {
      return true;
    }
  }
  return false;
}

struct NeedRule {
  Need need;
  const char* reason;
  bool (*met)(const Profile& profile);
};

constexpr NeedRule need_rules[]{
    {Need::udp, "the service has no UDP port",
     [](const Profile& p) { return p.service().udp_port.has_value(); }},
    {Need::tcp, "the service has no TCP port",
     [](const Profile& p) { return p.service().tcp_port.has_value(); }},
    {Need::eventgroup, "no eventgroup over UDP",
     [](const Profile& p) { return any_group(p.service(), [](const auto& one) { return !one.tcp; }); }},
    {Need::initial_values, "no eventgroup with initial values",
     [](const Profile& p) {
       return any_group(p.service(), [](const auto& one) { return one.initial_values; });
     }},
    {Need::multicast_events, "no eventgroup with multicast",
     [](const Profile& p) {
       return any_group(p.service(), [](const auto& one) { return one.multicast.has_value(); });
     }},
    {Need::tcp_eventgroup, "no eventgroup over TCP",
     [](const Profile& p) { return any_group(p.service(), [](const auto& one) { return one.tcp; }); }},
    {Need::request, "the profile names no request",
     [](const Profile& p) { return p.service().request.has_value(); }},
    {Need::fire_and_forget, "the profile names no fire-and-forget method",
     [](const Profile& p) { return p.service().fire_and_forget.has_value(); }},
    {Need::field, "the profile names no field",
     [](const Profile& p) { return p.service().field.has_value(); }},
    {Need::restart, "the profile has no way to restart the device",
     [](const Profile& p) { return p.can_restart(); }},
    {Need::stop, "the profile has no way to stop and start the device",
     [](const Profile& p) { return !p.lifecycle.start.empty() || p.lifecycle.ask_operator; }},
    {Need::two_services, "the profile has one service only",
     [](const Profile& p) {
       return std::ranges::any_of(p.services,
                                  [&](const auto& one) { return one.service != p.service().service; });
     }},
    {Need::two_instances, "the profile has one instance of the first service only",
     [](const Profile& p) {
       return std::ranges::count(p.services, p.service().service, &ServiceProfile::service) > 1;
     }},
    {Need::cyclic_offers, "the profile does not tell the cyclic offer delay",
     [](const Profile& p) { return p.timing.cyclic_offer_delay.value_or(Duration{0}) > Duration{0}; }},
    {Need::repetitions, "the profile does not tell the repetitions",
     [](const Profile& p) {
       return p.timing.repetitions_max.value_or(0) > 0 && p.timing.repetitions_base_delay.has_value();
     }},
    {Need::multicast_threshold, "no eventgroup with a multicast threshold above 1, and a trigger",
     [](const Profile& p) {
       return any_group(p.service(), [](const auto& one) {
         return one.multicast && one.trigger && one.multicast_threshold > 1;
       });
     }},
    {Need::load_balancing, "no service with load balancing",
     [](const Profile& p) {
       return std::ranges::any_of(p.services, [](const auto& one) { return one.load_balancing.has_value(); });
     }},
    {Need::configuration, "no service with a configuration",
     [](const Profile& p) {
       return std::ranges::any_of(p.services, [](const auto& one) { return !one.configuration.empty(); });
     }},
    {Need::two_versions, "no service in two major versions",
     [](const Profile& p) {
       return std::ranges::any_of(p.services,
                                  [&](const auto& one) { return other_version(p, one) != nullptr; });
     }},
    {Need::e2e, "no method with end-to-end protection",
     [](const Profile& p) {
       return p.service().udp_port &&
              std::ranges::any_of(p.service().e2e, [](const auto& one) { return !is_of_event(one); });
     }},
    {Need::e2e_event, "no event with end-to-end protection (e2e: event)",
     [](const Profile& p) {
       return p.service().udp_port && std::ranges::any_of(p.service().e2e, is_of_event);
     }},
    {Need::client, "the profile names no service that the device uses by itself",
     [](const Profile& p) { return !std::ranges::all_of(p.uses, &UsedService::by_ets); }},
    {Need::ets_client, "the profile names no service that the device uses when it is told to (by_ets: true)",
     [](const Profile& p) {
       return p.ets && !p.services.empty() && std::ranges::any_of(p.uses, &UsedService::by_ets);
     }},
    {Need::event,
     "no event that comes by itself (eventgroups: cycle), or when it is told to (trigger, or ets: true)",
     [](const Profile& p) { return p.service().udp_port && event_source(p); }},
    {Need::tcp_event,
     "no event over TCP that comes by itself (eventgroups: tcp, cycle), or when it is told to (trigger, or "
     "ets: "
     "true)",
     [](const Profile& p) { return tcp_event_source(p).has_value(); }},
    {Need::ets, "no Enhanced Testability Service (ets: true)", [](const Profile& p) { return p.ets; }},
    {Need::large_request, "no method that takes requests in segments (large: echo or request; or tp: true)",
     [](const Profile& p) { return p.service().udp_port && large_request(p); }},
    {Need::large_message,
     "no response or event that comes in segments (large: echo, response or event; or tp: true)",
     [](const Profile& p) {
       const auto request = large_request(p);
       return p.service().udp_port &&
              ((request && request->is_echo) || p.service().large.response || large_event(p));
     }},
};

}  // namespace

const char* to_string(Level level) noexcept {
  return level == Level::must ? "must" : level == Level::should ? "should" : "tc8";
}

const char* to_string(Role role) noexcept {
  return role == Role::server ? "server" : "client";
}

std::vector<std::string> reasons_of(Need needs) {
  std::vector<std::string> all;
  for (const NeedRule& rule : need_rules) {
    if (has(needs, rule.need)) {
      all.emplace_back(rule.reason);
    }
  }
  return all;
}

std::optional<std::string> unsupported(const Case& one, const Profile& profile) {
  if (one.role == Role::server && profile.services.empty()) {
    return "the device offers no service";
  }
  for (const NeedRule& rule : need_rules) {
    if (has(one.needs, rule.need) && !rule.met(profile)) {
      return rule.reason;
    }
  }
  return std::nullopt;
}

bool chosen(const Case& one, std::string_view selector) {
  const auto named = [&](const auto& id) { return id.text() == selector; };
  return matches(one.id, selector) ||
         (one.id.starts_with(selector) && one.id.size() > selector.size() &&
          one.id[selector.size()] == '.') ||
         std::ranges::any_of(one.tc8, named) || std::ranges::any_of(one.requirements, named);
}

std::vector<const Case*> choose(const std::vector<Case>& cases, const std::vector<std::string>& selectors,
                                Level level) {
  std::vector<const Case*> all;
  for (const Case& one : cases) {
    if (one.level <= level &&
        (selectors.empty() ||
         std::ranges::any_of(selectors, [&](const std::string& text) { return chosen(one, text); }))) {
      all.push_back(&one);
    }
  }
  return all;
}

}  // namespace trestle::conform
