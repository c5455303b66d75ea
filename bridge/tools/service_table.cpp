#include "bridge/tools/service_table.hpp"

#include <fmt/format.h>

#include <set>

#include "sd/net/discovery_text.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::bridge {
namespace {

/// Lines that must not be wider than the screen.
class Screen {
 public:
  explicit Screen(TableSize size) : size_{size} {}
  void line(const char* colour, const std::string& text, const char* off) {
    out_ += colour;
    out_ += text.substr(0, size_.columns);
    out_ += off;
    out_ += "\033[K\n";  // what was there before
  }
  [[nodiscard]] std::string take() { return "\033[H" + out_ + "\033[J"; }

 private:
  TableSize size_;
  std::string out_;
};

std::string endpoints(const SeenService& service) {
  std::string text;
  if (service.udp) {
    text = "udp " + someip::to_string(*service.udp);
  }
  if (service.tcp) {
    text += (text.empty() ? "tcp " : "  tcp ") + someip::to_string(*service.tcp);
  }
  return text;
}

std::string state(const SeenService& service, TimePoint now) {
  if (service.gone) {
    return "gone";
  }
  if (!service.expires_ever()) {
    return "until reboot";
  }
  return fmt::format("{:.0f} of {} s", std::chrono::duration<double>{service.expires() - now}.count(),
                     service.ttl_s);
}

}  // namespace

std::string screen_of(const NetworkView& view, const std::string& where, TimePoint now, TableSize size,
                      const Colours& colours) {
  std::size_t offered = 0;
  std::set<Endpoint> hosts;
  for (const auto& [key, service] : view.services()) {
    if (!service.gone) {
      ++offered;
      hosts.insert(service.peer);
    }
  }
  Screen screen{size};
  const auto& counters = view.counters();
  screen.line(
      colours.bold,
      fmt::format("SOME/IP at {}: {} service{} of {} host{}; {} discovery messages{}", where, offered,
                  offered == 1 ? "" : "s", hosts.size(), hosts.size() == 1 ? "" : "s", counters.messages,
                  counters.malformed == 0 ? "" : fmt::format(", {} malformed", counters.malformed)),
      colours.off);
  screen.line("", "", "");
  constexpr const char* row = "{:<16}  {:<10}  {:<15}  {:>8}  {:<12}  {}";
  screen.line(
      colours.dim,
      fmt::format(row, "SERVICE.INSTANCE", "VERSION", "OFFERED BY", "OFFERS/S", "LIFETIME", "ENDPOINTS"),
      colours.off);
  std::size_t room = size.rows > 5 ? size.rows - 5 : 1;
  std::size_t hidden = 0;
  for (const auto& [key, service] : view.services()) {
    if (room == 0) {
      ++hidden;
      continue;
    }
    --room;
    screen.line(service.gone ? colours.red : "",
                fmt::format(row, sd::to_string(service.service, service.instance),
                            fmt::format("{}.{}", service.major, service.minor),
                            someip::to_string(service.peer.address),
                            service.rate() == 0 ? "-" : fmt::format("{:.1f}", service.rate()),
                            state(service, now), endpoints(service)),
                colours.off);
  }
  if (hidden > 0) {
    screen.line(colours.dim,
                fmt::format("... {} more: make the window larger, or use trestle watch | less", hidden),
                colours.off);
  }
  return screen.take();
}

}  // namespace trestle::bridge
