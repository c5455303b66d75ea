// Devices over a simulated network that delays, reorders, loses and repeats datagrams.
#include <gtest/gtest.h>

#include <functional>
#include <queue>
#include <vector>

#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/device/two_devices.hpp"

namespace trestle::test::network_test {
namespace {
using namespace std::chrono_literals;

struct Flight {
  TimePoint at;
  std::size_t order;
  std::size_t to;  // which device
  Endpoint from;
  Endpoint destination;
  std::vector<std::byte> bytes;
  bool operator<(const Flight& other) const { return std::tie(other.at, other.order) < std::tie(at, order); }
};

class Net {
 public:
  explicit Net(std::uint64_t seed) : random_{seed} {}

  struct Host {
    IpAddress address;
    device::Device* device;
    std::function<void(const device::Happening&)> happened;
  };
  void add(const IpAddress& address, device::Device& device,
           std::function<void(const device::Happening&)> happened) {
    hosts_.push_back({address, &device, std::move(happened)});
  }

  void run_for(Duration time) {
    const TimePoint end = now + time;
    for (std::size_t steps = 0; steps < 1'000'000 && now < end; ++steps) {
      for (std::size_t i = 0; i < hosts_.size(); ++i) {
        hosts_[i].device->on_time(now);
        poll(i);
      }
      TimePoint next = end;
      for (const Host& host : hosts_) {
        if (const auto deadline = host.device->deadline()) {
          next = std::min(next, std::max(*deadline, now));
        }
      }
      if (!in_flight_.empty()) {
        next = std::min(next, in_flight_.top().at);
      }
      now = next;
      while (!in_flight_.empty() && in_flight_.top().at <= now) {
        const Flight flight = in_flight_.top();
        in_flight_.pop();
        hosts_[flight.to].device->on_datagram(flight.bytes, flight.from, flight.destination, now);
        poll(flight.to);
      }
    }
    EXPECT_EQ(now, end);
  }

  TimePoint now{1000s};
  unsigned loss_percent = 0;
  unsigned duplication_percent = 0;
  Duration delay_max = 1ms;

 private:
  bool percent(unsigned chance) { return random_.next() % 100 < chance; }

  void poll(std::size_t i) {
    std::array<std::byte, device::Device::datagram_bytes> room{};
    for (;;) {
      while (const auto out = hosts_[i].device->poll_transmit(room, now)) {
        transmit(i, *out);
      }
      const auto what = hosts_[i].device->poll_happening();
      if (!what) {
        return;
      }
      hosts_[i].happened(*what);
    }
  }

  void transmit(std::size_t from, const device::Transmit& out) {
    for (std::size_t to = 0; to < hosts_.size(); ++to) {
      const bool reached =
          out.destination.address.is_multicast() ? to != from : out.destination.address == hosts_[to].address;
      if (!reached || percent(loss_percent)) {
        continue;
      }
      for (int copies = percent(duplication_percent) ? 2 : 1; copies > 0; --copies) {
        in_flight_.push({now + random_.between(100us, delay_max),
                         order_++,
                         to,
                         {hosts_[from].address, out.from_port},
                         out.destination,
                         {out.bytes.begin(), out.bytes.end()}});
      }
    }
  }

