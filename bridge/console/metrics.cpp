#include "bridge/console/metrics.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include "bridge/picture/causes.hpp"
#include "bridge/picture/labels.hpp"
#include "bridge/picture/picture_json.hpp"

namespace trestle::console {
namespace {

using carry::CounterPicture;
using carry::Labels;
using carry::Picture;
using carry::RoutePicture;

// Of latencies, in nanoseconds.
constexpr std::array<std::int64_t, 17> bounds_ns{
    1'000,      2'500,      5'000,       10'000,        25'000,        50'000,
    100'000,    250'000,    500'000,     1'000'000,     2'500'000,     5'000'000,
    10'000'000, 50'000'000, 100'000'000, 1'000'000'000, 10'000'000'000};

std::string in_quotes(std::string_view text) {
  std::string result = "\"";
  for (const char letter : text) {
    result += letter == '"' ? "\\\"" : letter == '\\' ? "\\\\" : letter == '\n' ? "\\n" : std::string{letter};
  }
  return result + "\"";
}

/// Writes one family of metrics after another.
class Writer {
 public:
  explicit Writer(MetricsForm form) : form_{form} {}

  /// @param unit  what the name ends with, or empty.
  void family(const char* name, const char* type, const char* help, const char* unit = "") {
    name_ = name;
    is_counter_ = std::string_view{type} == "counter";
    // The text format knows a counter by its whole name.
    const std::string title = is_counter_ && form_ == MetricsForm::prometheus ? name_ + "_total" : name_;
    out_ += fmt::format("# HELP {} {}\n# TYPE {} {}\n", title, help, title, type);
    if (*unit != '\0' && form_ == MetricsForm::openmetrics) {
      out_ += fmt::format("# UNIT {} {}\n", title, unit);
    }
  }
  template <typename Number>
  void value(const Labels& labels, Number number) {
    line(is_counter_ ? "_total" : "", labels, number);
  }
  template <typename Number>
  void line(const char* suffix, const Labels& labels, Number number) {
    out_ += name_;
    out_ += suffix;
    for (const auto& [label, text] : labels) {
      out_ += fmt::format("{}{}={}", &label == &labels.front().name ? "{" : ",", label, in_quotes(text));
    }
    out_ += fmt::format("{} {}\n", labels.empty() ? "" : "}", number);
  }
  void histogram(const Labels& labels, const carry::LatencyPicture& latency) {
    std::uint64_t below = 0;
    auto bucket = latency.buckets.begin();
    Labels with_bound = labels;
    with_bound.push_back({"le", ""});
    for (const std::int64_t bound : bounds_ns) {
      // A bucket that a bound lies in counts as above it: it is an eighth wide at most.
      for (; bucket != latency.buckets.end() && bucket->up_to_ns <= bound; ++bucket) {
        below += bucket->count;
      }
      with_bound.back().value = fmt::format("{}", static_cast<double>(bound) / 1e9);
      line("_bucket", with_bound, below);
    }
    with_bound.back().value = "+Inf";
    line("_bucket", with_bound, latency.count);
    line("_sum", labels, latency.sum_ns / 1e9);
    line("_count", labels, latency.count);
  }
  [[nodiscard]] std::string take() {
    out_ += form_ == MetricsForm::openmetrics ? "# EOF\n" : "";
    return std::move(out_);
  }

