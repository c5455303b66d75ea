#include "bridge/inspect/tools/picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "bridge/cli/terminal.hpp"
#include "bridge/inspect/decode/message_json.hpp"
#include "sd/net/discovery_text.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::inspect {
namespace {

struct Line {
  const char* colour = "";
  std::string text;
};

struct Table {
  Line heading;
  std::vector<Line> rows;
};

std::string count_text(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

std::string age_text(Duration age) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(age).count();
  return seconds < 120    ? fmt::format("{} s", std::max<std::int64_t>(seconds, 0))
         : seconds < 7200 ? fmt::format("{} min", seconds / 60)
                          : fmt::format("{} h", seconds / 3600);
}

/// "812 B", "3.45 kB", "120 MB".
std::string size_text(double bytes) {
  const char* unit = "B";
  for (const char* larger : {"kB", "MB", "GB"}) {
    if (bytes < 999.5) {
      break;
    }
    bytes /= 1000;
    unit = larger;
  }
  const bool whole = *unit == 'B';
  return fmt::format("{:.{}f} {}", bytes, whole || bytes >= 99.95 ? 0 : bytes < 9.995 ? 2 : 1, unit);
}

std::string number_text(double number) {
  return fmt::format("{:.{}f}", number, number < 99.95 ? 1 : 0);
}

template <typename Seen>
std::string lifetime_text(const Seen& seen, TimePoint now) {
  if (seen.gone) {
    return "gone";
  }
  if (!seen.expires_ever()) {
    return "until reboot";
  }
  return fmt::format("{:.0f} of {} s", std::chrono::duration<double>{seen.expires() - now}.count(),
                     seen.ttl_s);
}

/// As wide as the widest of its texts, and at least `least`.
template <typename Rows, typename Text>
std::size_t width_of(std::size_t least, const Rows& rows, Text text) {
  for (const auto& [key, one] : rows) {
    least = std::max(least, text(one).size());
  }
  return least;
}

Table services_table(const Picture& picture, const cli::Colours& colours) {
  constexpr const char* row = "{:<{}}  {:<10}  {:<15}  {:>7}  {:<12}  {}";
  const auto& services = picture.seen.network().services();
  const auto name = [&](const traffic::SeenService& one) {
    return service_text(one.service, one.instance, one.major, picture.names);
  };
  const std::size_t width = width_of(16, services, name);
  Table table{{colours.dim, fmt::format(row, "SERVICE.INSTANCE", width, "VERSION", "OFFERED BY", "FOR",
                                        "LIFETIME", "ENDPOINTS")},
              {}};
  for (const auto& [key, one] : services) {
    table.rows.push_back({one.gone ? colours.red : "",
                          fmt::format(row, name(one), width, fmt::format("{}.{}", one.major, one.minor),
                                      someip::to_string(one.peer.address),
                                      age_text(one.gone.value_or(picture.now) - one.first_seen),
                                      lifetime_text(one, picture.now), endpoints(one.udp, one.tcp))});
  }
  return table;
}

Table subscriptions_table(const Picture& picture, const cli::Colours& colours) {
  using State = traffic::SeenSubscription::State;
  constexpr const char* row = "{:<{}}  {:<{}}  {:<15}  {:<12}  {:>7}  {:<12}  {}";
  const auto& subscriptions = picture.seen.network().subscriptions();
  const auto name = [&](const traffic::SeenSubscription& one) {
    return service_text(one.service, one.instance, one.major, picture.names);
  };
  const auto group = [&](const traffic::SeenSubscription& one) {
    return eventgroup_text(one.service, one.eventgroup, picture.names);
  };
  const std::size_t width = width_of(16, subscriptions, name);
  const std::size_t group_width = width_of(10, subscriptions, group);
  Table table{{colours.dim, fmt::format(row, "SERVICE.INSTANCE", width, "EVENTGROUP", group_width,
                                        "SUBSCRIBER", "STATE", "FOR", "LIFETIME", "EVENTS GO TO")},
              {}};
  for (const auto& [key, one] : subscriptions) {
    const bool bad = one.gone || one.state == State::refused;
    table.rows.push_back(
        {bad                         ? colours.red
         : one.state == State::asked ? colours.yellow
                                     : "",
         fmt::format(row, name(one), width, group(one), group_width,
                     someip::to_string(one.subscriber.address), to_string(one.state),
                     age_text(one.gone.value_or(picture.now) - one.first_seen),
                     lifetime_text(one, picture.now), endpoints(one.udp, one.tcp, one.multicast))});
  }
  return table;
}

std::string remarks(const SeenTraffic& row) {
  std::string text;
  const auto add = [&](const std::string& what) { text += (text.empty() ? "" : ", ") + what; };
  if (row.skipped > 0) {
    add(fmt::format("{} lost", row.skipped));
  }
  if (row.errors > 0) {
    add(count_text(row.errors, "error"));
  }
  if (const auto latency = row.median_latency()) {
    add("p50 " + cli::duration_text(latency->count()));
  }
  return text;
}

std::string server_of(const SeenTraffic& row) {
  return fmt::format("{} {}", row.transport == Transport::tcp ? "tcp" : "udp", someip::to_string(row.server));
}

Table traffic_table(const Picture& picture, const cli::Colours& colours) {
  constexpr const char* row = "{:<{}}  {:<{}}  {:>10}  {:>9}  {:>8}  {:<16}  {}";
  const auto& traffic = picture.seen.traffic().rows();
  const InstanceNames names{picture.seen.network(), picture.names};
  const std::size_t width = width_of(16, traffic, [&](const SeenTraffic& one) { return names.of(one); });
  const std::size_t what_width =
      width_of(13, traffic, [&](const SeenTraffic& one) { return names.traffic_of(one); });
  Table table{{colours.dim, fmt::format(row, "SERVICE.INSTANCE", width, "TRAFFIC", what_width, "PER SECOND",
                                        "BYTES/S", "IN ALL", "NOTES", "SERVER")},
              {}};
  for (const auto& [key, one] : traffic) {
    const Rate rate = picture.live ? one.recent.per_second(picture.now) : one.mean();
    table.rows.push_back({one.skipped > 0 || one.errors > 0 ? colours.yellow : "",
                          fmt::format(row, names.of(one), width, names.traffic_of(one), what_width,
                                      rate.messages > 0 ? number_text(rate.messages) : "-",
                                      rate.bytes > 0 ? size_text(rate.bytes) : "-", one.messages,
                                      remarks(one), server_of(one))});
  }
  return table;
}

std::vector<Table> tables_of(const Picture& picture, const cli::Colours& colours) {
  std::vector<Table> tables{services_table(picture, colours)};
  if (picture.traffic) {
    tables.push_back(subscriptions_table(picture, colours));
    tables.push_back(traffic_table(picture, colours));
  }
  return tables;
}

std::string title_of(const Picture& picture) {
  std::size_t offered = 0;
  std::set<Endpoint> hosts;
  const traffic::NetworkView& network = picture.seen.network();
  for (const auto& [key, service] : network.services()) {
    if (!service.gone) {
      ++offered;
      hosts.insert(service.peer);
    }
  }
  std::string text = fmt::format("SOME/IP at {}: {} of {}", picture.where, count_text(offered, "service"),
                                 count_text(hosts.size(), "host"));
  if (picture.traffic) {
    const auto now = [](const auto& one) { return !one.second.gone; };
    const auto subscribed = std::ranges::count_if(network.subscriptions(), now);
    text += ", " + count_text(static_cast<std::size_t>(subscribed), "subscription");
    const Rate rate = picture.seen.traffic().recent().per_second(picture.now);
    text += picture.live
                ? fmt::format(", {} messages/s, {}/s", number_text(rate.messages), size_text(rate.bytes))
                : ", " + count_text(picture.seen.traffic().counters().messages, "message");
  }
  text += "; " + count_text(network.counters().messages, "discovery message");
  const auto add = [&](std::uint64_t count, const char* what) {
    if (count > 0) {
      text += fmt::format(", {} {}", count, what);
    }
  };
  add(picture.seen.malformed(), "malformed");
  add(network.counters().not_kept + picture.seen.traffic().counters().not_kept, "too many to show");
  add(picture.dropped, "frames missed");
  return text;
}

/// Three digits behind the point are enough for rates.
double rounded(double number) {
  return std::round(number * 1000) / 1000;
}

}  // namespace

