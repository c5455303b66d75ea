#include "bridge/carry/commands/summary.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "bridge/carry/config/pattern_conflicts.hpp"
#include "bridge/describe/e2e_profiles.hpp"
#include "bridge/documents/format.hpp"
#include "bridge/documents/problems.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::carry {
namespace {

using someip::value;

/// Of a route or a method.
std::string version(const auto& carried) {
  return carried.minor == sd::any_minor ? fmt::format("{}.any", carried.major)
                                        : fmt::format("{}.{}", carried.major, carried.minor);
}

std::string port(const Route& route) {
  const char* const transport = route.transport == Transport::tcp ? "tcp" : "udp";
  const std::string own =
      route.port == 0 ? fmt::format("{} any", transport) : fmt::format("{} {}", transport, route.port);
  return route.multicast ? fmt::format("{}, {} from {}", own, someip::to_string(route.multicast->group),
                                       route.multicast->threshold)
                         : own;
}

std::string width(someip::FieldWidth field) {
  return field == someip::FieldWidth::none ? "none" : fmt::format("{}", 8 * someip::bytes(field));
}

std::string describe(const someip::PayloadRules& rules) {
  constexpr std::array encodings{"UTF-8", "UTF-16LE", "UTF-16BE"};
  return fmt::format(
      "{} endian{}; bits of length fields: arrays {}, fixed arrays {}, strings {}, structs {}, unions {} "
      "(type {}, {} "
      "first); strings {}{}{}; {}",
      rules.byte_order == std::endian::big ? "big" : "little",
      rules.byte_order == std::endian::big ? ""
      : rules.length_fields_always_big     ? " (lengths big)"
                                           : " (lengths too)",
      width(rules.array_length), width(rules.fixed_array_length), width(rules.string_length),
      width(rules.struct_length), width(rules.union_length), width(rules.union_type),
      rules.union_length_first ? "length" : "type",
      encodings[static_cast<std::size_t>(rules.string_encoding)], rules.string_bom ? ", BOM" : "",
      rules.string_terminator ? ", terminator" : "",
      rules.alignment == 1 ? "no alignment" : fmt::format("aligned to {} bits", 8 * rules.alignment));
}

std::string describe(const messages::MessageRules& rules) {
  constexpr std::array forms{"", "a union", "8 bits", "16 bits", "32 bits", "empty"};
  std::string text = describe(rules.payload);
  text += rules.payload.union_null ? "; unions may be empty" : "";
  text += rules.payload.cut_longer_arrays ? "" : "; longer arrays refused";
  text += rules.default_missing ? "; missing fields get their defaults" : "";
  for (const auto& [name, type] : rules.types) {
    if (type.form != messages::TypeRules::Form::structure) {
      text += fmt::format("; {} is {}", name, forms[static_cast<std::size_t>(type.form)]);
    }
    if (!type.tags.empty()) {
      text += fmt::format("; {} has tags ({})", name,
                          rules.payload.smallest_tagged_length
                              ? "the smallest length"
                              : fmt::format("lengths of {} bits", width(rules.payload.tagged_length)));
    }
    if (!type.fixed_strings.empty()) {
      text += fmt::format("; {} has strings of fixed size", name);
    }
    if (!type.byte_orders.empty()) {
      text += fmt::format("; {} has fields with a byte order of their own", name);
    }
    if (!type.fields.empty() || type.itself != messages::FieldRules{}) {
      text +=
          fmt::format("; {} has {}{}{}", name, type.fields.empty() ? "" : "fields with rules of their own",
                      !type.fields.empty() && type.itself != messages::FieldRules{} ? " and " : "",
                      type.itself != messages::FieldRules{} ? "rules for itself" : "");
    }
  }
  return text;
}

std::string describe(const TpSettings& tp) {
  const std::string pace =
      tp.separation == Duration{0}
          ? "no pause"
          : fmt::format("{} after {}", documents::to_string(tp.separation),
                        tp.burst ? fmt::format("every {}", *tp.burst) : "as many as the receiver can take");
  return fmt::format("segments of {} bytes, {}, messages up to {}", tp.segment_bytes, pace,
                     documents::bytes_to_string(tp.max_message));
}

/// @param pattern  the pattern to which the settings belong, or null.
std::string describe(const QosSettings& qos, const TopicPattern* pattern = nullptr) {
  const bool is_locked = pattern != nullptr && pattern->route.direction == Direction::someip_to_dds;
  const bool reliability_follows = qos.reliability_as_published;
  const bool durability_follows = qos.durability_as_published || (is_locked && pattern->follow_durability);
  std::string text =
      fmt::format("{}, {}, keep {} {}",
                  reliability_follows ? "reliability as published"
                  : qos.reliable      ? "reliable"
                                      : "best effort",
                  durability_follows    ? is_locked ? "durability as locked" : "durability as published"
                  : qos.transient_local ? "transient local"
                                        : "volatile",
                  qos.keep_all ? "all up to" : "last", qos.depth);
  const auto add = [&](const char* what, Duration time) {
    text += time == Duration{0} ? "" : fmt::format(", {} {}", what, documents::to_string(time));
  };
  add("deadline", qos.deadline);
  add("lifespan", qos.lifespan);
  text += qos.manual_liveliness ? ", liveliness by topic" : "";
  add("lease", qos.liveliness_lease);
  return text;
}

std::string describe(const Presence& presence) {
  std::string text = presence.offer_while_published  ? "offered while published"
                     : presence.write_while_offered  ? "written while offered"
                     : presence.subscribe_while_read ? ""
                                                     : "always";
  if (presence.subscribe_while_read) {
    text += text.empty() ? "subscribed to while read" : ", subscribed to while read";
  }
  return text;
}

std::string describe_from(const std::vector<IpAddress>& bridges) {
  std::string text = bridges.empty() ? "not from other bridges" : "also from the bridges";
  for (const IpAddress& one : bridges) {
    text += " " + someip::to_string(one);
  }
  return text;
}

std::string describe_peers(const std::vector<sd::Subnet>& peers) {
  std::string text = peers.empty() ? "anybody" : "only";
  for (const sd::Subnet& one : peers) {
    text += " " + to_string(one);
  }
  return text;
}

std::string describe(const sd::AccessControl& access) {
  std::string text = describe_peers(access.peers);
  for (const sd::AccessPolicy& policy : access.policies) {
    text += fmt::format(", {} rule{}, others are {}", policy.rules.size(),
                        policy.rules.size() == 1 ? "" : "s", policy.allow_others ? "allowed" : "denied");
  }
  return text;
}

/// @param is_checked  received messages are checked.
/// @param is_protected  sent messages are protected.
std::string describe(const E2eSettings& e2e, bool is_protected, bool is_checked) {
  std::string text = fmt::format("profile {}", describe::e2e_profile(e2e.profile).name);
  std::visit(
      [&](const auto& profile) {
        if constexpr (requires { profile.data_id; }) {
          text += fmt::format(", data id 0x{:x}", profile.data_id);
        } else {
          text += ", 16 data ids";
        }
        if constexpr (requires { profile.offset_bits; }) {
          text += fmt::format(", header at bit {}", profile.offset_bits);
        } else {
          text += fmt::format(", CRC at bit {}, counter at bit {}", profile.crc_offset_bits,
                              profile.counter_offset_bits);
        }
        if constexpr (requires { profile.data_bits; }) {
          text += fmt::format(", always {} bits", profile.data_bits);
        }
      },
      e2e.profile);
  text += e2e.payload_only ? " of the payload alone" : " from the Request ID on";
  if (e2e.source_id != 0) {
    text += fmt::format(", source id 0x{:x}", e2e.source_id);
  }
  text += is_protected ? "; protected" : "";
  if (is_checked) {
    text += is_protected ? " and checked" : "; checked";
    text += e2e.pass_failed ? ", what fails is carried" : ", what fails is dropped";
  }
  return text;
}

/// Rarely used settings, one line each.
std::string describe_more(const DdsSettings& dds) {
  std::string text;
  if (!dds.profiles_file.empty()) {
    text += fmt::format("          profile {} of {}\n", dds.profile, dds.profiles_file);
  }
  for (const dds::DiscoveryServer& server : dds.discovery_servers) {
    if (!server.address.empty()) {
      const bool v6 = server.address.find(':') != std::string::npos;
      text += fmt::format("          discovery server {}{}{}:{}\n", v6 ? "[" : "", server.address,
                          v6 ? "]" : "", server.port);
    }
  }
  if (!dds.security.keystore.empty()) {
    text +=
        fmt::format("          security: enclave {} of {}\n", dds.security.enclave, dds.security.keystore);
  }
  return text;
}

/// One line for each different setting, with the topics that have it, unless that is all of them.
void append_settings(std::string& out, const char* title, const std::vector<Route>& routes,
                     const cli::Colours& colours,
                     const std::function<std::string(const Route&)>& describe_route) {
  std::vector<std::pair<std::string, std::vector<std::string>>> groups;
  for (const Route& route : routes) {
    const std::string text = describe_route(route);
    auto group = std::ranges::find(groups, text, &std::pair<std::string, std::vector<std::string>>::first);
    if (group == groups.end()) {
      group = groups.insert(group, {text, {}});
    }
    group->second.push_back(route.topic);
  }
  for (const auto& [text, topics] : groups) {
    out += fmt::format("  {}{:<5}{} {}", colours.dim, title, colours.off, text);
    out += groups.size() > 1 ? fmt::format("\n          for {}\n", fmt::join(topics, ", ")) : "\n";
  }
}

/// Each mapping of fields, a line for each field.
void append_maps(std::string& out, const std::vector<Route>& routes, const cli::Colours& colours) {
  for (const Route& route : routes) {
    if (!route.mapping) {
      continue;
    }
    const bool to_ros = route.direction == Direction::someip_to_dds;
    out += fmt::format("  {}{:<5}{} {}: {} of {}\n", colours.dim, "map", colours.off, route.topic,
                       to_ros ? route.type : route.mapping->payload.text,
                       to_ros ? route.mapping->payload.text : route.type);
    for (const std::string& line : messages::in_lines(*route.mapping, map_direction(route.direction))) {
      out += fmt::format("          {}\n", documents::printable(line));
    }
  }
}

using Row = std::array<std::string, 9>;
constexpr std::size_t route_name = 7;  ///< its column

Row row(const Route& route, const IdNames& names) {
  return {route.topic,
          route.direction == Direction::dds_to_someip ? "->" : "<-",
          fmt::format("0x{:04x}.0x{:04x}", value(route.service), value(route.instance)),
          fmt::format("0x{:04x}", value(route.event)),
          fmt::format("0x{:04x}", value(route.eventgroup)),
          version(route),
          port(route),
          names.member(value(route.service), route.major, value(route.event)),
          route.type};
}

/// @param optional  the column that is left out if it is empty.
template <typename Cells>
void append_table(std::string& out, const std::vector<Cells>& rows, const cli::Colours& colours,
                  std::optional<std::size_t> optional = std::nullopt) {
  std::array<std::size_t, std::tuple_size_v<Cells>> widths{};
  const bool has_all =
      !optional || std::ranges::any_of(rows.begin() + 1, rows.end(),
                                       [&](const Cells& cells) { return !cells[*optional].empty(); });
  for (const Cells& cells : rows) {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      widths[i] = std::max(widths[i], cells[i].size());
    }
  }
  for (const Cells& cells : rows) {
    const bool is_title = &cells == &rows.front();
    out += is_title ? colours.dim : "";
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (i == optional && !has_all) {
        continue;
      }
      out += i + 1 == cells.size() ? "  " + cells[i] : fmt::format("  {:<{}}", cells[i], widths[i]);
    }
    out += is_title ? std::string{colours.off} + "\n" : "\n";
  }
  out += "\n";
}

