// Floods of addresses that each say little: who is honest and comes new gets in, who renews stays.
#include <gmock/gmock.h>

#include "test/covers.hpp"
#include "test/sd/machine.hpp"

namespace trestle::sd::crowds_test {
namespace {
using namespace test;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr std::array groups{Eventgroup{.id = EventgroupId{1}}, Eventgroup{.id = EventgroupId{2}}};
constexpr OfferedService service{.service = ServiceId{0x1234},
                                 .instance = InstanceId{0x5678},
                                 .udp = Endpoint{IpAddress::v4(10, 0, 0, 1), 30509},
                                 .eventgroups = groups};

// How each address of a flood behaves.
struct Crowd {
  const char* what;
  Duration pause;        // between two messages of all
  int again;             // each address speaks once more after so many others; 0: it does not
  std::uint16_t groups;  // to each of which it subscribes
};

class Crowds : public testing::TestWithParam<Crowd> {
 protected:
  void SetUp() override {
    const auto handle = machine.discovery.offer(service, machine.now);
    ASSERT_TRUE(handle);
    offered = *handle;
  }

  [[nodiscard]] static FakePeer attacker(int number) {
    return FakePeer{{IpAddress::v4(10, 1, static_cast<std::uint8_t>(number / 250),
                                   static_cast<std::uint8_t>(number % 250)),
                     30490}};
  }
  static std::vector<FakePeer::Said> subscriptions(const FakePeer& peer, std::uint16_t groups,
                                                   std::uint32_t ttl_s) {
    std::vector<FakePeer::Said> said;
    for (std::uint16_t group = 1; group <= groups; ++group) {
      said.push_back(subscribe(group, {udp({peer.endpoint().address, 5000})}, ttl_s));
    }
    return said;
  }
  void attack() {
    attackers.push_back(attacker(static_cast<int>(attackers.size())));
    machine.unicast(attackers.back(), subscriptions(attackers.back(), GetParam().groups, infinite_ttl_s));
    const int again = GetParam().again;
    if (again > 0 && attackers.size() > static_cast<std::size_t>(again)) {
      FakePeer& earlier = attackers[attackers.size() - static_cast<std::size_t>(again)];
      machine.unicast(earlier, subscriptions(earlier, GetParam().groups, infinite_ttl_s));
    }
  }
  // Honest ones subscribe to both eventgroups with each offer, once a second.
  void renew(FakePeer& peer) { machine.unicast(peer, subscriptions(peer, 2, 3)); }
  void pass(Duration time, const std::vector<FakePeer*>& honest) {
    const TimePoint end = machine.now + time;
    TimePoint next_renewal = machine.now;
    while (machine.now < end) {
      if (next_renewal <= machine.now) {
        next_renewal += 1s;
        for (FakePeer* const peer : honest) {
          renew(*peer);
        }
      }
      attack();
      note();
      machine.run_to(machine.now - start + GetParam().pause);
      note();
    }
  }
  void note() {
    for (std::string& event : machine.events()) {
      events.push_back(std::move(event));
    }
  }
  [[nodiscard]] std::size_t subscriptions_of(const FakePeer& peer) {
    std::size_t count = 0;
    for (std::uint16_t group = 1; group <= 2; ++group) {
      machine.discovery.for_each_subscriber(offered, EventgroupId{group}, [&](const Subscriber& one) {
        count += one.peer == peer.endpoint() ? 1 : 0;
      });
    }
    return count;
  }

