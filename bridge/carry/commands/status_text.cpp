#include "bridge/carry/commands/status_text.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <string_view>
#include <utility>
#include <vector>

#include "bridge/documents/problems.hpp"
#include "bridge/picture/picture_json.hpp"

namespace trestle::carry {
namespace {

std::string counted(std::uint64_t number, std::string_view what) {
  return fmt::format("{} {}{}", number, what, number == 1 ? "" : "s");
}

// "12 s", "3 min", "5 h", "2 d": how long ago, or for how long.
std::string time_text(double seconds) {
  return seconds < 10          ? fmt::format("{:.1f} s", seconds)
         : seconds < 120       ? fmt::format("{:.0f} s", seconds)
         : seconds < 7200      ? fmt::format("{:.0f} min", seconds / 60)
         : seconds < 48 * 3600 ? fmt::format("{:.0f} h", seconds / 3600)
                               : fmt::format("{:.0f} d", seconds / 86400);
}

// Three digits that matter.
std::string number_text(double number) {
  return number == 0    ? "-"
         : number < 10  ? fmt::format("{:.2f}", number)
         : number < 100 ? fmt::format("{:.1f}", number)
                        : fmt::format("{:.0f}", number);
}

std::string bytes_text(std::uint64_t bytes) {
  return bytes < 1000        ? fmt::format("{} B", bytes)
         : bytes < 1'000'000 ? fmt::format("{:.1f} KB", static_cast<double>(bytes) / 1e3)
                             : fmt::format("{:.1f} MB", static_cast<double>(bytes) / 1e6);
}

std::string latency_text(const LatencyPicture& latency) {
  return latency.count == 0 ? "-"
                            : cli::duration_text(latency.p50_ns) + " / " + cli::duration_text(latency.p99_ns);
}

const char* colour_of(RouteState state, const cli::Colours& colours) {
  switch (state) {
    case RouteState::flowing:
      return colours.green;
    case RouteState::waiting:
      return colours.yellow;
    case RouteState::failing:
      return colours.red;
    case RouteState::idle:
      break;
  }
  return colours.dim;
}

// "3 no_reader, 1 too_large and 2 others"
std::string drops_text(const RoutePicture& route) {
  std::vector<const CounterPicture*> losses;
  for (const CounterPicture& one : route.counters) {
    if (one.kind == "loss" && one.count > 0) {
      losses.push_back(&one);
    }
  }
  std::ranges::sort(losses, std::ranges::greater{}, &CounterPicture::count);
  std::string text;
  for (std::size_t i = 0; i < losses.size() && i < 2; ++i) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", losses[i]->count, losses[i]->name);
  }
  return losses.size() > 2 ? fmt::format("{} and {} more", text, losses.size() - 2) : text;
}

// Behind a name: which ids no description gives. Where that is so of the service, the others do not matter.
std::string chosen_text(const RoutePicture& route) {
  if (route.service_id_is_chosen) {
    return " chosen";
  }
  const bool both = route.member_id_is_chosen && route.eventgroup_id_is_chosen;
  return both                            ? " chosen member, eventgroup"
         : route.member_id_is_chosen     ? " chosen member"
         : route.eventgroup_id_is_chosen ? " chosen eventgroup"
                                         : "";
}

// "Door.0x0001.moved"; what has no name by its ids.
std::string ids_text(const RoutePicture& route) {
  const std::string member = route.member_name.empty() ? fmt::format("0x{:04x}", route.member)
                                                       : documents::printable(route.member_name);
  return route.service_name.empty()
             ? fmt::format("0x{:04x}.0x{:04x}.{}", route.service, route.instance, member)
             : fmt::format("{}.0x{:04x}.{}{}", documents::printable(route.service_name), route.instance,
                           member, chosen_text(route));
}

constexpr std::size_t columns = 9;
using StatusRow = std::array<std::string, columns>;

StatusRow row_of(const RoutePicture& route, std::int64_t now_ns) {
  const bool pattern = route.kind == "pattern";
  return {documents::printable(route.name) + (pattern ? " (pattern)" : ""),
          route.direction == "dds_to_someip" ? "->" : "<-",
          pattern ? "" : ids_text(route),
          to_string(route.state),
          pattern ? counted(route.pattern.routes, "route") : number_text(route.per_second),
          number_text(route.bytes_per_second / 1e6),
          route.last_ns == 0 ? "never"
                             : time_text(std::max(0.0, static_cast<double>(now_ns - route.last_ns) / 1e9)),
          latency_text(route.conversion),
          latency_text(route.path)};
}

void append_route_table(std::string& out, const Picture& picture, const cli::Colours& colours) {
  if (picture.routes.empty()) {
    return;
  }
  std::vector<StatusRow> rows{
      {"ROUTE", "", "SOME/IP", "STATE", "MSG/S", "MB/S", "LAST", "CONVERT p50 / p99", "PATH p50 / p99"}};
  for (const RoutePicture& route : picture.routes) {
    rows.push_back(row_of(route, picture.at_ns));
  }
  std::array<std::size_t, columns> widths{};
  for (const StatusRow& row : rows) {
    for (std::size_t i = 0; i < columns; ++i) {
      widths.at(i) = std::max(widths.at(i), row.at(i).size());
    }
  }
  for (std::size_t line = 0; line < rows.size(); ++line) {
    out += line == 0 ? colours.dim : "";
    for (std::size_t i = 0; i < columns; ++i) {
      const bool is_number = i >= 4 && i <= 6;
      const std::string cell = i + 1 == columns ? rows[line].at(i)
                               : is_number      ? fmt::format("{:>{}}", rows[line].at(i), widths.at(i))
                                                : fmt::format("{:<{}}", rows[line].at(i), widths.at(i));
      const bool is_state = i == 3 && line > 0;
      out += "  ";
      out += is_state ? colour_of(picture.routes[line - 1].state, colours) + cell + colours.off : cell;
    }
    out += line == 0 ? std::string{colours.off} + "\n" : "\n";
    if (line == 0) {
      continue;
    }
    const RoutePicture& route = picture.routes[line - 1];
    if (!route.cause.words.empty()) {
      out += fmt::format("      {}{}{}\n", colour_of(route.state, colours),
                         documents::printable(route.cause.words), colours.off);
    }
    if (const std::string drops = drops_text(route); !drops.empty()) {
      out += fmt::format("      {}dropped: {}{}\n", colours.dim, drops, colours.off);
    }
  }
}

}  // namespace