using PatternRow = std::array<std::string, 9>;

PatternRow row(const TopicPattern& pattern, const BridgeConfig& config) {
  const Route& route = pattern.route;
  const bool outbound = route.direction == Direction::dds_to_someip;
  const auto locked = std::ranges::count_if(config.locked, [&](const LockedTopic& one) {
    return pattern_of(config.patterns, one.topic) == &pattern;
  });
  return {pattern.topics,
          outbound ? "->" : "<-",
          outbound
              ? fmt::format("0x{:04x}-0x{:04x}", value(pattern.services.first), value(pattern.services.last))
              : "as locked",
          fmt::format("0x{:04x}", value(route.instance)),
          fmt::format("0x{:04x}", value(route.event)),
          fmt::format("0x{:04x}", value(route.eventgroup)),
          version(route),
          port(route),
          outbound ? fmt::format("{} of {}", locked, pattern.max_routes) : fmt::format("{}", locked)};
}

/// A topic of the lock file that has no row of its own as a route.
using LockedRow = std::array<std::string, 4>;

LockedRow row(const LockedTopic& locked, const BridgeConfig& config) {
  const TopicPattern* const pattern = pattern_of(config.patterns, locked.topic);
  return {locked.topic, fmt::format("0x{:04x}", value(locked.service)),
          pattern != nullptr ? pattern->topics : "none: reserved", locked.type};
}

