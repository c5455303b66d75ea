// A speed that is protected end to end, with an event and a method. Server and client, here in one program.
#include <boost/asio/io_context.hpp>
#include <cstdio>

#include <trestle/sd/net/handles.hpp>
#include <trestle/sd/net/proxy.hpp>
#include <trestle/someip/net/address_text.hpp>

using namespace trestle::someip;
namespace sd = trestle::sd;

constexpr MethodId limit{0x0001};
constexpr MethodId speed{0x8001};
const e2e::Profile4 speed_profile{.data_id = 0x0100002d};
const e2e::Profile4m limit_profile{{.data_id = 0x0100002e}};

// e2e [SERVER_ADDRESS CLIENT_ADDRESS [GROUP]]
int main(int argc, char** argv) try {
  boost::asio::io_context io;
  const auto group = parse_address(argc > 3 ? argv[3] : "224.244.224.245").value();
  sd::Node server{io,
                  {.address = parse_address(argc > 2 ? argv[1] : "127.0.0.1").value(), .multicast = group}};
  sd::Node client{io,
                  {.address = parse_address(argc > 2 ? argv[2] : "127.0.0.2").value(), .multicast = group}};

  const auto on_limit = [](double wanted) { return wanted < 130.0 ? wanted : 130.0; };
  const sd::Offer offer{server,
                        {.service = ServiceId{0x4567},
                         .instance = InstanceId{1},
                         .methods = {{limit, sd::answering(on_limit)}},
                         .eventgroups = {{.id = EventgroupId{1}, .events = {speed}}},
                         .e2e = {{.id = speed, .protect = speed_profile},
                                 {.id = limit, .protect = limit_profile, .check = limit_profile}}}};

  sd::Proxy proxy{
      client,
      {.service = ServiceId{0x4567},
       .e2e = {{.id = limit, .protect = limit_profile, .check = limit_profile, .source_id = 0x77}}}};
  int events = 0;
  const sd::Subscription subscription{
      client,
      {.service = ServiceId{0x4567},
       .eventgroup = EventgroupId{1},
       .events = {speed},
       .e2e = {{.id = speed, .check = speed_profile}}},
      [&](const Message& event, const trestle::Endpoint&) {  // of messages that passed the check
        std::printf("speed %.1f, %s, channel %s\n", unpack<double>(event.payload).value_or(0),
                    to_string(event.check->status), to_string(event.check->state));
        if (++events == 3) {
          io.stop();
        }
      }};

  while (!subscription.active()) {
    io.run_one();
  }
  proxy.call({.method = limit}, pack(150.0), [&](auto error, const sd::Response& response) {
    std::printf("limit: %s, %.1f\n", error.message().c_str(), unpack<double>(response.payload).value_or(0));
    for (int i = 0; i < 3; ++i) {
      offer.notify(speed, pack(99.5 + i));
    }
  });
  io.run();
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
