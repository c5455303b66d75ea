// Subscribes to the event of examples/publish.cpp, and prints three.
#include <boost/asio/io_context.hpp>
#include <cstdio>

#include <trestle/sd/net/handles.hpp>
#include <trestle/someip/net/address_text.hpp>

using namespace trestle::someip;
namespace sd = trestle::sd;

struct Reading {
  std::uint32_t number = 0;
  std::string sensor;
  std::vector<float> distances;
};

// subscribe [ADDRESS [GROUP]]
int main(int argc, char** argv) try {
  boost::asio::io_context io;
  sd::Node node{io,
                {.address = parse_address(argc > 1 ? argv[1] : "127.0.0.2").value(),
                 .multicast = parse_address(argc > 2 ? argv[2] : "224.244.224.245").value()}};

  int received = 0;
  const sd::Subscription subscription{
      node,
      {.service = ServiceId{0x2345}, .eventgroup = EventgroupId{1}, .events = {MethodId{0x8001}}},
      [&](const Message& event, const trestle::Endpoint& from) {
        const auto reading = unpack<Reading>(event.payload);
        if (!reading) {
          std::printf("not a reading: %s\n", to_string(reading.error()));
          return;
        }
        std::printf("reading %u of %s from %s: %zu distances\n", reading->number, reading->sensor.c_str(),
                    to_string(from.address).c_str(), reading->distances.size());
        if (++received == 3) {
          io.stop();
        }
      }};
  io.run();
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