/// The routes, and for each pattern a route with the settings of those that it will make.
std::vector<Route> with_patterns(const BridgeConfig& config) {
  std::vector<Route> routes = config.routes;
  for (const TopicPattern& pattern : config.patterns) {
    routes.push_back(pattern.route);
    routes.back().topic = pattern.topics;
  }
  return routes;
}

void append_patterns(std::string& out, const BridgeConfig& config, const cli::Colours& colours) {
  if (config.patterns.empty()) {
    return;
  }
  std::vector<PatternRow> rows{
      {"PATTERN", "", "SERVICES", "INSTANCE", "EVENT", "GROUP", "VERSION", "PORT", "LOCKED"}};
  for (const TopicPattern& pattern : config.patterns) {
    rows.push_back(row(pattern, config));
  }
  append_table(out, rows, colours);
  for (const TopicPattern& pattern : config.patterns) {
    if (!pattern.exclude.empty()) {
      out += fmt::format("  {} without {}\n\n", pattern.topics, fmt::join(pattern.exclude, ", "));
    }
  }
  std::vector<LockedRow> locked{{"LOCKED", "SERVICE", "PATTERN", "TYPE"}};
  for (const LockedTopic& one : config.locked) {
    if (std::ranges::find(config.routes, one.topic, &Route::topic) == config.routes.end()) {
      locked.push_back(row(one, config));
    }
  }
  out += fmt::format("  {}ids are kept in{} {}\n", colours.dim, colours.off, config.lock_file);
  if (locked.size() > 1) {
    append_table(out, locked, colours);
  } else {
    out += "\n";
  }
}

