#include "bridge/conform/profile.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <utility>

#include "bridge/documents/document.hpp"
#include "bridge/documents/section.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::conform {
namespace {

using namespace std::chrono_literals;
using documents::as;
using documents::Format;
using documents::id_number;
using documents::Problems;
using documents::Section;
using documents::truth;
using documents::whole_number;

constexpr std::uint64_t max_id = 0xfffe;

/// Whether a section or list is there. It is asked for where it is not, so that what is said of unknown keys
/// names it, too.
bool has(Section& section, const char* key) {
  if (section.is_missing(key)) {
    (void)section.child(key);
    return false;
  }
  return true;
}

template <typename Id>
Format<Id> id(std::uint64_t max = max_id) {
  return as<Id>(id_number(1, max));
}

int digit(char c) {
  return c >= '0' && c <= '9'   ? c - '0'
         : c >= 'a' && c <= 'f' ? c - 'a' + 10
         : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                : -1;
}

Format<std::vector<std::byte>> hex_bytes() {
  return {"bytes in hexadecimal, such as \"00 2a\"", [](std::string_view text) {
            std::vector<std::byte> bytes;
            int high = -1;
            for (const char c : text) {
              if (c == ' ' && high < 0) {
                continue;
              }
              const int value = digit(c);
              if (value < 0) {
                return std::optional<std::vector<std::byte>>{};
              }
              if (high < 0) {
                high = value;
              } else {
                bytes.push_back(static_cast<std::byte>(high * 16 + value));
                high = -1;
              }
            }
            return high < 0 ? std::optional{bytes} : std::nullopt;
          }};
}

Format<Duration> any_duration() {
  return documents::duration(0ns, 1h);
}

/// A value that may be missing and then stays unknown.
template <typename T, typename From>
void read_optional(Section& section, const char* key, const Format<From>& format, std::optional<T>& into) {
  From value{};
  if (section.read(key, format, value)) {
    into = static_cast<T>(value);
  }
}

EventgroupProfile read_eventgroup(const YAML::Node& node, Problems& problems) {
  Section section{node, "eventgroup", problems};
  EventgroupProfile group;
  section.require("id", id<someip::EventgroupId>(), group.id);
  std::vector<documents::Mark> marks;
  section.read_list("events", id<someip::MethodId>(), group.events, marks);
  section.read("initial_values", truth(), group.initial_values);
  section.read("tcp", truth(), group.tcp);
  section.read("multicast_threshold", as<std::size_t>(whole_number(0, 1000)), group.multicast_threshold);
  read_optional(section, "trigger", id<someip::MethodId>(0x7fff), group.trigger);
  read_optional(section, "cycle", documents::duration(1ms, 1min), group.cycle);
  if (has(section, "multicast")) {
    Section multicast{section.child("multicast"), "multicast", problems};
    Endpoint endpoint;
    multicast.require("address", documents::multicast_address(), endpoint.address);
    multicast.require("port", as<std::uint16_t>(whole_number(1, 65'535)), endpoint.port);
    multicast.finish();
    group.multicast = endpoint;
  }
  if (group.initial_values && group.events.empty()) {
    problems.error(section.mark(), "eventgroup: expected the 'events' that have initial values");
  }
  if (group.cycle && group.events.empty()) {
    problems.error(section.mark(), "eventgroup: expected the 'events', of which the first has the cycle");
  }
  section.finish();
  return group;
}

RequestProfile read_request(const YAML::Node& node, const char* key, Problems& problems) {
  Section section{node, key, problems};
  RequestProfile request;
  section.require("method", id<someip::MethodId>(0x7fff), request.method);
  section.read("payload", hex_bytes(), request.payload);
  section.finish();
  return request;
}

/// What is said of an event that no case can wait for.
constexpr const char* cannot_be_waited_for =
    "expected an event that can be waited for: of an eventgroup with a 'trigger', or the first of one with a "
    "'cycle', without multicast and TCP";

/// @param service  with its eventgroups.
E2eProtection read_protection(const YAML::Node& node, const ServiceProfile& service, Problems& problems) {
  using enum E2eProfile;
  Section section{node, "e2e", problems};
  E2eProtection how;
  section.read("method", id<someip::MethodId>(0x7fff), how.id);
  section.read("event", as<someip::MethodId>(id_number(0x8000, max_id)), how.id);
  if (section.is_missing("method") == section.is_missing("event")) {
    problems.error(section.mark(), "e2e: expected a 'method' or an 'event'");
  }
  section.require("profile",
                  documents::one_of<E2eProfile>({{"1", p1},
                                                 {"2", p2},
                                                 {"4", p4},
                                                 {"4m", p4m},
                                                 {"5", p5},
                                                 {"6", p6},
                                                 {"7", p7},
                                                 {"7m", p7m},
                                                 {"8", p8},
                                                 {"8m", p8m},
                                                 {"11", p11},
                                                 {"22", p22},
                                                 {"44", p44},
                                                 {"44m", p44m}}),
                  how.profile);
  section.read("data_id", as<std::uint32_t>(id_number(0, 0xffff'ffff)), how.data_id);
  section.read("data_ids", hex_bytes(), how.data_ids);
  section.read("nibble", truth(), how.nibble);
  section.read("source", as<std::uint32_t>(id_number(0, 0x0fff'ffff)), how.source);
  if ((how.profile == p2 || how.profile == p22) && how.data_ids.size() != 16) {
    problems.error(section.mark(), "e2e: expected 16 bytes as 'data_ids' of this profile");
  }
  if (is_of_event(how) && is_for_methods_alone(how.profile)) {
    problems.error(section.mark(), "e2e: expected another profile for an event: this one is for methods");
  }
  if (is_of_event(how) && !event_source(service, how.id)) {
    problems.error(section.mark(), std::string{"e2e: "} + cannot_be_waited_for);
  }
  section.finish();
  return how;
}

LargeProfile read_large(const YAML::Node& node, const ServiceProfile& service, Problems& problems) {
  Section section{node, "large", problems};
  LargeProfile large;
  read_optional(section, "echo", id<someip::MethodId>(0x7fff), large.echo);
  read_optional(section, "request", id<someip::MethodId>(0x7fff), large.request);
  if (has(section, "response")) {
    large.response = read_request(section.child("response"), "response", problems);
  }
  read_optional(section, "event", id<someip::MethodId>(), large.event);
  if (large.event && !event_source(service, *large.event)) {
    problems.error(section.mark(), std::string{"large: "} + cannot_be_waited_for);
  }
  if (!service.udp_port) {
    problems.error(section.mark(), "large: expected a service with a port of UDP: TCP needs no segments");
  }
  section.finish();
  return large;
}

/// @param above  those that the profile has before this one.
ServiceProfile read_service(const YAML::Node& node, const std::vector<ServiceProfile>& above,
                            Problems& problems) {
  Section section{node, "service", problems};
  ServiceProfile service;
  const auto port = as<std::uint16_t>(whole_number(1, 65'535));
  section.require("id", id<someip::ServiceId>(), service.service);
  section.require("instance", id<someip::InstanceId>(), service.instance);
  section.read("major", as<std::uint8_t>(whole_number(0, 254)), service.major);
  section.read("minor", as<std::uint32_t>(whole_number(0, 0xffff'fffe)), service.minor);
  read_optional(section, "ttl", whole_number(1, 0xff'ffff), service.ttl_s);
  read_optional(section, "udp", port, service.udp_port);
  read_optional(section, "tcp", port, service.tcp_port);
  if (has(section, "eventgroups")) {
    for (const YAML::Node& group : section.list("eventgroups", "a list of eventgroups")) {
      service.eventgroups.push_back(read_eventgroup(group, problems));
    }
  }
  if (has(section, "request")) {
    service.request = read_request(section.child("request"), "request", problems);
  }
  read_optional(section, "fire_and_forget", id<someip::MethodId>(0x7fff), service.fire_and_forget);
  if (has(section, "field")) {
    Section field{section.child("field"), "field", problems};
    service.field.emplace();
    field.require("getter", id<someip::MethodId>(0x7fff), service.field->getter);
    field.require("setter", id<someip::MethodId>(0x7fff), service.field->setter);
    field.require("value", hex_bytes(), service.field->value);
    field.require("eventgroup", id<someip::EventgroupId>(), service.field->eventgroup);
    field.finish();
  }
  if (has(section, "large")) {
    service.large = read_large(section.child("large"), service, problems);
  }
  if (has(section, "e2e")) {
    for (const YAML::Node& one :
         section.list("e2e", "a list of methods and events with end-to-end protection")) {
      service.e2e.push_back(read_protection(one, service, problems));
    }
  }
  if (has(section, "load_balancing")) {
    Section balancing{section.child("load_balancing"), "load_balancing", problems};
    service.load_balancing.emplace();
    balancing.require("priority", as<std::uint16_t>(whole_number(0, 0xffff)),
                      service.load_balancing->priority);
    balancing.require("weight", as<std::uint16_t>(whole_number(0, 0xffff)), service.load_balancing->weight);
    balancing.finish();
  }
  std::vector<documents::Mark> marks;
  section.read_list("configuration", documents::any_text("an item, such as 'key=value'"),
                    service.configuration, marks);
  if (!service.udp_port && !service.tcp_port) {
    problems.error(section.mark(), "service: expected a port, udp or tcp");
  }
  const auto is_same = [&](const ServiceProfile& one) {
    return one.service == service.service && one.instance == service.instance && one.major == service.major;
  };
  if (service.service != someip::ServiceId{} && std::ranges::any_of(above, is_same)) {
    problems.error(section.mark(),
                   "service: expected another id, instance or major version than those of a service above");
  }
  section.finish();
  return service;
}

std::optional<WantedEventgroup> read_wanted(Section& service, const char* key, Problems& problems) {
  if (!has(service, key)) {
    return std::nullopt;
  }
  Section section{service.child(key), key, problems};
  WantedEventgroup wanted;
  section.require("eventgroup", id<someip::EventgroupId>(), wanted.id);
  section.require("event", id<someip::MethodId>(), wanted.event);
  section.finish();
  return wanted;
}

UsedService read_used(const YAML::Node& node, Problems& problems) {
  Section section{node, "used service", problems};
  UsedService used;
  section.require("id", id<someip::ServiceId>(), used.service);
  section.read("instance", id<someip::InstanceId>(), used.instance);
  section.read("major", as<std::uint8_t>(whole_number(0, 254)), used.major);
  section.read("by_ets", truth(), used.by_ets);
  used.udp = read_wanted(section, "udp", problems);
  used.tcp = read_wanted(section, "tcp", problems);
  used.multicast = read_wanted(section, "multicast", problems);
  if (!used.udp) {
    problems.error(section.mark(),
                   "used service: expected the eventgroup over UDP that is subscribed to, udp");
  }
  section.finish();
  return used;
}

void read_timing(Section& top, TimingProfile& timing, Problems& problems) {
  if (!has(top, "timing")) {
    return;
  }
  Section section{top.child("timing"), "timing", problems};
  read_optional(section, "initial_delay_max", any_duration(), timing.initial_delay_max);
  read_optional(section, "repetitions_base_delay", any_duration(), timing.repetitions_base_delay);
  read_optional(section, "repetitions_max", whole_number(0, 20), timing.repetitions_max);
  read_optional(section, "cyclic_offer_delay", any_duration(), timing.cyclic_offer_delay);
  section.read("answer_within", documents::duration(10ms, 1min), timing.answer_within);
  section.read("ready_within", documents::duration(10ms, 10min), timing.ready_within);
  section.finish();
}

void read_policy(Section& top, PolicyProfile& policy, Problems& problems) {
  if (!has(top, "policy")) {
    return;
  }
  Section section{top.child("policy"), "policy", problems};
  section.read("explicit_initial_data", truth(), policy.explicit_initial_data);
  section.read("multicast_find_answers", truth(), policy.multicast_find_answers);
  section.read("sd_endpoint_option", truth(), policy.sd_endpoint_option);
  section.read("answers_unknown_service", truth(), policy.answers_unknown_service);
  section.read("answers_unknown_method", truth(), policy.answers_unknown_method);
  section.read("processes_request_with_return_code", truth(), policy.processes_request_with_return_code);
  section.read("refuses_unknown_subscriptions", truth(), policy.refuses_unknown_subscriptions);
  section.read(
      "error_type",
      documents::one_of<ErrorType>(
          {{"response", ErrorType::response}, {"error", ErrorType::error}, {"either", ErrorType::either}}),
      policy.error_type);
  section.finish();
}

void read_lifecycle(Section& top, Profile& profile, Problems& problems) {
  const auto command = documents::any_text("a command");
  if (has(top, "lifecycle")) {
    Section section{top.child("lifecycle"), "lifecycle", problems};
    section.read("start", command, profile.lifecycle.start);
    section.read("stop", command, profile.lifecycle.stop);
    section.read("restart", command, profile.lifecycle.restart);
    section.read("ask_operator", truth(), profile.lifecycle.ask_operator);
    section.finish();
  }
  if (has(top, "faults")) {
    Section section{top.child("faults"), "faults", problems};
    section.require("list", command, profile.faults.list);
    section.require("start", command, profile.faults.start);
    section.finish();
  }
}

void read_network(Section& top, Profile& profile, Problems& problems) {
  Section network{top.child("network"), "network", problems};
  network.require("device", documents::ip_address(), profile.device);
  network.require("tester", documents::ip_address(), profile.tester);
  network.read("multicast", documents::multicast_address(), profile.multicast);
  network.read("sd_port", as<std::uint16_t>(whole_number(1, 65'535)), profile.sd_port);
  if (profile.device.v6 != profile.tester.v6 || profile.device.v6 != profile.multicast.v6) {
    problems.error(network.mark(),
                   "network: expected 'device', 'tester' and 'multicast' to be all of IPv4, or all of IPv6");
  }
  if (profile.device == profile.tester) {
    problems.error(network.mark(),
                   "network: expected two addresses: both sides use the port of service discovery");
  }
  network.finish();
}

}  // namespace

tl::expected<Profile, std::vector<documents::Problem>> read_profile(const std::string& text,
                                                                    const std::string& file,
                                                                    ProfileServices services) {
  Problems problems{file};
  Profile profile{.file = file};
  const YAML::Node node = documents::parse_document(text, "the profile of a device", problems);
  if (node.IsDefined() && !problems.has_errors()) {
    Section top{node, "", problems};
    top.require("name", documents::any_text("the name of the device"), profile.name);
    top.read("version", documents::any_text("the version of the device"), profile.version);
    read_network(top, profile, problems);
    if (has(top, "services")) {
      for (const YAML::Node& service : top.list("services", "a list of services")) {
        profile.services.push_back(read_service(service, profile.services, problems));
      }
    }
    if (has(top, "uses")) {
      for (const YAML::Node& used : top.list("uses", "a list of services that the device uses")) {
        profile.uses.push_back(read_used(used, problems));
      }
    }
    if (services == ProfileServices::needed && profile.services.empty() &&
        std::ranges::all_of(profile.uses, &UsedService::by_ets)) {
      problems.error(top.mark(),
                     "expected 'services' that the device offers, or one that it uses by itself, 'uses'");
    }
    top.read("ets", truth(), profile.ets);
    top.read("tp", truth(), profile.tp);
    read_timing(top, profile.timing, problems);
    read_policy(top, profile.policy, problems);
    read_lifecycle(top, profile, problems);
    top.finish();
  }
  if (problems.has_errors()) {
    return tl::unexpected{problems.take()};
  }
  return profile;
}

const ServiceProfile& Profile::service() const {
  static const ServiceProfile none{};
  return services.empty() ? none : services.front();
}

const UsedService& Profile::used_by_itself() const {
  static const UsedService none{};
  const auto found = std::ranges::find(uses, false, &UsedService::by_ets);
  return found == uses.end() ? none : *found;
}

const ServiceProfile* other_version(const Profile& profile, const ServiceProfile& service) {
  const auto found = std::ranges::find_if(profile.services, [&](const ServiceProfile& one) {
    return one.service == service.service && one.instance == service.instance && one.major != service.major;
  });
  return found == profile.services.end() ? nullptr : &*found;
}

std::optional<EventSource> event_source(const Profile& profile) {
  if (profile.ets) {
    return EventSource{.group = someip::EventgroupId{2},
                       .event = someip::MethodId{0x8001},
                       .trigger = someip::MethodId{0x03}};
  }
  for (const EventgroupProfile& one : profile.service().eventgroups) {
    if (!one.tcp && !one.multicast && !one.events.empty() && (one.trigger || one.cycle)) {
      return EventSource{.group = one.id,
                         .event = one.events.front(),
                         .trigger = one.trigger,
                         .cycle = one.cycle.value_or(Duration{0})};
    }
  }
  return std::nullopt;
}

std::optional<EventSource> event_source(const ServiceProfile& service, someip::MethodId event) {
  for (const EventgroupProfile& group : service.eventgroups) {
    const auto found = std::ranges::find(group.events, event);
    if (!group.tcp && !group.multicast && found != group.events.end() &&
        (group.trigger || (group.cycle && found == group.events.begin()))) {
      return EventSource{.group = group.id,
                         .event = event,
                         .trigger = group.trigger,
                         .cycle = group.cycle.value_or(Duration{0})};
    }
  }
  return std::nullopt;
}

std::optional<EventSource> tcp_event_source(const Profile& profile) {
  if (profile.ets) {
    return EventSource{.group = someip::EventgroupId{2},
                       .event = someip::MethodId{0x8003},
                       .trigger = someip::MethodId{0x05}};
  }
  return tcp_event_source(profile.service());
}

std::optional<EventSource> tcp_event_source(const ServiceProfile& service) {
  for (const EventgroupProfile& one : service.eventgroups) {
    if (one.tcp && !one.events.empty() && (one.cycle || (one.trigger && service.udp_port))) {
      return EventSource{.group = one.id,
                         .event = one.events.front(),
                         .trigger = one.trigger,
                         .cycle = one.cycle.value_or(Duration{0})};
    }
  }
  return std::nullopt;
}

std::optional<LargeRequest> large_request(const Profile& profile) {
  const LargeProfile& large = profile.service().large;
  if (profile.ets && profile.tp) {
    return LargeRequest{.method = someip::MethodId{0x09}, .is_echo = true};
  }
  if (large.echo) {
    return LargeRequest{.method = *large.echo, .is_echo = true};
  }
  return large.request ? std::optional{LargeRequest{.method = *large.request}} : std::nullopt;
}

std::optional<EventSource> large_event(const Profile& profile) {
  const auto event = profile.service().large.event;
  return event ? event_source(profile.service(), *event) : std::nullopt;
}

std::string filled_in(const std::string& command, const Profile& profile, const std::string& programs,
                      const std::string& fault) {
  std::string event_group = "224.244.224.246";
  for (const EventgroupProfile& group : profile.service().eventgroups) {
    if (group.multicast) {
      event_group = someip::to_string(group.multicast->address);
      break;
    }
  }
  const std::array<std::pair<std::string, std::string>, 7> words{
      {{"{device}", someip::to_string(profile.device)},
       {"{tester}", someip::to_string(profile.tester)},
       {"{multicast}", someip::to_string(profile.multicast)},
       {"{event_multicast}", event_group},
       {"{sd_port}", std::to_string(profile.sd_port)},
       {"{programs}", programs},
       {"{fault}", fault}}};
  std::string text = command;
  for (const auto& [word, value] : words) {
    for (auto at = text.find(word); at != std::string::npos; at = text.find(word, at + value.size())) {
      text.replace(at, word.size(), value);
    }
  }
  return text;
}

}  // namespace trestle::conform
