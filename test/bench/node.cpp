// A Node alone, without DDS: what it takes when nothing happens, how soon after its start the first event of
// a service comes that has long been there, and what calls take, by Node::call() and by a Proxy; and programs
// as newcomers write them.
#include <sys/resource.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <string>

#include "sd/net/handles.hpp"
#include "sd/net/proxy.hpp"
#include "someip/net/address_text.hpp"
#include "test/bench/newcomer.hpp"

namespace {

using namespace trestle;
using namespace std::chrono_literals;

constexpr someip::ServiceId service{0x7e60};
constexpr someip::ServiceId offered{0x7e5f};
constexpr someip::EventgroupId eventgroup{1};
constexpr someip::MethodId notifier{0x8001};
constexpr someip::MethodId echo{1};

/// Offers a field, whose value every new subscriber gets, and a method.
void serve(const sd::NodeConfig& config) {
  boost::asio::io_context io{1};
  sd::Node node{io, config};
  sd::ServiceSpec spec{.service = service, .instance = someip::InstanceId{1}};
  spec.methods = {{echo, [](const someip::Message& request, sd::Responder responder) {
                     responder.respond(request.payload);
                   }}};
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

/// Calls of 64 bytes, 32 at a time, by a Proxy and by Node::call() in turn, a short time each: what happens
/// on the machine meanwhile happens to both.
class Calls {
 public:
  Calls(const sd::NodeConfig& config, double seconds)
      : node_{io_, config},
        proxy_{node_,
               {.service = service},
               [this](const sd::RemoteService& /*server*/, bool available) {
                 if (available) {
                   boost::asio::post(io_, [this] { begin(); });  // once the other one knows it, too
                 }
               }},
        requirement_{node_.require({.service = service})},
        turns_{static_cast<unsigned>(seconds / turn_s)} {}

  /// @return false when the service was not there.
  bool run() {
    timer_.expires_after(5s);
    timer_.async_wait([this](const boost::system::error_code& error) {
      if (!error) {
        io_.stop();
      }
    });
    io_.run();
    node_.shutdown();
    return turns_ == 0;
  }
  void print() const {
    std::printf("{");
    for (std::size_t i = 0; i < ways_.size(); ++i) {
      const Way& way = ways_[i];
      const auto calls = static_cast<double>(way.calls);
      std::printf(R"("%s":{"per_second":%.0f,"cpu_ns":%.1f},)", names[i], calls / way.seconds,
                  way.cpu_ns / calls);
    }
    std::printf("\"lost\":%llu}\n", static_cast<unsigned long long>(lost_));
  }

 private:
  static constexpr double turn_s = 0.02;
  static constexpr unsigned in_flight = 32;
  static constexpr std::array names{"node", "proxy"};
  struct Way {
    double seconds = 0;
    double cpu_ns = 0;
    std::uint64_t calls = 0;
  };

  static double time(clockid_t clock) {
    timespec now{};
    clock_gettime(clock, &now);
    return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) / 1e9;
  }
  void begin() {
    over_ = false;
    answered_ = 0;
    began_ = time(CLOCK_MONOTONIC);
    cpu_began_ = time(CLOCK_PROCESS_CPUTIME_ID);
    timer_.expires_after(std::chrono::duration_cast<Duration>(std::chrono::duration<double>{turn_s}));
    timer_.async_wait([this](const boost::system::error_code& error) { over_ = !error; });
    for (under_way_ = 0; under_way_ < in_flight; ++under_way_) {
      call();
    }
  }
  void call() {
    if (way_ == 0) {
      const ByteView payload{request_};
      node_.call(requirement_, {.method = echo}, {&payload, 1}, [this](const sd::CallResult& answer) {
        on_answer(answer && answer->payload.size() == request_.size());
      });
    } else {
      proxy_.call({.method = echo}, ByteView{request_}, [this](auto error, const sd::Response& response) {
        on_answer(!error && response.payload.size() == request_.size());
      });
    }
  }
  void on_answer(bool good) {
    ++answered_;
    lost_ += good ? 0 : 1;
    if (!over_) {
      call();
    } else if (--under_way_ == 0) {
      end();
    }
  }
  void end() {
    if (!warm_) {
      warm_ = way_ + 1 == ways_.size();  // both had a turn that does not count
    } else {
      Way& way = ways_[way_];
      way.calls += answered_;
      way.seconds += time(CLOCK_MONOTONIC) - began_;
      way.cpu_ns += (time(CLOCK_PROCESS_CPUTIME_ID) - cpu_began_) * 1e9;
      turns_ -= way_ + 1 == ways_.size() ? 1 : 0;
    }
    way_ = (way_ + 1) % ways_.size();
    if (turns_ == 0) {
      io_.stop();
    } else {
      begin();
    }
  }

  boost::asio::io_context io_{1};
  boost::asio::steady_timer timer_{io_};
  sd::Node node_;
  sd::Proxy proxy_;
  sd::RequirementId requirement_;
  const std::vector<std::byte> request_ = std::vector<std::byte>(64);
  std::array<Way, names.size()> ways_{};
  std::size_t way_ = 0;
  unsigned turns_;
  bool warm_ = false;
  bool over_ = false;
  unsigned under_way_ = 0;
  std::uint64_t answered_ = 0;
  std::uint64_t lost_ = 0;
  double began_ = 0;
  double cpu_began_ = 0;
};

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
  } else if (address && role == "calls") {
    Calls calls{config, number(3, 5)};
    if (!calls.run()) {
      throw std::runtime_error{"nobody offers the service"};
    }
    calls.print();
  } else {
    std::fputs(
        "Usage: trestle_node serve|first-event|echo|notify ADDRESS\n"
        "       trestle_node idle|count|calls ADDRESS [SECONDS]\n"
        "       trestle_node call ADDRESS [BYTES [SECONDS]]\n",
        stderr);
    return 2;
  }
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "trestle_node: %s\n", error.what());
  return 1;
}