using MethodRow = std::array<std::string, 8>;
constexpr std::size_t method_name = 6;

MethodRow row(const MethodRoute& method, const IdNames& names) {
  const std::string transport = !method.transport                     ? "as offered"
                                : *method.transport == Transport::tcp ? "tcp"
                                                                      : "udp";
  return {method.ros_service,
          method.server == Server::someip ? "->" : "<-",
          fmt::format("0x{:04x}.0x{:04x}", value(method.service), value(method.instance)),
          fmt::format("0x{:04x}", value(method.method)),
          version(method),
          method.port == 0 ? transport : fmt::format("{} {}", transport, method.port),
          names.member(value(method.service), method.major, value(method.method)),
          method.type};
}

std::string describe(const MethodRoute& method) {
  constexpr std::array form_names{"as the peer's", "of rmw_fastrtps", "of rmw_cyclonedds"};
  return fmt::format("{}{}, at most {} at once, ROS form {}", method.offer_always ? "always offered, " : "",
                     method.fire_and_forget
                         ? "no answer"
                         : fmt::format("answer within {}", documents::to_string(method.timeout)),
                     method.max_calls, form_names[static_cast<std::size_t>(method.form)]);
}

/// Services whose types are made by the bridge: no package has them yet, and ROS nodes need them for calls.
void append_made_services(std::string& out, const BridgeConfig& config, const cli::Colours& colours) {
  std::map<std::string, std::vector<std::string>> made;
  for (const MethodRoute& method : config.methods) {
    if (method.access != messages::FieldAccess::none &&
        method.type == field_service_name(method.value_type, method.access)) {
      made[method.type].push_back(method.ros_service);
    }
  }
  for (const auto& [type, names] : made) {
    out += fmt::format("  {}made{}  {}, which ROS nodes get by --field-services\n          for {}\n",
                       colours.dim, colours.off, type, fmt::join(names, ", "));
  }
}