 private:
  MetricsForm form_;
  std::string name_;
  bool is_counter_ = false;
  std::string out_;
};

Labels with(Labels labels, const char* name, std::string text) {
  labels.push_back({name, std::move(text)});
  return labels;
}

template <typename Value>
void of_routes(Writer& out, const Picture& picture, Value value) {
  for (const RoutePicture& route : picture.routes) {
    out.value(metric_labels_of(route), value(route));
  }
}

void write_routes(Writer& out, const Picture& picture) {
  out.family("trestle_route_received_messages", "counter", "Messages and requests that came to the route.");
  of_routes(out, picture, [](const RoutePicture& one) { return one.received; });
  out.family("trestle_route_carried_messages", "counter",
             "Messages that were carried, and requests answered.");
  of_routes(out, picture, [](const RoutePicture& one) { return one.carried; });
  out.family("trestle_route_carried_bytes", "counter", "Bytes of the messages that were carried.", "bytes");
  of_routes(out, picture, [](const RoutePicture& one) { return one.bytes; });
  out.family("trestle_route_dropped_messages", "counter",
             "What was not carried, by reason (docs/status.md).");
  for (const RoutePicture& route : picture.routes) {
    for (const CounterPicture& one : route.counters) {
      if (one.kind == "loss") {
        out.value(with(metric_labels_of(route), "reason", one.name), one.count);
      }
    }
  }
  out.family("trestle_route_doubtful_messages", "counter",
             "What was carried and may be lost beyond, by reason.");
  for (const RoutePicture& route : picture.routes) {
    for (const CounterPicture& one : route.counters) {
      if (one.kind == "doubt") {
        out.value(with(metric_labels_of(route), "reason", one.name), one.count);
      }
    }
  }
  out.family("trestle_route_state", "gauge", "1 for the state that the route is in, 0 for all others.");
  for (const RoutePicture& route : picture.routes) {
    using enum carry::RouteState;
    for (const carry::RouteState state : {flowing, idle, waiting, failing}) {
      out.value(with(metric_labels_of(route), "state", to_string(state)), route.state == state ? 1 : 0);
    }
  }
  out.family("trestle_route_cause", "gauge",
             "1 for the cause why nothing flows on the route, if there is one.");
  for (const RoutePicture& route : picture.routes) {
    if (!route.cause.words.empty()) {
      out.value(with(metric_labels_of(route), "cause", route.cause.name), 1);
    }
  }
  out.family("trestle_route_last_message_timestamp_seconds", "gauge",
             "When the last message came, since 1970; 0: none has.", "seconds");
  of_routes(out, picture, [](const RoutePicture& one) { return static_cast<double>(one.last_ns) / 1e9; });
  out.family("trestle_route_counterparts", "gauge",
             "Readers or writers in DDS, and subscribers in SOME/IP, of the route.");
  for (const RoutePicture& route : picture.routes) {
    out.value(with(metric_labels_of(route), "side", "dds"), route.dds.matched);
    out.value(with(metric_labels_of(route), "side", "someip"),
              route.someip.subscribed ? 1U : route.someip.subscribers);
  }
  out.family("trestle_route_conversion_seconds", "histogram", "How long a message took to be converted.",
             "seconds");
  for (const RoutePicture& route : picture.routes) {
    if (route.conversion.count > 0) {
      out.histogram(metric_labels_of(route), route.conversion);
    }
  }
  out.family("trestle_route_path_seconds", "histogram",
             "How long a message took: to SOME/IP since its source wrote it, to DDS since it was received.",
             "seconds");
  for (const RoutePicture& route : picture.routes) {
    if (route.path.count > 0) {
      out.histogram(metric_labels_of(route), route.path);
    }
  }
}

void write_networks(Writer& out, const Picture& picture) {
  out.family("trestle_someip_hosts", "gauge", "Other hosts that take part in SOME/IP service discovery.");
  out.value({}, picture.someip.heard);
  out.family("trestle_someip_host_seen_seconds", "gauge", "How long ago the last message of a host came.",
             "seconds");
  for (const carry::HostPicture& one : picture.someip.hosts) {
    out.value({{"peer", one.address}, {"port", std::to_string(one.port)}}, one.seen_s);
  }
  out.family("trestle_someip_reboots", "counter", "Restarts of other hosts that were noticed.");
  out.value({}, picture.someip.reboots);
  out.family("trestle_dds_participants", "gauge", "Other participants in the DDS domain.");
  out.value({{"domain", std::to_string(picture.dds.domain)}}, picture.dds.heard);
  out.family("trestle_limit_used", "gauge", "How much of a limit is taken.");
  for (const carry::LimitPicture& one : picture.limits) {
    out.value({{"limit", one.name}}, one.used);
  }
  out.family("trestle_limit_most", "gauge", "What the limit is.");
  for (const carry::LimitPicture& one : picture.limits) {
    out.value({{"limit", one.name}}, one.limit);
  }
  out.family("trestle_network_events", "counter",
             "What was counted for all routes together: group, name, kind.");
  for (const carry::CounterGroupPicture& group : picture.counters) {
    for (const CounterPicture& one : group.counters) {
      if (one.kind != "now") {
        out.value({{"group", group.name}, {"name", one.name}, {"kind", one.kind}}, one.count);
      }
    }
  }
}

void write_viewers(Writer& out, const ViewerCounters& viewers) {
  out.family("trestle_viewers", "gauge", "Clients of Foxglove's WebSocket protocol, now.");
  out.value({}, viewers.viewers);
  out.family("trestle_viewer_messages", "counter", "Messages that viewers were sent.");
  out.value({}, viewers.sent);
  out.family("trestle_viewer_messages_lost", "counter",
             "Messages that viewers had subscribed to and were not sent, by reason.");
  out.value({{"reason", "slow"}}, viewers.slow);
  out.value({{"reason", "too_large"}}, viewers.too_large);
  out.value({{"reason", "unreadable"}}, viewers.unreadable);
  out.family("trestle_viewers_malformed", "counter", "Viewers that ended because they broke the protocol.");
  out.value({}, viewers.malformed);
}

}  // namespace

const char* content_type(MetricsForm form) noexcept {
  return form == MetricsForm::openmetrics ? "application/openmetrics-text; version=1.0.0; charset=utf-8"
                                          : "text/plain; version=0.0.4; charset=utf-8";
}

std::string metrics(const Picture& picture, MetricsForm form, const ViewerCounters& viewers) {
  Writer out{form};
  // An info has its suffix in the name, and is a gauge where infos are not known.
  out.family(form == MetricsForm::openmetrics ? "trestle_build" : "trestle_build_info",
             form == MetricsForm::openmetrics ? "info" : "gauge", "The program that runs.");
  out.line(form == MetricsForm::openmetrics ? "_info" : "",
           {{"version", picture.program}, {"configuration", picture.configuration}}, 1);
  out.family("trestle_running_seconds", "gauge", "Since the bridge began, or read its configuration again.",
             "seconds");
  out.value({}, picture.running_s);
  write_routes(out, picture);
  write_networks(out, picture);
  write_viewers(out, viewers);
  return out.take();
}

}  // namespace trestle::console
