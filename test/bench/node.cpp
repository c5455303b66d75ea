// A Node alone, without DDS: what it takes when nothing happens, and how soon after its start the first event
// of a service comes that has long been there; and programs as newcomers write them.
#include <sys/resource.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <string>

#include "sd/net/handles.hpp"
#include "someip/net/address_text.hpp"
#include "test/bench/newcomer.hpp"

namespace {

using namespace trestle;
using namespace std::chrono_literals;

constexpr someip::ServiceId service{0x7e60};
constexpr someip::ServiceId offered{0x7e5f};
constexpr someip::EventgroupId eventgroup{1};
constexpr someip::MethodId notifier{0x8001};

/// Offers a field, whose value every new subscriber gets.
void serve(const sd::NodeConfig& config) {
  boost::asio::io_context io{1};
  sd::Node node{io, config};
  sd::ServiceSpec spec{.service = service, .instance = someip::InstanceId{1}};
  spec.fields = {{.notifier = notifier, .value = std::vector<std::byte>(64)}};
  spec.eventgroups = {{.id = eventgroup, .events = {notifier}}};
  const sd::Offer offer{node, std::move(spec)};
  io.run();
}

void first_event(sd::NodeConfig config) {
  const auto start = std::chrono::steady_clock::now();
  config.timing.initial_delay_min = 0ms;
  config.timing.initial_delay_max = 0ms;
  boost::asio::io_context io{1};
  sd::Node node{io, config};
  const sd::Subscription subscription{node,
                                      {.service = service, .eventgroup = eventgroup, .events = {notifier}},
                                      [&](const someip::Message& /*event*/, const Endpoint& /*from*/) {
                                        const std::chrono::nanoseconds took =
                                            std::chrono::steady_clock::now() - start;
                                        std::printf(R"({"first_event_ns":%lld})"
                                                    "\n",
                                                    static_cast<long long>(took.count()));
                                        io.stop();
                                      }};
  io.run();
  node.shutdown();
}

long resident_kb() {
  std::ifstream status{"/proc/self/status"};
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmRSS:")) {
      return std::atol(line.c_str() + 6);
    }
  }
  return 0;
}

/// With a service on offer by UDP and TCP and a subscription of another one, all of it in its main phase.
/// Wake-ups are the times that the process slept; each datagram of discovery that it sends, or gets from
/// others, is one.
void idle(const sd::NodeConfig& config, double seconds) {
  boost::asio::io_context io{1};
  sd::Node node{io, config};
  const sd::Offer offer{node, {.service = offered, .instance = someip::InstanceId{1}, .tcp_port = 0}};
  std::uint64_t events = 0;
  const sd::Subscription subscription{
      node,
      {.service = service, .eventgroup = eventgroup, .events = {notifier}},
      [&](const someip::Message& /*event*/, const Endpoint& /*from*/) { ++events; }};
  boost::asio::steady_timer timer{io};
  const auto run_for = [&](Duration time) {
    timer.expires_after(time);
    timer.async_wait([&](const boost::system::error_code& /*none*/) { io.stop(); });
    io.run();
    io.restart();
  };
  run_for(1s);  // the repetition phase is over by then

  const sd::SdCounters& counters = node.discovery_counters();
  const auto datagrams = [&] {
    return counters.datagrams_sent + counters.datagrams_received - counters.dropped_own;
  };
  rusage before{};
  getrusage(RUSAGE_SELF, &before);
  const std::uint64_t datagrams_before = datagrams();
  run_for(std::chrono::duration_cast<Duration>(std::chrono::duration<double>{seconds}));
  rusage after{};
  getrusage(RUSAGE_SELF, &after);
  std::printf(R"({"resident_kb":%ld,"seconds":%.3f,"wakeups":%ld,"discovery_datagrams":%llu,"events":%llu})"
              "\n",
              resident_kb(), seconds, after.ru_nvcsw - before.ru_nvcsw,
              static_cast<unsigned long long>(datagrams() - datagrams_before),
              static_cast<unsigned long long>(events));
}

}  // namespace

int main(int argc, char** argv) try {
  const std::string role = argc > 2 ? argv[1] : "";
  const auto address = argc > 2 ? trestle::someip::parse_address(argv[2]) : std::nullopt;
  const auto number = [&](int place, double otherwise) {
    return argc > place ? std::atof(argv[place]) : otherwise;
  };
  const sd::NodeConfig config{.address = address.value_or(IpAddress{})};
  if (address && role == "serve") {
    serve(config);
  } else if (address && role == "first-event") {
    first_event(config);
  } else if (address && role == "idle") {
    idle(config, number(3, 5));
  } else if (address && role == "echo") {
    trestle::newcomer::serve_echo(config);
  } else if (address && role == "call") {
    trestle::newcomer::call_echo(config, static_cast<std::size_t>(number(3, 64)), number(4, 1));
  } else if (address && role == "notify") {
    trestle::newcomer::serve_events(config);
  } else if (address && role == "count") {
    trestle::newcomer::count_events(config, number(3, 1));
  } else {
    std::fputs(
        "Usage: trestle_node serve|first-event|echo|notify ADDRESS\n"
        "       trestle_node idle|count ADDRESS [SECONDS]\n"
        "       trestle_node call ADDRESS [BYTES [SECONDS]]\n",
        stderr);
    return 2;
  }
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "trestle_node: %s\n", error.what());
  return 1;
}
