// Nodes that tell each other what their sockets have room for, without a subscription.
#include <gmock/gmock.h>

#include "sd/core/receive_buffer.hpp"
#include "test/sd/client_fixture.hpp"
#include "test/sd/server_fixture.hpp"

namespace trestle::sd::acquaintances_test {
namespace {
using namespace test;
using testing::IsEmpty;
using testing::SizeIs;

constexpr Endpoint client_at = client_sd;
constexpr std::uint32_t of_server = 8U << 20U;
constexpr std::uint32_t of_client = 4U << 20U;

Settings settings_of(const Endpoint& unicast, std::uint64_t seed) {
  Settings settings = fixed_settings();
  settings.unicast = unicast;
  settings.seed = seed;
  return settings;
}

// A server, and a client that requires its service and subscribes to nothing, on one network.
class Acquaintances : public testing::Test {
 protected:
  void SetUp() override {
    if constexpr (!optimised_for_many) {
      GTEST_SKIP() << "a small device tells it only in a Subscribe";
    }
    server.tell_receive_buffer(of_server);
    client.tell_receive_buffer(of_client);
    ASSERT_TRUE(server.offer(udp_service, now));
    ASSERT_TRUE(client.require({.service = udp_service.service}, now));
  }

  void run(Duration time) {
    for (const TimePoint end = now + time; now < end; now += 1ms) {
      server.on_time(now);
      carry(server, own, client_at, client);
      if (client_is_there) {
        client.on_time(now);
        carry(client, client_at, own, server);
      }
      while (const auto event = client.poll_event()) {
        if (const auto* const available = std::get_if<ServiceAvailable>(&*event)) {
          remote = available->service.handle;
        }
      }
    }
  }

  [[nodiscard]] bool is_proven() const { return server.is_proven(client_udp.address, now); }
  [[nodiscard]] std::uint32_t told_to_server() const { return server.receive_buffer_of(client_udp, now); }
  [[nodiscard]] std::uint32_t told_to_client() const { return client.receive_buffer_of(remote); }

