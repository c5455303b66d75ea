#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "bridge/cli/terminal.hpp"
#include "bridge/measure/perf/result.hpp"

namespace trestle::measure::perf {
namespace {

constexpr double width = 720;
constexpr double height = 400;
constexpr double left = 80;
constexpr double right = 20;
constexpr double top = 40;
constexpr double bottom = 50;
/// The end of the percentile axis, 1 - 10^-x.
constexpr double nines = 5;

/// Both axes are logarithmic: latency upwards, and to the right the fraction of samples that is slower.
class Axes {
 public:
  explicit Axes(const statistics::Histogram& latency)
      : low_{std::floor(std::log10(std::max<double>(1, static_cast<double>(latency.min()))))},
        high_{std::max(low_ + 1,
                       std::ceil(std::log10(std::max<double>(2, static_cast<double>(latency.max())))))} {}

  [[nodiscard]] static double x(double slower) {
    const double at = std::min(nines, -std::log10(std::max(slower, 1e-9)));
    return left + at / nines * (width - left - right);
  }
  [[nodiscard]] double y(double ns) const {
    return height - bottom -
           (std::log10(std::max(1.0, ns)) - low_) / (high_ - low_) * (height - top - bottom);
  }
  [[nodiscard]] double low() const noexcept { return low_; }
  [[nodiscard]] double high() const noexcept { return high_; }

 private:
  double low_;
  double high_;
};

std::string line(double x1, double y1, double x2, double y2) {
  return fmt::format(R"(<line x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}" stroke="#ccc"/>)"
                     "\n",
                     x1, y1, x2, y2);
}

std::string label(double x, double y, const char* anchor, const std::string& text) {
  return fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="{}">{}</text>)"
                     "\n",
                     x, y, anchor, text);
}

}  // namespace

std::string to_svg(const Result& result) {
  const Axes axes{result.latency};
  std::string out = fmt::format(
      R"(<svg xmlns="http://www.w3.org/2000/svg" width="{0}" height="{1}" viewBox="0 0 {0} {1}" font-family="sans-serif" font-size="12">)"
      "\n"
      R"(<rect width="100%" height="100%" fill="white"/>)"
      "\n",
      width, height);
  out += label(width / 2, top / 2, "middle",
               fmt::format("{} by {}, {} bytes, {}: latency by percentile", result.what, result.transport,
                           result.payload_bytes, result.how));
  for (double power = axes.low(); power <= axes.high(); ++power) {
    const double ns = std::pow(10, power);
    out += line(left, axes.y(ns), width - right, axes.y(ns));
    out += label(left - 6, axes.y(ns) + 4, "end", cli::duration_text(static_cast<std::int64_t>(ns)));
  }
  constexpr std::array<std::pair<double, const char*>, 7> marks{{{1, "0"},
                                                                 {0.5, "p50"},
                                                                 {0.1, "p90"},
                                                                 {0.01, "p99"},
                                                                 {1e-3, "p99.9"},
                                                                 {1e-4, "p99.99"},
                                                                 {1e-5, "p99.999"}}};
  for (const auto& [slower, name] : marks) {
    out += line(Axes::x(slower), top, Axes::x(slower), height - bottom);
    out += label(Axes::x(slower), height - bottom + 18, "middle", name);
  }
  out += R"(<polyline fill="none" stroke="#1f77b4" stroke-width="2" points=")";
  const auto all = static_cast<double>(result.latency.count());
  std::uint64_t seen = 0;
  for (const statistics::Histogram::Bucket& bucket : result.latency.buckets()) {
    const double y = axes.y(static_cast<double>(std::min(bucket.up_to, result.latency.max())));
    out += fmt::format("{:.1f},{:.1f} ", Axes::x(1 - static_cast<double>(seen) / all), y);
    seen += bucket.count;
    // The slowest sample is not a percentile: the curve ends where only this sample is left.
    const double slower = std::max(1 - static_cast<double>(seen) / all, 0.5 / all);
    out += fmt::format("{:.1f},{:.1f} ", Axes::x(slower), y);
  }
  return out + "\"/>\n</svg>\n";
}

}  // namespace trestle::measure::perf
