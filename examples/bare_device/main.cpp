// The smallest device for a microcontroller: one service with a method and an event, in one loop.
#include "board.hpp"

namespace {

using namespace trestle;
using namespace trestle::device;

// Services are constant tables. Their types are written out: GCC 12 puts constants of a deduced type into
// RAM.
constexpr std::array<sd::Eventgroup, 1> groups{sd::Eventgroup{.id = EventgroupId{1}}};
constexpr std::array<EventgroupId, 1> in_group{EventgroupId{1}};
constexpr std::array<Method, 1> methods{Method{.id = MethodId{0x0001}}};
constexpr std::array<Event, 1> events{Event{.id = MethodId{0x8001}, .eventgroups = in_group}};
constexpr std::array<Service, 1> services{Service{.service = ServiceId{0x1234},
                                                  .instance = InstanceId{1},
                                                  .port = 30501,
                                                  .methods = methods,
                                                  .events = events,
                                                  .eventgroups = groups}};

// Capacities are template arguments.
using Brake =
    StaticDevice<Limits{.services = 1, .eventgroups = 1, .events = 1, .subscribers = 4, .tp_buffers = 0}>;

Settings settings() {
  Settings settings;
  settings.discovery.unicast = {IpAddress::v4(192, 0, 2, 10), 30490};
  settings.discovery.seed = board::seed();
  settings.services = services;
  return settings;
}

}  // namespace

int main() {
  static Brake brake{settings()};
  static std::array<std::byte, Device::datagram_bytes> room;
  if (!brake.offer(0, board::now())) {
    return 1;
  }
  std::byte pressed{};
  for (;;) {
    if (const auto in = board::receive()) {
      brake.on_datagram(in->bytes, in->from, in->to, board::now());
    }
    brake.on_time(board::now());
    for (;;) {  // first send, then look at one happening, and so on
      while (const auto out = brake.poll_transmit(room, board::now())) {
        board::send(*out);
      }
      const auto what = brake.poll_happening();
      if (!what) {
        break;
      }
      if (const auto* request = std::get_if<Request>(&*what)) {
        static_cast<void>(brake.respond(*request, request->payload));  // full: the client's call times out
      }
    }
    if (const std::byte now{board::pedal()}; now != pressed) {
      pressed = now;
      static_cast<void>(brake.notify(0, MethodId{0x8001}, std::span{&pressed, 1}));
    }
  }
}