/// Like append_settings() for routes.
void append_method_settings(std::string& out, const char* title, const std::vector<MethodRoute>& methods,
                            const cli::Colours& colours,
                            const std::function<std::string(const MethodRoute&)>& describe_method) {
  std::map<std::string, std::vector<std::string>> groups;
  for (const MethodRoute& method : methods) {
    groups[describe_method(method)].push_back(method.ros_service);
  }
  for (const auto& [text, names] : groups) {
    out += fmt::format("  {}{:<5}{} {}\n          for {}\n", colours.dim, title, colours.off, text,
                       fmt::join(names, ", "));
  }
}

/// End-to-end protection, where there is any.
void append_e2e(std::string& out, const BridgeConfig& config, const cli::Colours& colours) {
  const bool of_routes =
      std::ranges::any_of(config.routes, [](const Route& route) { return route.e2e.has_value(); });
  const bool of_getters = std::ranges::any_of(
      config.routes, [](const Route& route) { return route.getter && route.getter->e2e; });
  const bool of_methods =
      std::ranges::any_of(config.methods, [](const MethodRoute& method) { return method.e2e.has_value(); });
  if (of_routes) {
    append_settings(out, "E2E", config.routes, colours, [](const Route& route) {
      const bool is_sent = route.direction == Direction::dds_to_someip;
      return route.e2e ? describe(*route.e2e, is_sent, !is_sent) : std::string{"none"};
    });
  }
  for (const Route& route : config.routes) {
    if (route.getter && route.getter->e2e) {
      out += fmt::format("  {}E2E{}   {}\n          for the getter of {}\n", colours.dim, colours.off,
                         describe(*route.getter->e2e, true, true), route.topic);
    }
  }
  if (of_methods) {
    append_method_settings(out, "E2E", config.methods, colours, [](const MethodRoute& method) {
      if (!method.e2e) {
        return std::string{"none"};
      }
      const bool is_one_way = method.fire_and_forget;
      return describe(*method.e2e, !is_one_way || method.server == Server::someip,
                      !is_one_way || method.server == Server::ros);
    });
  }
  const bool has_checks = of_routes || of_getters || of_methods;
  if (has_checks || (config.diagnostics.wanted && !config.methods.empty())) {
    out += fmt::format("          {} are published on {}, every {} and when a state changes\n",
                       has_checks ? "checks" : "methods", config.diagnostics.topic,
                       documents::to_string(config.diagnostics.period));
  }
}

std::string count_of(std::size_t number, const char* what) {
  return fmt::format("{} {}{}", number, what, number == 1 ? "" : "s");
}

}  // namespace

std::string count_of_all(const BridgeConfig& config) {
  std::string text = config.routes.empty() ? "" : count_of(config.routes.size(), "route");
  if (!config.methods.empty()) {
    text += (text.empty() ? "" : ", ") + count_of(config.methods.size(), "method");
  }
  if (!config.patterns.empty()) {
    text += (text.empty() ? "" : ", ") + count_of(config.patterns.size(), "pattern");
  }
  return text;
}