  Machine<> machine;
  OfferHandle offered;
  std::vector<FakePeer> attackers;
  std::vector<std::string> events;
};

TEST_P(Crowds, KeepNobodyOutAndDisplaceNobodyWhoRenews) {
  if constexpr (!optimised_for_many) {
    GTEST_SKIP() << "a small device remembers too few that had to make room";
  }
  covers({"feat_req_someipsd_1137"});
  std::vector<FakePeer> known;
  std::vector<FakePeer*> honest;
  for (std::uint8_t number = 2; number < 6; ++number) {
    known.emplace_back(host(number));
  }
  for (FakePeer& peer : known) {
    honest.push_back(&peer);
  }
  for (int i = 0; i < 4; ++i) {
    for (FakePeer* const peer : honest) {
      renew(*peer);
    }
    machine.run_to(machine.now - start + 1s);
  }
  events.clear();
  pass(5s, honest);
  FakePeer newcomer{host(99)};
  honest.push_back(&newcomer);
  pass(2s, honest);  // within which it is served
  EXPECT_EQ(subscriptions_of(newcomer), 2U);
  note();
  events.clear();
  pass(20s, honest);
  EXPECT_EQ(subscriptions_of(newcomer), 2U);
  EXPECT_THAT(events, Not(Contains(HasSubstr("10.0.0.")))) << "nobody who renews loses anything";
  EXPECT_THAT(events, Contains(HasSubstr("displaced")));
}

INSTANTIATE_TEST_SUITE_P(Of, Crowds,
                         testing::Values(Crowd{"OneEntry", Duration{1s} / 60, 0, 1},
                                         Crowd{"TwoEntries", Duration{1s} / 60, 0, 2},
                                         Crowd{"SpeakingTwice", Duration{1s} / 60, 10, 1}),
                         [](const auto& info) { return info.param.what; });

// Addresses that the attacker has, or not, but does not read at: they speak again when they like.
class FastCrowds : public testing::TestWithParam<std::pair<int, int>> {};  // per second, addresses

TEST_P(FastCrowds, DisplaceNobodyWhoHearsWhatIsSentToIt) {
  if constexpr (!optimised_for_many) {
    GTEST_SKIP() << "too few places for a flood as fast as this";
  }
  const auto [rate, addresses] = GetParam();
  Machine<Limits{.max_subscribers = 4096, .max_peers = 256}> machine;
  OfferedService first_only = service;
  first_only.eventgroups = std::span{groups}.first(1);
  ASSERT_TRUE(machine.discovery.offer(first_only, machine.now));
  std::vector<FakePeer> crowd;
  for (int i = 0; i < addresses; ++i) {
    crowd.emplace_back(Endpoint{
        IpAddress::v4(10, 1, static_cast<std::uint8_t>(i / 250), static_cast<std::uint8_t>(i % 250)), 30490});
  }
  FakePeer honest{host(99)};
  const auto renew = [&] { machine.unicast(honest, {subscribe(1, {udp(host(99, 5000))})}); };
  bool subscribed = false;
  int lost = 0;
  for (int i = 0; i < 10 * rate; ++i) {
    FakePeer& one = crowd[static_cast<std::size_t>(i % addresses)];
    machine.unicast(one, {subscribe(1, {udp({one.endpoint().address, 6000})}, infinite_ttl_s)});
    for (const std::string& sent : machine.run_to(machine.now - start + Duration{1s} / rate)) {
      const bool is_offer = sent.find(": offer") != std::string::npos;
      if (subscribed && is_offer &&
          (sent.find("224.244") != std::string::npos || sent.find("10.0.0.99") != std::string::npos)) {
        renew();
      }
    }
    if (i == 3 * rate) {
      renew();
      subscribed = true;
    }
    for (const std::string& event : machine.events()) {
      const bool its = event.find("10.0.0.99") != std::string::npos;
      lost += i > 3 * rate + rate / 4 && its && event.find("removed") != std::string::npos ? 1 : 0;
    }
  }
  EXPECT_EQ(lost, 0);
}

INSTANTIATE_TEST_SUITE_P(Of, FastCrowds,
                         testing::Values(std::pair{300, 600}, std::pair{1000, 600}, std::pair{1000, 2000}));

// Addresses that subscribe again and again, more than there are places for, and none of them because of an
// Offer.
struct Deaf {
  int addresses;
  Duration pause;     // between two messages of an address
  std::size_t again;  // it says the same once more after so many others; 0: it does not
};

class DeafCrowds : public testing::TestWithParam<Deaf> {
 protected:
  static Settings seeded(std::uint64_t seed) {
    Settings settings = fixed_settings();
    settings.seed = seed;
    return settings;
  }
  static bool is_for(const std::string& sent, const std::string& address) {
    return sent.find(": offer") != std::string::npos &&
           (sent.find("224.244") != std::string::npos || sent.find(address) != std::string::npos);
  }
};

TEST_P(DeafCrowds, MakeRoomForWhoAnswersAndDoNotDisplaceIt) {
  if constexpr (!optimised_for_many) {
    GTEST_SKIP() << "a small device asks nobody whether it hears";
  }
  covers({"feat_req_someipsd_1137"});
  const auto [addresses, pause, again] = GetParam();
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    Machine<Limits{.max_subscribers = 4096, .max_peers = 256}> machine{seeded(seed)};
    OfferedService first_only = service;
    first_only.eventgroups = std::span{groups}.first(1);
    ASSERT_TRUE(machine.discovery.offer(first_only, machine.now));
    std::vector<FakePeer> crowd;
    for (int i = 0; i < addresses; ++i) {
      crowd.emplace_back(Endpoint{
          IpAddress::v4(10, 1, static_cast<std::uint8_t>(i / 250), static_cast<std::uint8_t>(i % 250)),
          30490});
    }
    const auto speak = [&](FakePeer& peer) {
      machine.unicast(peer, {subscribe(1, {udp({peer.endpoint().address, 6000})})});
    };
    FakePeer honest{host(99)};
    std::optional<TimePoint> served;
    int lost = 0;
    const auto pass = [&](Duration time) {
      for (const TimePoint end = machine.now + time; machine.now < end;) {
        const auto sent = machine.run_to(std::min(machine.now + Duration{5ms}, end) - start);
        if (machine.now - start >= 5s &&
            std::ranges::any_of(sent, [](const auto& one) { return is_for(one, "10.0.0.99"); })) {
          speak(honest);  // once for all that it has heard
        }
        for (const std::string& event : machine.events()) {
          const bool its = event.find("10.0.0.99") != std::string::npos;
          const bool is_end = event.find("removed") != std::string::npos;
          served = its && !is_end && !served ? machine.now : served;
          lost += its && is_end ? 1 : 0;
        }
      }
    };
    std::uint64_t displaced = 0;
    std::uint64_t sent = 0;
    for (std::size_t next = 0; machine.now - start < 20s; ++next) {
      if (machine.now - start <= 5s) {
        displaced = machine.discovery.counters().displaced;
        sent = machine.discovery.counters().datagrams_sent;
      }
      speak(crowd[next % crowd.size()]);
      if (again > 0) {
        speak(crowd[(next + crowd.size() - again) % crowd.size()]);
      }
      pass(pause / addresses);
    }
    EXPECT_TRUE(served && *served <= start + 7s);
    EXPECT_EQ(lost, 0);
    // It costs little: some take the places of others, and those without one are seldom answered.
    EXPECT_LE(machine.discovery.counters().displaced - displaced, 15U * 10U + 64U);
    const auto subscribes_of_64 = static_cast<std::uint64_t>(64 * 15s / pause) * (again > 0 ? 2 : 1);
    EXPECT_LE(machine.discovery.counters().datagrams_sent - sent, subscribes_of_64 + 15U * 220U);
  }
}

INSTANTIATE_TEST_SUITE_P(Of, DeafCrowds,
                         testing::Values(Deaf{100, 1s, 0}, Deaf{100, 2s, 0}, Deaf{70, 1s, 0}, Deaf{70, 2s, 0},
                                         Deaf{64, 1s, 0}, Deaf{250, 2500ms, 0}, Deaf{100, 1s, 6}),
                         [](const auto& info) {
                           return std::to_string(info.param.addresses) + "Each" +
                                  std::to_string(info.param.pause / 1ms) + "ms" +
                                  (info.param.again > 0 ? "Twice" : "");
                         });

}  // namespace
}  // namespace trestle::sd::crowds_test