  sd::Random random_;
  std::size_t order_ = 0;
  std::vector<Host> hosts_;
  std::priority_queue<Flight> in_flight_;
};

std::vector<std::byte> numbered(std::size_t bytes, unsigned number) {
  std::vector<std::byte> payload(bytes);
  for (std::size_t i = 0; i < bytes; ++i) {
    payload[i] = static_cast<std::byte>((i * 7 + number) % 256);
  }
  return payload;
}

/// What a client of TwoDevices saw of its server.
struct Seen {
  std::size_t values = 0;
  std::size_t small = 0;
  std::size_t large = 0;
  std::size_t answered = 0;
  std::size_t ended = 0;
};

/// One minute with an event and a call every 20 ms, a large event every 100 ms.
Seen run(std::uint64_t seed, const std::function<void(Net&)>& conditions) {
  TwoDevices tables;
  const auto server =
      std::make_unique<device::StaticDevice<TwoDevices::server_limits>>(tables.server_settings(seed));
  const auto client =
      std::make_unique<device::StaticDevice<TwoDevices::client_limits>>(TwoDevices::client_settings(~seed));
  Net net{seed};
  Seen seen;
  std::vector<std::vector<std::byte>> kept;  // large payloads under way
  net.add(TwoDevices::server_sd.address, *server, [&](const device::Happening& what) {
    if (const auto* request = std::get_if<device::Request>(&what)) {
      EXPECT_TRUE(server->respond(*request, request->payload));
    } else if (const auto* done = std::get_if<device::SendFinished>(&what)) {
      EXPECT_EQ(std::erase_if(kept, [&](const auto& one) { return one.data() == done->payload; }), 1U);
    }
  });
  net.add(TwoDevices::client_sd.address, *client, [&](const device::Happening& what) {
    if (const auto* event = std::get_if<device::EventReceived>(&what)) {
      if (event->header.method == TwoDevices::notifier) {
        ++seen.values;
        return;
      }
      const auto number = std::to_integer<unsigned>(event->payload[0]);
      EXPECT_EQ(to_hex(event->payload), to_hex(numbered(event->payload.size(), number)));
      ++(event->payload.size() > 1400 ? seen.large : seen.small);
    } else if (const auto* end = std::get_if<device::CallEnded>(&what)) {
      ++seen.ended;
      seen.answered += end->answered ? 1U : 0U;
    }
  });
  EXPECT_TRUE(server->offer(0, net.now));
  EXPECT_TRUE(client->require(0, net.now));
  net.run_for(1s);
  conditions(net);
  std::size_t calls = 0;
  for (unsigned i = 0; i < 3000; ++i) {
    EXPECT_TRUE(server->notify(0, TwoDevices::event, numbered(20, i)));
    if (i % 5 == 0) {
      kept.push_back(numbered(7000, i));
      EXPECT_TRUE(server->notify(0, TwoDevices::event, kept.back()));
      if (server->subscribers(0, TwoDevices::event) == 0) {
        kept.pop_back();
      }
    }
    const auto call = client->call(0, TwoDevices::echo, numbered(30, i), 60ms, net.now);
    calls += call ? 1U : 0U;
    net.run_for(20ms);
  }
  net.loss_percent = 0;
  net.run_for(5s);
  EXPECT_EQ(seen.ended, calls);
  EXPECT_TRUE(client->available(0));
  EXPECT_EQ(server->subscribers(0, TwoDevices::event), 1U);
  EXPECT_TRUE(kept.empty());
  return seen;
}

TEST(DeviceNetwork, BringsEverythingWhereNothingIsLost) {
  covers({"feat_req_someiptp_820", "feat_req_someiptp_790"});
  const Seen seen = run(1, [](Net& net) { net.delay_max = 1500us; });  // more than from burst to burst
  EXPECT_EQ(seen.values, 1U);
  EXPECT_EQ(seen.small, 3000U);
  EXPECT_EQ(seen.large, 600U);
  EXPECT_EQ(seen.answered, 3000U);
}

TEST(DeviceNetwork, SurvivesLossAndDuplication) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    const Seen seen = run(seed, [](Net& net) {
      net.loss_percent = 10;
      net.duplication_percent = 10;
    });
    // Of large ones, those whose six segments all arrive: about half. Lost renewals cost some seconds.
    EXPECT_GT(seen.small, 2400U);
    EXPECT_GT(seen.large, 200U);
    EXPECT_LT(seen.large, 500U);
    EXPECT_GT(seen.answered, 2000U);
  }
}

}  // namespace
}  // namespace trestle::test::network_test