std::string status_text(const Picture& picture, const cli::Colours& colours) {
  const SomeipPicture& someip = picture.someip;
  std::string out = fmt::format("{}{}{}: process {}, {} for {}\n", colours.bold,
                                documents::printable(picture.configuration), colours.off, picture.pid,
                                picture.stopping ? "stopping" : "running", time_text(picture.running_s));
  out += fmt::format("  {}SOME/IP{} {}{}: {}, {}", colours.dim, colours.off, someip.address,
                     someip.interface.empty() ? "" : " (" + someip.interface + ")",
                     counted(someip.heard, "other host"), counted(someip.offers.size(), "service"));
  out += someip.reboots > 0 ? ", " + counted(someip.reboots, "restart") : "";
  out += fmt::format("\n  {}DDS{}     domain {}: {}\n\n", colours.dim, colours.off, picture.dds.domain,
                     counted(picture.dds.heard, "other participant"));
  append_route_table(out, picture, colours);
  if (std::ranges::any_of(picture.routes, &RoutePicture::service_id_is_chosen)) {
    out +=
        fmt::format("  {}chosen: Trestle chose the id of this service, because no description gives it{}\n",
                    colours.dim, colours.off);
  }
  if (std::ranges::any_of(picture.routes, [](const RoutePicture& one) {
        return !one.service_id_is_chosen && !chosen_text(one).empty();
      })) {
    out += fmt::format(
        "  {}chosen member, eventgroup: Trestle chose these ids of the service, because no description gives "
        "them{}\n",
        colours.dim, colours.off);
  }
  for (const LimitPicture& one : picture.limits) {
    if (one.limit > 0 && one.used * 5 >= one.limit * 4) {
      out += fmt::format("  {}{} is nearly full{}: {} of {}\n", colours.yellow, one.name, colours.off,
                         one.used, one.limit);
    }
  }
  return out;
}

std::string slowest_text(const Picture& picture, const cli::Colours& colours, std::size_t most) {
  using Slow = std::pair<const RoutePicture*, const SlowMessagePicture*>;
  const auto whole = [](const Slow& one) {
    const SlowMessagePicture& message = *one.second;
    return std::max(message.source_ns, message.waited_ns + message.convert_ns + message.send_ns);
  };
  std::vector<Slow> all;
  for (const RoutePicture& route : picture.routes) {
    for (const SlowMessagePicture& message : route.slowest) {
      all.emplace_back(&route, &message);
    }
  }
  std::ranges::sort(all, std::ranges::greater{}, whole);
  all.resize(std::min(all.size(), most));
  std::string out;
  for (const Slow& one : all) {
    const auto& [route, message] = one;
    const std::chrono::system_clock::time_point came{std::chrono::nanoseconds{message->at_ns}};
    const auto local = std::chrono::system_clock::to_time_t(came);
    const std::int64_t inside = message->waited_ns + message->convert_ns + message->send_ns;
    out += fmt::format("  {:%H:%M:%S}.{:03}  {}{}{}  session 0x{:04x}  {}  {}{}{}: ", fmt::localtime(local),
                       message->at_ns / 1'000'000 % 1000, colours.bold, documents::printable(route->name),
                       colours.off, message->session, bytes_text(message->bytes), colours.yellow,
                       cli::duration_text(whole(one)), colours.off);
    // Until it came: the source's host, the network, DDS.
    out += message->source_ns >= inside ? "source " + cli::duration_text(message->source_ns - inside) + ", "
                                        : "";
    out += fmt::format("waited {}, convert {}, send {}\n", cli::duration_text(message->waited_ns),
                       cli::duration_text(message->convert_ns), cli::duration_text(message->send_ns));
  }
  return out.empty() ? "  nothing was carried in the last minute\n" : out;
}

}  // namespace trestle::carry