std::string summary(const BridgeConfig& config, const cli::Colours& colours, const IdNames& names) {
  const SomeipSettings& settings = config.someip;
  std::string out = fmt::format("{}{}{}: {}good{}, {}\n", colours.bold, config.file, colours.off,
                                colours.green, colours.off, count_of_all(config));
  out +=
      fmt::format("  {}DDS{}     domain {}, {}{}\n", colours.dim, colours.off, config.dds.domain,
                  config.dds.interfaces.empty() ? "all interfaces"
                                                : fmt::format("on {}", fmt::join(config.dds.interfaces, " ")),
                  config.dds.shared_memory == true ? ", shared memory" : "");
  if (config.dds.strict_types) {
    out.insert(out.size() - 1, ", strict types");
  }
  if (config.dds.lease != DdsSettings{}.lease) {
    out.insert(out.size() - 1, fmt::format(", lease {}", documents::to_string(config.dds.lease)));
  }
  out += fmt::format(
      "  {}ROS 2{}   node {}{}\n", colours.dim, colours.off, config.dds.node,
      config.dds.ros_distro.empty() ? "" : fmt::format(", among those of {}", config.dds.ros_distro));
  out += describe_more(config.dds);
  out += fmt::format("  {}SOME/IP{} {}{}, discovery at {}:{}, offers live {}\n\n", colours.dim, colours.off,
                     someip::to_string(settings.address),
                     settings.multicast_interface.empty() ? "" : " (" + settings.multicast_interface + ")",
                     someip::to_string(settings.multicast), settings.port,
                     settings.timing.ttl_s == 0xff'ffff
                         ? "until the next reboot"
                         : documents::to_string(Duration{std::chrono::seconds{settings.timing.ttl_s}}));
  if (!settings.access.peers.empty() || !settings.access.policies.empty()) {
    out.insert(out.size() - 1,
               fmt::format("\n  {}peers{}   {}", colours.dim, colours.off, describe(settings.access)));
  }

  if (!config.routes.empty()) {
    std::vector<Row> rows{
        {"TOPIC", "", "SERVICE.INSTANCE", "EVENT", "GROUP", "VERSION", "PORT", "NAME", "TYPE"}};
    std::ranges::transform(config.routes, std::back_inserter(rows),
                           [&](const Route& route) { return row(route, names); });
    append_table(out, rows, colours, route_name);
  }
  if (!config.methods.empty()) {
    std::vector<MethodRow> rows{
        {"ROS SERVICE", "", "SERVICE.INSTANCE", "METHOD", "VERSION", "PORT", "NAME", "TYPE"}};
    std::ranges::transform(config.methods, std::back_inserter(rows),
                           [&](const MethodRoute& method) { return row(method, names); });
    append_table(out, rows, colours, method_name);
  }
  append_patterns(out, config, colours);
  const std::vector<Route> routes = with_patterns(config);
  append_settings(out, "wire", routes, colours, [](const Route& route) { return describe(route.rules); });
  append_settings(out, "TP", routes, colours, [](const Route& route) { return describe(route.tp); });
  append_settings(out, "QoS", routes, colours, [&](const Route& route) {
    const auto pattern = std::ranges::find(config.patterns, route.topic, &TopicPattern::topics);
    return describe(route.qos, pattern == config.patterns.end() ? nullptr : &*pattern);
  });
  append_maps(out, config.routes, colours);
  append_e2e(out, config, colours);
  if (std::ranges::any_of(routes, [](const Route& route) { return route.presence != Presence{}; })) {
    append_settings(out, "there", routes, colours,
                    [](const Route& route) { return describe(route.presence); });
  }
  if (std::ranges::any_of(routes, [](const Route& route) { return !route.from_bridges.empty(); })) {
    append_settings(out, "from", routes, colours,
                    [](const Route& route) { return describe_from(route.from_bridges); });
  }
  if (std::ranges::any_of(routes, [](const Route& route) { return !route.peers.empty(); })) {
    append_settings(out, "peers", routes, colours,
                    [](const Route& route) { return describe_peers(route.peers); });
  }
  const auto has_getter = [](const Route& route) { return route.getter.has_value(); };
  if (std::ranges::any_of(config.routes, has_getter)) {
    append_settings(out, "get", config.routes, colours, [](const Route& route) {
      return route.getter
                 ? fmt::format("getter 0x{:04x}, answered with the last sample", value(route.getter->id))
                 : std::string{"no getter"};
    });
  }
  append_method_settings(out, "wire", config.methods, colours,
                         [](const MethodRoute& method) { return describe(method.rules); });
  append_method_settings(out, "TP", config.methods, colours,
                         [](const MethodRoute& method) { return describe(method.tp); });
  if (std::ranges::any_of(config.methods, [](const MethodRoute& one) { return !one.from_bridges.empty(); })) {
    append_method_settings(out, "from", config.methods, colours,
                           [](const MethodRoute& method) { return describe_from(method.from_bridges); });
  }
  if (std::ranges::any_of(config.methods, [](const MethodRoute& one) { return !one.peers.empty(); })) {
    append_method_settings(out, "peers", config.methods, colours,
                           [](const MethodRoute& method) { return describe_peers(method.peers); });
  }
  append_method_settings(out, "calls", config.methods, colours,
                         [](const MethodRoute& method) { return describe(method); });
  append_made_services(out, config, colours);
  return out;
}

}  // namespace trestle::carry