std::string screen_of(const Picture& picture, cli::TerminalSize size, const cli::Colours& colours) {
  std::string out = "\033[H";
  const auto line = [&](const Line& one) {
    // Not wider than the screen; the rest of the old line is cleared.
    out += one.colour + one.text.substr(0, size.columns) + colours.off + "\033[K\n";
  };
  line({colours.bold, title_of(picture)});
  const std::vector<Table> tables = tables_of(picture, colours);
  // Each table takes an empty line, its heading, and perhaps a line with the number of hidden rows; the
  // cursor stands on the last line of the screen. Rows that one table does not need go to the next ones.
  std::size_t room = size.rows > 2 ? size.rows - 2 : 0;
  for (std::size_t at = 0; at < tables.size(); ++at) {
    const Table& table = tables[at];
    const std::size_t share = room / (tables.size() - at);
    const std::size_t spare = share > 2 ? share - 2 : 0;
    const bool all = table.rows.size() <= spare;
    const std::size_t shown = all ? table.rows.size() : spare > 0 ? spare - 1 : 0;
    if (share < 3) {
      continue;
    }
    line({});
    line(table.heading);
    std::for_each_n(table.rows.begin(), shown, line);
    if (!all) {
      line({colours.dim,
            fmt::format("... {} more: make the window larger, or use trestle watch --for 5 | less",
                        table.rows.size() - shown)});
    }
    room -= 2 + shown + (all ? 0 : 1);
  }
  return out + "\033[J";
}

