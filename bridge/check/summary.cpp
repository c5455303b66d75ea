#include "bridge/check/summary.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <functional>
#include <utility>
#include <vector>

#include "bridge/config/format.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::bridge {
namespace {

using someip::value;

constexpr std::uint32_t any_minor = 0xffff'ffff;

std::string version(const Route& route) {
  return route.minor == any_minor ? fmt::format("{}.any", route.major)
                                  : fmt::format("{}.{}", route.major, route.minor);
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
      rules.length_fields_always_big && rules.byte_order == std::endian::little ? " (lengths big)" : "",
      width(rules.array_length), width(rules.fixed_array_length), width(rules.string_length),
      width(rules.struct_length), width(rules.union_length), width(rules.union_type),
      rules.union_length_first ? "length" : "type",
      encodings[static_cast<std::size_t>(rules.string_encoding)], rules.string_bom ? ", BOM" : "",
      rules.string_terminator ? ", terminator" : "",
      rules.alignment == 1 ? "no alignment" : fmt::format("aligned to {} bits", 8 * rules.alignment));
}

std::string describe(const MessageRules& rules) {
  constexpr std::array forms{"", "a union", "8 bits", "16 bits", "32 bits"};
  std::string text = describe(rules.payload);
  text += rules.payload.union_null ? "; unions may be empty" : "";
  text += rules.payload.cut_longer_arrays ? "" : "; longer arrays refused";
  text += rules.default_missing ? "; missing fields get their defaults" : "";
  for (const auto& [name, type] : rules.types) {
    if (type.form != TypeRules::Form::structure) {
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
  }
  return text;
}

std::string describe(const TpSettings& tp) {
  const std::string pace = tp.separation == Duration{0}
                               ? "no pause"
                               : fmt::format("{} after every {}", to_string(tp.separation), tp.burst);
  return fmt::format("segments of {} bytes, {}, messages up to {}", tp.segment_bytes, pace,
                     bytes_to_string(tp.max_message));
}

std::string describe(const QosSettings& qos) {
  return fmt::format("{}, {}, keep last {}", qos.reliable ? "reliable" : "best effort",
                     qos.transient_local ? "transient local" : "volatile", qos.depth);
}

/// One line for each different setting, with the topics that have it, unless that is all of them.
void append_settings(std::string& out, const char* title, const std::vector<Route>& routes,
                     const Colours& colours, const std::function<std::string(const Route&)>& describe_route) {
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

using Row = std::array<std::string, 8>;

Row row(const Route& route) {
  return {route.topic,
          route.direction == Direction::dds_to_someip ? "->" : "<-",
          fmt::format("0x{:04x}.0x{:04x}", value(route.service), value(route.instance)),
          fmt::format("0x{:04x}", value(route.event)),
          fmt::format("0x{:04x}", value(route.eventgroup)),
          version(route),
          port(route),
          route.type};
}

}  // namespace

std::string summary(const BridgeConfig& config, const Colours& colours) {
  const SomeipSettings& settings = config.someip;
  std::string out =
      fmt::format("{}{}{}: {}good{}, {} route{}\n", colours.bold, config.file, colours.off, colours.green,
                  colours.off, config.routes.size(), config.routes.size() == 1 ? "" : "s");
  out +=
      fmt::format("  {}DDS{}     domain {}, {}{}\n", colours.dim, colours.off, config.dds.domain,
                  config.dds.interfaces.empty() ? "all interfaces"
                                                : fmt::format("on {}", fmt::join(config.dds.interfaces, " ")),
                  config.dds.shared_memory ? ", shared memory" : "");
  out += fmt::format(
      "  {}SOME/IP{} {}{}, discovery at {}:{}, offers live {}\n\n", colours.dim, colours.off,
      someip::to_string(settings.address), settings.interface.empty() ? "" : " (" + settings.interface + ")",
      someip::to_string(settings.sd.multicast), settings.sd.port,
      settings.sd.ttl.count() == 0xff'ffff ? "until the next reboot" : to_string(Duration{settings.sd.ttl}));

  std::vector<Row> rows{{"TOPIC", "", "SERVICE.INSTANCE", "EVENT", "GROUP", "VERSION", "PORT", "TYPE"}};
  std::ranges::transform(config.routes, std::back_inserter(rows), row);
  std::array<std::size_t, std::tuple_size_v<Row>> widths{};
  for (const Row& cells : rows) {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      widths[i] = std::max(widths[i], cells[i].size());
    }
  }
  for (const Row& cells : rows) {
    const bool is_title = &cells == &rows.front();
    out += is_title ? colours.dim : "";
    for (std::size_t i = 0; i < cells.size(); ++i) {
      out += i + 1 == cells.size() ? "  " + cells[i] : fmt::format("  {:<{}}", cells[i], widths[i]);
    }
    out += is_title ? std::string{colours.off} + "\n" : "\n";
  }
  out += "\n";
  append_settings(out, "wire", config.routes, colours,
                  [](const Route& route) { return describe(route.rules); });
  append_settings(out, "TP", config.routes, colours, [](const Route& route) { return describe(route.tp); });
  append_settings(out, "QoS", config.routes, colours, [](const Route& route) { return describe(route.qos); });
  return out;
}

}  // namespace trestle::bridge
