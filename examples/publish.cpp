// Offers a service with an event, and sends it ten times a second. Run examples/subscribe.cpp beside it.
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdio>

#include <trestle/sd/net/handles.hpp>
#include <trestle/someip/net/address_text.hpp>

using namespace trestle::someip;
using namespace std::chrono_literals;
namespace sd = trestle::sd;

struct Reading {
  std::uint32_t number = 0;
  std::string sensor;
  std::vector<float> distances;
};

// publish [ADDRESS [GROUP]]
int main(int argc, char** argv) try {
  boost::asio::io_context io;
  sd::Node node{io,
                {.address = parse_address(argc > 1 ? argv[1] : "127.0.0.1").value(),
                 .multicast = parse_address(argc > 2 ? argv[2] : "224.244.224.245").value()}};

  constexpr MethodId reading_event{0x8001};
  const sd::Offer offer{node,
                        {.service = ServiceId{0x2345},
                         .instance = InstanceId{1},
                         .eventgroups = {{.id = EventgroupId{1}, .events = {reading_event}}}}};

  Reading reading{.sensor = "front", .distances = {0.5F, 1.25F}};
  boost::asio::steady_timer timer{io};
  const std::function<void()> publish = [&] {
    ++reading.number;
    offer.notify(reading_event, pack(reading));  // to all subscribers, of any size
    timer.expires_after(100ms);
    timer.async_wait([&](auto) { publish(); });
  };
  publish();

  boost::asio::signal_set stop{io, SIGINT, SIGTERM};
  stop.async_wait([&](auto, int) { io.stop(); });
  io.run();
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