  TimePoint now = start;
  std::unique_ptr<Storage<>> of_server_ = std::make_unique<Storage<>>();
  std::unique_ptr<Storage<>> of_client_ = std::make_unique<Storage<>>();
  ServiceDiscovery server{settings_of(own, 0x1234'5678'9abc'def0), of_server_->view()};
  ServiceDiscovery client{settings_of(client_at, 7), of_client_->view()};
  RemoteHandle remote{};
  int to_one = 0;     ///< messages to one of them
  int lost_next = 0;  ///< of these, so many are lost
  bool client_is_there = true;

 private:
  void carry(ServiceDiscovery& from, const Endpoint& at, const Endpoint& other, ServiceDiscovery& to) {
    std::array<std::byte, 1400> room{};
    while (const auto sent = from.poll_transmit(room, now)) {
      const bool via_multicast = sent->destination == group;
      if (!via_multicast && sent->destination != other) {
        continue;
      }
      to_one += via_multicast ? 0 : 1;
      if (!via_multicast && lost_next > 0) {
        --lost_next;
      } else if (client_is_there) {
        to.on_datagram(sent->bytes, at, via_multicast, now);
      }
    }
  }
};

// Beside the Offer that the client's Find to all may bring.
TEST_F(Acquaintances, TellEachOtherInThreeMessages) {
  run(100ms);
  EXPECT_EQ(told_to_client(), of_server);
  EXPECT_EQ(told_to_server(), of_client);
  EXPECT_TRUE(is_proven());
  EXPECT_LE(to_one, 1 + 3);
  EXPECT_FALSE(server.is_proven(IpAddress::v4(10, 0, 0, 3), now));
  run(50s);
  EXPECT_LE(to_one, 1 + 3 + 1) << "once more after a second: something may have been lost";
}

TEST_F(Acquaintances, LastAsLongAsBothAreThere) {
  for (int minutes = 0; minutes < 10; ++minutes) {
    run(60s);
    EXPECT_TRUE(is_proven());
    EXPECT_EQ(told_to_server(), of_client);
    EXPECT_EQ(told_to_client(), of_server);
  }
  EXPECT_LE(to_one, 10 * 3 + 5);
  client_is_there = false;
  run(200s);
  EXPECT_FALSE(is_proven()) << "another host may have its address by now";
  EXPECT_EQ(told_to_server(), 0U);
}

TEST_F(Acquaintances, TellAgainWhatWasLost) {
  lost_next = 2;
  run(100ms);
  EXPECT_FALSE(is_proven());
  run(3s);
  EXPECT_TRUE(is_proven());
  EXPECT_EQ(told_to_server(), of_client);
  EXPECT_EQ(told_to_client(), of_server);
}

TEST_F(Acquaintances, AreForgottenWithAReboot) {
  run(100ms);
  ASSERT_TRUE(is_proven());
  FakePeer again{client_at, unicast_flag | explicit_initial_data_flag};
  server.on_datagram(again.unicast({find(0x4711)}), client_at, false, now);
  EXPECT_FALSE(is_proven());
  EXPECT_EQ(told_to_server(), 0U);
}

// A message without entries, in the name of this node.
std::vector<std::byte> told(const NodeTold& what, std::uint16_t session) {
  std::array<std::byte, 200> room{};
  SdWriter writer{room};
  EXPECT_TRUE(writer.add_unreferenced(NodeToldOption{what}.view()));
  const ByteView bytes =
      writer.finish(unicast_flag | explicit_initial_data_flag | reboot_flag, SessionId{session});
  return {bytes.begin(), bytes.end()};
}

// It hears nothing of what is sent to the address in whose name it speaks.
TEST_F(Acquaintances, AreNotMadeInTheNameOfAnother) {
  run(100ms);
  const Endpoint victim = host(3);
  for (std::uint16_t i = 1; i < 1000; ++i) {
    const NodeTold guess{.receive_buffer_bytes = 1U << 22U, .answer = i * 4'000'037U};
    server.on_datagram(told(guess, i), victim, false, now);
    run(1ms);
  }
  EXPECT_FALSE(server.is_proven(victim.address, now));
  EXPECT_EQ(server.receive_buffer_of({victim.address, 40000}, now), 0U);
}

// Of sessions that the real one has not used yet, as a forger would choose them.
TEST_F(Acquaintances, AreNotSpokenForByAnother) {
  run(100ms);
  server.on_datagram(told({.receive_buffer_bytes = 1}, 20), client_at, false, now);
  EXPECT_EQ(told_to_server(), of_client);
}

// Somebody speaks in the name of a node that does not require anything: it does not prove itself for that.
TEST_F(Acquaintances, AreNotMadeByWhoRequiresNothing) {
  run(100ms);
  client.on_datagram(told({.receive_buffer_bytes = 1U << 22U, .question = 7}, 1), host(3), false, now);
  const int before = to_one;
  std::array<std::byte, 1400> room{};
  while (const auto sent = client.poll_transmit(room, now)) {
    EXPECT_NE(sent->destination, host(3));
  }
  EXPECT_EQ(to_one, before);
}

// A node beside it at its address, whose socket it may be.
TEST_F(Acquaintances, CountForAnAddressIfAllThereAreKnown) {
  run(100ms);
  FakePeer beside{host(2, 30491)};
  server.on_datagram(beside.unicast({find(0x4711)}), beside.endpoint(), false, now);
  EXPECT_EQ(told_to_server(), 0U);
  EXPECT_TRUE(is_proven());
}

// What is known wins over what they tell.
TEST_F(Acquaintances, ArePacedByWhatIsKnownOfThem) {
  const std::array known{ReceiveBuffer{.host = own.address, .bytes = 5000},
                         ReceiveBuffer{.host = host(7).address, .bytes = 7000}};
  const std::span<const ReceiveBuffer> buffers{known};
  Settings settings = settings_of(host(9), 9);
  settings.receive_buffers = &buffers;
  Machine<> machine{settings};
  ASSERT_TRUE(machine.discovery.require(any_required, machine.now));
  FakePeer peer{own};
  machine.multicast(peer, {test::offer({udp(service_udp)})});
  for (std::optional<Happening> event; (event = machine.discovery.poll_event());) {
    if (const auto* const available = std::get_if<ServiceAvailable>(&*event)) {
      EXPECT_EQ(machine.discovery.receive_buffer_of(available->service.handle), 5000U);
    }
  }
  EXPECT_EQ(machine.discovery.receive_buffer_of(host(7, 40000), now), 7000U);
  EXPECT_EQ(machine.discovery.receive_buffer_of(host(8, 40000), now), 0U);
}

// --- With others ------------------------------------------------------------------------------------------

class ClientOfAnother : public Client {
 protected:
  void SetUp() override {
    if constexpr (!optimised_for_many) {
      GTEST_SKIP() << "a small device tells it only in a Subscribe";
    }
  }
  std::vector<std::string> told_in_time(Duration time) {
    require(any_required);
    machine.discovery.tell_receive_buffer(of_client);
    std::vector<std::string> told;
    for (const TimePoint end = machine.now + time; machine.now < end;) {
      machine.multicast(server, {offer({udp(server_udp)})});
      for (const std::string& sent : machine.run_to(machine.now - start + 1s)) {
        if (sent.find("-> 10.0.0.2") != std::string::npos) {
          told.push_back(sent);
        }
      }
    }
    return told;
  }
};

TEST_F(ClientOfAnother, TellsNothingToServersFromBeforeExplicitInitialData) {
  EXPECT_THAT(told_in_time(10s), IsEmpty());
}

TEST_F(ClientOfAnother, TellsAServerThatDoesNotTellThreeTimes) {
  server = FakePeer{server_sd, unicast_flag | explicit_initial_data_flag};
  EXPECT_THAT(told_in_time(300s), SizeIs(3));
}

TEST_F(ClientOfAnother, TellsNothingIfItIsNotTo) {
  Settings settings = fixed_settings();
  settings.tell_receive_buffer = false;
  Machine<> quiet{settings};
  quiet.discovery.tell_receive_buffer(of_client);
  ASSERT_TRUE(quiet.discovery.require(any_required, quiet.now));
  server = FakePeer{server_sd, unicast_flag | explicit_initial_data_flag};
  quiet.run_to(2s);
  quiet.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(quiet.run_to(2500ms), IsEmpty());
}

}  // namespace
}  // namespace trestle::sd::acquaintances_test
