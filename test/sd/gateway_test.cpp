// Gateways: hosts whose services come from another network. What a gateway to the same network offers is
// withheld until somebody knows whether it is a way back.
#include "test/covers.hpp"
#include "test/sd/client_fixture.hpp"
#include "test/sd/server_fixture.hpp"

namespace trestle::sd::gateway_test {
namespace {
using namespace test;
using testing::AllOf;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

constexpr Endpoint network{IpAddress::v4(239, 255, 0, 1), 7400};
constexpr Endpoint other_network{IpAddress::v4(239, 255, 0, 1), 7650};

// What is sent until then: for each datagram its kinds of entries, and the options that none references.
std::vector<std::string> told(Machine<>& machine, Duration until) {
  std::vector<std::string> result;
  std::array<std::byte, 1400> room{};
  for (;;) {
    machine.discovery.on_time(machine.now);
    while (const auto datagram = machine.discovery.poll_transmit(room, machine.now)) {
      const auto message = decode(*someip::decode(datagram->bytes));
      std::string text;
      std::size_t referenced = 0;
      for (std::size_t i = 0; i < message->entry_count(); ++i) {
        const Entry entry = message->entry(i);
        text += entry.type == EntryType::find_service ? "find " : entry.ttl_s == 0 ? "stop " : "offer ";
        referenced += entry.option_count();
      }
      OptionCursor options = message->options();
      std::size_t count = 0;
      std::optional<Option> last;
      while (const auto option = options.next()) {
        last = option;
        ++count;
      }
      if (count > referenced) {
        text += describe(EndpointOption::decode(*last)->endpoint);
      }
      result.push_back(text);
    }
    const auto deadline = machine.discovery.deadline();
    if (!deadline || *deadline > start + until) {
      return result;
    }
    machine.now = *deadline;
  }
}

class Gateway : public testing::Test {
 protected:
  void SetUp() override {
    if constexpr (!optimised_for_many) {
      GTEST_SKIP() << "a small device is no gateway";
    }
  }
};

TEST_F(Gateway, TellsItsNetworkWithEachOfferAndNothingElse) {
  Machine<> machine;
  machine.discovery.be_gateway_to(network);
  ASSERT_TRUE(machine.discovery.require(required, machine.now));
  EXPECT_THAT(told(machine, 5ms), IsEmpty());
  const auto handle = machine.discovery.offer(udp_service, machine.now);
  ASSERT_TRUE(handle);
  EXPECT_THAT(told(machine, 100ms), ElementsAre("offer find 239.255.0.1:7400", "offer find 239.255.0.1:7400",
                                                "offer find 239.255.0.1:7400"));
  machine.discovery.stop_offer(*handle, machine.now);
  EXPECT_THAT(told(machine, 200ms), ElementsAre("stop "));
}

TEST_F(Gateway, TellsItInEachOfSeveralDatagrams) {
  Machine<> machine;
  machine.discovery.be_gateway_to(network);
  for (std::uint16_t i = 1; i <= 60; ++i) {
    OfferedService service = udp_service;
    service.instance = InstanceId{i};
    service.udp->port = static_cast<std::uint16_t>(30000 + i);
    service.eventgroups = {};
    ASSERT_TRUE(machine.discovery.offer(service, machine.now));
  }
  EXPECT_THAT(told(machine, 10ms), AllOf(SizeIs(2), Each(HasSubstr("239.255.0.1:7400"))));
}

TEST_F(Gateway, IsNoneUnlessToldSo) {
  Machine<> machine;
  ASSERT_TRUE(machine.discovery.offer(udp_service, machine.now));
  EXPECT_THAT(told(machine, 10ms), ElementsAre("offer "));
}

class Gateways : public Client {
 protected:
  Gateways() {
    machine.discovery.be_gateway_to(network);
    server.be_gateway_to(network);
  }
  void SetUp() override {
    if constexpr (!optimised_for_many) {
      GTEST_SKIP() << "a small device is no gateway";
    }
  }
  std::optional<RemoteHandle> withheld() {
    std::optional<RemoteHandle> found;
    machine.discovery.for_each_remote([&](const slots::Remote& remote) {
      if (remote.is_withheld()) {
        found = machine.discovery.service_of(remote).handle;
      }
    });
    return found;
  }
};

TEST_F(Gateways, WithholdWhatTheOtherOffersUntilItIsAdmitted) {
  require(required);
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp});
  machine.run_to(195ms);
  machine.multicast(server, {offer({udp(server_udp)})});
  machine.unicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.run_to(1s), Each(Not(HasSubstr("subscribe"))));
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_FALSE(machine.discovery.choose(requirement));

  ASSERT_TRUE(withheld());
  machine.discovery.admit(*withheld(), machine.now);
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr("subscribe 1234.5678 v1 group 0001 ttl 3 counter 0")));
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("available 1234.5678")));
  EXPECT_TRUE(machine.discovery.choose(requirement));
  EXPECT_FALSE(withheld());
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.events(), IsEmpty()) << "it stays admitted";
}

TEST_F(Gateways, TakeWhatComesFromOtherNetworksAndFromOtherHosts) {
  require(any_required);
  FakePeer ordinary{host(3)};
  FakePeer elsewhere{host(4)};
  elsewhere.be_gateway_to(other_network);
  machine.multicast(ordinary, {offer({udp(host(3, 30509))}, 3, 0x1234, 3)});
  machine.multicast(elsewhere, {offer({udp(host(4, 30509))}, 3, 0x1234, 4)});
  EXPECT_THAT(machine.events(),
              ElementsAre(HasSubstr("available 1234.0003"), HasSubstr("available 1234.0004")));
}

TEST_F(Gateways, DoNotLoseAServiceAgainBecauseItIsOfAGatewayNow) {
  require(required);
  FakePeer before{server_sd};
  machine.multicast(before, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("available")));
  before.be_gateway_to(network);
  machine.multicast(before, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_FALSE(withheld());
}

TEST_F(Gateways, SayNothingOfAWithheldServiceThatEnds) {
  require(required);
  machine.multicast(server, {offer({udp(server_udp)})});
  machine.multicast(server, {offer({udp(server_udp)}, 0)});
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_FALSE(withheld());
  machine.multicast(server, {offer({udp(server_udp)})});
  const auto handle = withheld();
  ASSERT_TRUE(handle);
  machine.run_to(4s);  // its TTL ends
  EXPECT_FALSE(withheld());
  machine.discovery.admit(*handle, machine.now);
  EXPECT_THAT(machine.events(), IsEmpty());
}

TEST_F(Gateways, WithholdItAnewAfterAReboot) {
  require(required);
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp});
  machine.multicast(server, {offer({udp(server_udp)})});
  machine.discovery.admit(*withheld(), machine.now);
  machine.unicast(server, {ack(1)});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("available"), "subscribed"));
  machine.run_to(1s);  // or it would be a duplicate
  server.reboot();
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.run_to(1100ms), Each(Not(HasSubstr("subscribe"))));
  EXPECT_THAT(machine.events(), ElementsAre("subscription lost rebooted", HasSubstr("lost 1234.5678")));
  ASSERT_TRUE(withheld());
}

TEST_F(Gateways, TellARequirementThatCameMeanwhile) {
  machine.multicast(server, {offer({udp(server_udp)})});
  require(required);
  EXPECT_THAT(machine.events(), IsEmpty());
  machine.discovery.admit(*withheld(), machine.now);
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("available 1234.5678")));
}

}  // namespace
}  // namespace trestle::sd::gateway_test