std::string text_of(const Picture& picture, const cli::Colours& colours) {
  std::string out;
  const auto line = [&](const Line& one) { out += one.colour + one.text + colours.off + "\n"; };
  line({colours.bold, title_of(picture)});
  for (const Table& table : tables_of(picture, colours)) {
    line({});
    line(table.heading);
    std::ranges::for_each(table.rows, line);
  }
  return out;
}

std::string describe(const SeenTraffic& row, const InstanceNames& names, const Rate& rate) {
  const std::string more = remarks(row);
  return fmt::format("{:<12}  {}  {}  {} /s  {}/s  {}{}{}", "traffic", names.of(row), names.traffic_of(row),
                     number_text(rate.messages), size_text(rate.bytes), server_of(row),
                     more.empty() ? "" : "  ", more);
}

void add_traffic(Json& object, const SeenTraffic& row, const InstanceNames& names, const Rate& rate) {
  object["service"] = sd::hexadecimal(value(row.service));
  if (const auto instance = names.instance_of(row)) {
    object["instance"] = sd::hexadecimal(value(*instance));
  }
  object[row.event ? "event" : "method"] = sd::hexadecimal(value(row.method));
  names.add_names(object, row);
  object["server"] = someip::to_string(row.server);
  object["transport"] = row.transport == Transport::tcp ? "tcp" : "udp";
  object["messages_per_second"] = rounded(rate.messages);
  object["bytes_per_second"] = rounded(rate.bytes);
  object["messages"] = row.messages;
  object["bytes"] = row.bytes;
  if (row.event) {
    object["lost"] = row.skipped;
    return;
  }
  object["answers"] = row.answers;
  object["errors"] = row.errors;
  if (const auto latency = row.median_latency()) {
    object["latency_p50_ns"] = latency->count();
  }
}

std::string json_of(const Picture& picture) {
  const traffic::NetworkView& network = picture.seen.network();
  Json object;
  object["seen"] = "summary";
  object["where"] = picture.where;
  object["time"] = time_text(picture.now);
  object["seconds"] = rounded(std::chrono::duration<double>{picture.now - picture.since}.count());
  Json& services = object["services"] = Json::array();
  for (const auto& [key, one] : network.services()) {
    Json& row = services.emplace_back();
    add_service(row, one, picture.names);
    row["since"] = time_text(one.first_seen);
    row["gone"] = one.gone.has_value();
  }
  if (picture.traffic) {
    Json& subscriptions = object["subscriptions"] = Json::array();
    for (const auto& [key, one] : network.subscriptions()) {
      Json& row = subscriptions.emplace_back();
      add_subscription(row, one, picture.names);
      row["state"] = to_string(one.state);
      row["since"] = time_text(one.first_seen);
      row["gone"] = one.gone.has_value();
    }
    const InstanceNames names{network, picture.names};
    Json& traffic = object["traffic"] = Json::array();
    for (const auto& [key, one] : picture.seen.traffic().rows()) {
      add_traffic(traffic.emplace_back(), one, names, one.mean());
    }
  }
  Json& counters = object["counters"];
  counters["discovery_messages"] = network.counters().messages;
  counters["messages"] = picture.seen.traffic().counters().messages;
  counters["malformed"] = picture.seen.malformed();
  counters["not_kept"] = network.counters().not_kept + picture.seen.traffic().counters().not_kept;
  counters["frames_missed"] = picture.dropped;
  return object.dump();
}

}  // namespace trestle::inspect
