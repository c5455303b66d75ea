// A device allocates nothing, not even in its constructor: every use of operator new in this program is
// counted.
#include <gtest/gtest.h>

#include "test/allocations.hpp"
#include "test/sd/device/two_devices.hpp"

namespace trestle::test::no_allocation_test {
namespace {
using namespace std::chrono_literals;

struct Side {
  IpAddress address;
  device::Device& device;
};

/// Carries what one side sends to the other, which does with its happenings what `handle` says.
template <typename Handle>
void carry(const Side& from, const Side& to, TimePoint now, Handle handle) {
  std::array<std::byte, device::Device::datagram_bytes> room{};
  std::array<std::byte, device::Device::datagram_bytes> answer_room{};
  from.device.on_time(now);
  while (const auto out = from.device.poll_transmit(room, now)) {
    to.device.on_datagram(out->bytes, {from.address, out->from_port}, out->destination, now);
    for (bool polled = false; !polled;) {
      while (const auto answer = to.device.poll_transmit(answer_room, now)) {
        from.device.on_datagram(answer->bytes, {to.address, answer->from_port}, answer->destination, now);
      }
      const auto what = to.device.poll_happening();
      polled = !what;
      if (what) {
        handle(*what);
      }
    }
  }
}

TEST(NoAllocation, HappensInADevice) {
  static TwoDevices tables;
  static std::array<std::byte, 5000> large{};
  std::size_t events = 0;
  std::size_t large_events = 0;
  std::size_t answers = 0;
  const std::size_t before = allocations();
  {
    static device::StaticDevice<TwoDevices::server_limits> server{tables.server_settings(1)};
    static device::StaticDevice<TwoDevices::client_limits> client{TwoDevices::client_settings(2)};
    const Side server_side{TwoDevices::server_sd.address, server};
    const Side client_side{TwoDevices::client_sd.address, client};
    const auto at_server = [&](const device::Happening& what) {
      if (const auto* request = std::get_if<device::Request>(&what)) {
        EXPECT_TRUE(server.respond(*request, request->payload));
      }
    };
    const auto at_client = [&](const device::Happening& what) {
      if (const auto* event = std::get_if<device::EventReceived>(&what)) {
        ++events;
        large_events += event->payload.size() == large.size() ? 1U : 0U;
      } else if (const auto* end = std::get_if<device::CallEnded>(&what)) {
        answers += end->answered ? 1U : 0U;
      }
    };
    TimePoint now{1000s};
    EXPECT_TRUE(server.offer(0, now));
    EXPECT_TRUE(client.require(0, now));
    for (int i = 0; i < 1000; ++i, now += 1ms) {
      carry(server_side, client_side, now, at_client);
      carry(client_side, server_side, now, at_server);
      while (const auto what = client.poll_happening()) {  // of what came as an answer
        at_client(*what);
      }
      while (const auto what = server.poll_happening()) {
        at_server(*what);
      }
      if (i % 200 == 199) {
        EXPECT_TRUE(server.notify(0, TwoDevices::event, large));
        EXPECT_TRUE(client.call(0, TwoDevices::echo, ByteView{large}.first(10), 1s, now));
        EXPECT_TRUE(server.set_field(0, 0, ByteView{large}.first(static_cast<std::size_t>(i) / 200)));
      }
    }
  }
  EXPECT_EQ(allocations(), before);
  EXPECT_GE(large_events, 4U);
  EXPECT_GE(events, 8U);
  EXPECT_GE(answers, 4U);
}

}  // namespace
}  // namespace trestle::test::no_allocation_test
