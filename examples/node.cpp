// Offers a service with one event, subscribes to it as another node would, and prints what arrives.
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdio>
#include <string_view>

#include "sd/net/node.hpp"

using namespace trestle::someip;
using namespace std::chrono_literals;

int main() {
  boost::asio::io_context io;

  trestle::sd::Node server{io, {.address = trestle::IpAddress::v4(127, 0, 0, 1)}};
  const auto offer = server.offer({.service = ServiceId{0x1234},
                                   .instance = InstanceId{1},
                                   .eventgroups = {{.id = EventgroupId{1}, .events = {MethodId{0x8001}}}}});

  trestle::sd::Node client{io, {.address = trestle::IpAddress::v4(127, 0, 0, 2)}};
  client.subscribe({.service = ServiceId{0x1234},
                    .instance = InstanceId{1},
                    .eventgroup = EventgroupId{1},
                    .events = {MethodId{0x8001}}},
                   [&](const Message& event, const trestle::Endpoint&) {
                     std::printf("%zu bytes\n", event.payload.size());
                     io.stop();
                   });

  boost::asio::steady_timer timer{io};
  const std::function<void()> tick = [&] {
    const trestle::ByteView payload = std::as_bytes(std::span{std::string_view{"hello"}});
    server.notify(offer, MethodId{0x8001}, {&payload, 1});  // to all subscribers, of any size
    timer.expires_after(100ms);
    timer.async_wait([&](auto) { tick(); });
  };
  tick();
  io.run();
}
