// What somebody who only listens makes of the datagrams of service discovery.
#include "bridge/traffic/network_view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridge/inspect/tools/sighting_text.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"

namespace trestle::traffic::network_view_test {
namespace {

using namespace std::chrono_literals;
using namespace trestle::test;
using inspect::describe;
using inspect::to_json;
using testing::ElementsAre;
using testing::IsEmpty;

const TimePoint start = TimePoint{} + 1h;
const Endpoint peer{IpAddress::v4(10, 0, 0, 5), 30490};
const Endpoint client{IpAddress::v4(10, 0, 0, 9), 30490};
const Endpoint group{IpAddress::v4(224, 244, 224, 245), 30490};

// Service 0x1111, instance 1, version 1.0; TTL 3; UDP 10.0.0.5:30509 (0x772d).
constexpr const char* offer_entry = "01 00 00 10 1111 0001 01 000003 00000000";
constexpr const char* stop_entry = "01 00 00 10 1111 0001 01 000000 00000000";
constexpr const char* find_entry = "00 00 00 00 2222 ffff ff 000003 ffffffff";
constexpr const char* udp_option = "0009 04 00 0a000005 00 11 772d";
constexpr const char* tcp_option = "0009 04 00 0a000005 00 06 772e";

/// A SOME/IP-SD message as it stands on the wire.
std::vector<std::byte> sd_message(std::uint16_t session, const std::string& entries,
                                  const std::string& options, const char* flags = "c0000000") {
  const auto entry_bytes = hex(entries).size();
  const auto option_bytes = hex(options).size();
  char head[200];
  std::snprintf(head, sizeof head, "ffff8100 %08zx 0000%04x 01010200 %s %08zx",
                8 + 12 + entry_bytes + option_bytes, session, flags, entry_bytes);
  char between[20];
  std::snprintf(between, sizeof between, "%08zx", option_bytes);
  return hex(head + entries + between + options);
}

class Watching : public testing::Test {
 protected:
  /// What a datagram tells, in words.
  std::vector<std::string> hear(const std::vector<std::byte>& datagram, TimePoint now,
                                const Endpoint& from = peer, const Endpoint& to = group) {
    std::vector<Sighting> sightings;
    view.on_datagram(datagram, from, to, now, sightings);
    return in_words(sightings);
  }
  std::vector<std::string> wait_until(TimePoint now) {
    std::vector<Sighting> sightings;
    view.on_time(now, sightings);
    return in_words(sightings);
  }
  static std::vector<std::string> in_words(const std::vector<Sighting>& sightings) {
    std::vector<std::string> words;
    words.reserve(sightings.size());
    for (const Sighting& one : sightings) {
      words.push_back(describe(one));
    }
    return words;
  }
  NetworkView view{3};
};

TEST_F(Watching, TellsOfAnOfferOnce) {
  EXPECT_THAT(hear(sd_message(1, offer_entry, udp_option), start),
              ElementsAre("offered       0x1111.0x0001  1.0  udp 10.0.0.5:30509  by 10.0.0.5  ttl 3 s"));
  EXPECT_THAT(hear(sd_message(2, offer_entry, udp_option), start + 1s), IsEmpty());
  EXPECT_THAT(hear(sd_message(3, offer_entry, udp_option), start + 2s), IsEmpty());
  ASSERT_EQ(view.services().size(), 1U);
  EXPECT_DOUBLE_EQ(view.services().begin()->second.rate(), 1.0);
  EXPECT_EQ(view.counters().messages, 3U);
}

TEST_F(Watching, KnowsTheCycleOfOffersToAll) {
  const auto cycle = [&] { return view.services().begin()->second.cycle; };
  hear(sd_message(1, offer_entry, udp_option), start);
  EXPECT_EQ(cycle(), std::nullopt);
  hear(sd_message(1, offer_entry, udp_option), start + 300ms, peer, client);  // an answer to a Find
  hear(sd_message(2, offer_entry, udp_option), start + 1s);
  EXPECT_EQ(cycle(), 1s);
  hear(sd_message(3, offer_entry, udp_option), start + 3s);
  EXPECT_EQ(cycle(), 2s);
}

TEST_F(Watching, TellsOfOtherEndpointsAndVersions) {
  hear(sd_message(1, offer_entry, udp_option), start);
  const std::string both = "01 00 00 20 1111 0001 01 ffffff 00000007";
  EXPECT_THAT(
      hear(sd_message(2, both, std::string{udp_option} + tcp_option), start + 1s),
      ElementsAre("changed       0x1111.0x0001  1.7  udp 10.0.0.5:30509  tcp 10.0.0.5:30510  by 10.0.0.5  "
                  "until reboot"));
  EXPECT_THAT(wait_until(start + 1000h), IsEmpty());  // it never expires
}

TEST_F(Watching, TellsOfWithdrawalOnce) {
  EXPECT_THAT(hear(sd_message(1, stop_entry, udp_option), start), IsEmpty());  // of what it does not know
  hear(sd_message(2, offer_entry, udp_option), start);
  EXPECT_THAT(hear(sd_message(3, stop_entry, udp_option), start + 1s),
              ElementsAre("stopped       0x1111.0x0001  1.0  by 10.0.0.5"));
  EXPECT_THAT(hear(sd_message(4, stop_entry, udp_option), start + 1s), IsEmpty());
  EXPECT_THAT(wait_until(start + 10s), IsEmpty());
  EXPECT_EQ(hear(sd_message(5, offer_entry, udp_option), start + 11s).size(), 1U);  // and again of its return
}

TEST_F(Watching, TellsOfExpiryWhenTheTtlHasRunOut) {
  hear(sd_message(1, offer_entry, udp_option), start);
  hear(sd_message(2, offer_entry, udp_option), start + 1s);
  EXPECT_THAT(wait_until(start + 3999ms), IsEmpty());
  EXPECT_THAT(wait_until(start + 4s), ElementsAre("expired       0x1111.0x0001  1.0  by 10.0.0.5"));
  EXPECT_THAT(wait_until(start + 5s), IsEmpty());
}

TEST_F(Watching, TellsOfARebootBeforeTheNewOffers) {
  hear(sd_message(7, offer_entry, udp_option), start);
  EXPECT_THAT(hear(sd_message(1, offer_entry, udp_option), start + 1s),
              ElementsAre("rebooted      0x1111.0x0001  1.0  by 10.0.0.5",
                          "offered       0x1111.0x0001  1.0  udp 10.0.0.5:30509  by 10.0.0.5  ttl 3 s"));
}

TEST_F(Watching, TellsWhoLooksForWhat) {
  EXPECT_THAT(hear(sd_message(1, find_entry, ""), start),
              ElementsAre("looked_for    0x2222.*  *.*  by 10.0.0.5"));
}

// To eventgroup 4 of that service, for 3 s; events to UDP 10.0.0.9:4660 (0x1234).
constexpr const char* subscribe_entry = "06 00 00 10 1111 0001 01 000003 00000004";
constexpr const char* stop_subscribe_entry = "06 00 00 10 1111 0001 01 000000 00000004";
constexpr const char* ack_entry = "07 00 00 00 1111 0001 01 000003 00000004";
constexpr const char* multicast_ack_entry = "07 00 00 10 1111 0001 01 000003 00000004";
constexpr const char* nack_entry = "07 00 00 00 1111 0001 01 000000 00000004";
constexpr const char* client_option = "0009 04 00 0a000009 00 11 1234";
constexpr const char* multicast_option = "0009 14 00 e0000102 00 11 7e58";  // 224.0.1.2:32344

TEST_F(Watching, TellsOfASubscriptionFromTheWishToTheEnd) {
  EXPECT_THAT(hear(sd_message(1, subscribe_entry, client_option), start, client, peer),
              ElementsAre("subscribed    0x1111.0x0001  eventgroup 0x0004  by 10.0.0.9  at 10.0.0.5  "
                          "udp 10.0.0.9:4660  ttl 3 s"));
  ASSERT_EQ(view.subscriptions().size(), 1U);
  const SeenSubscription& seen = view.subscriptions().begin()->second;
  EXPECT_EQ(seen.state, SeenSubscription::State::asked);
  EXPECT_THAT(hear(sd_message(1, multicast_ack_entry, multicast_option), start, peer, client),
              ElementsAre("acknowledged  0x1111.0x0001  eventgroup 0x0004  by 10.0.0.9  at 10.0.0.5  "
                          "multicast 224.0.1.2:32344"));
  EXPECT_EQ(seen.state, SeenSubscription::State::acknowledged);
  // Renewed, which is no news.
  EXPECT_THAT(hear(sd_message(2, subscribe_entry, client_option), start + 2s, client, peer), IsEmpty());
  EXPECT_THAT(hear(sd_message(2, multicast_ack_entry, multicast_option), start + 2s, peer, client),
              IsEmpty());
  EXPECT_EQ(seen.first_seen, start);
  EXPECT_EQ(seen.expires(), start + 5s);
  EXPECT_THAT(hear(sd_message(3, stop_subscribe_entry, client_option), start + 3s, client, peer),
              ElementsAre("unsubscribed  0x1111.0x0001  eventgroup 0x0004  by 10.0.0.9  at 10.0.0.5"));
  EXPECT_THAT(wait_until(start + 10s), IsEmpty());
  EXPECT_TRUE(seen.gone);
  view.forget_gone(start + 3s);
  EXPECT_THAT(view.subscriptions(), IsEmpty());
}

TEST_F(Watching, TellsOfARefusalAndOfTheAcceptanceAfterIt) {
  hear(sd_message(1, subscribe_entry, client_option), start, client, peer);
  EXPECT_THAT(hear(sd_message(1, nack_entry, ""), start, peer, client),
              ElementsAre("refused       0x1111.0x0001  eventgroup 0x0004  by 10.0.0.9  at 10.0.0.5"));
  EXPECT_THAT(hear(sd_message(2, subscribe_entry, client_option), start + 1s, client, peer), IsEmpty());
  EXPECT_THAT(hear(sd_message(2, nack_entry, ""), start + 1s, peer, client), IsEmpty());
  EXPECT_THAT(hear(sd_message(3, ack_entry, ""), start + 2s, peer, client),
              ElementsAre("acknowledged  0x1111.0x0001  eventgroup 0x0004  by 10.0.0.9  at 10.0.0.5"));
}

TEST_F(Watching, ForgetsARefusedWishQuietly) {
  hear(sd_message(1, subscribe_entry, client_option), start, client, peer);
  hear(sd_message(1, nack_entry, ""), start, peer, client);
  EXPECT_THAT(wait_until(start + 3s), IsEmpty());
  EXPECT_TRUE(view.subscriptions().begin()->second.gone);
}

TEST_F(Watching, TellsOfAnAnswerWhoseQuestionWasMissed) {
  EXPECT_THAT(hear(sd_message(9, ack_entry, ""), start, peer, client),
              ElementsAre("acknowledged  0x1111.0x0001  eventgroup 0x0004  by 10.0.0.9  at 10.0.0.5"));
  EXPECT_THAT(wait_until(start + 3s),
              ElementsAre("expired       0x1111.0x0001  eventgroup 0x0004  by 10.0.0.9  at 10.0.0.5"));
}

TEST_F(Watching, KeepsSubscribersApart) {
  const Endpoint other{IpAddress::v4(10, 0, 0, 10), 30490};
  hear(sd_message(1, subscribe_entry, client_option), start, client, peer);
  EXPECT_EQ(hear(sd_message(1, subscribe_entry, client_option), start, other, peer).size(), 1U);
  hear(sd_message(1, ack_entry, ""), start, peer, other);
  EXPECT_EQ(view.subscriptions().begin()->second.state, SeenSubscription::State::asked);
  EXPECT_EQ(std::next(view.subscriptions().begin())->second.state, SeenSubscription::State::acknowledged);
}

TEST_F(Watching, EndsSubscriptionsWithTheirService) {
  covers({"feat_req_someipsd_830"});
  hear(sd_message(1, offer_entry, udp_option), start);
  hear(sd_message(1, subscribe_entry, client_option), start, client, peer);
  EXPECT_THAT(hear(sd_message(2, stop_entry, udp_option), start + 1s),
              ElementsAre("stopped       0x1111.0x0001  1.0  by 10.0.0.5"));
  EXPECT_TRUE(view.subscriptions().begin()->second.gone);
  // And anew when it is back.
  hear(sd_message(3, offer_entry, udp_option), start + 2s);
  EXPECT_EQ(hear(sd_message(2, subscribe_entry, client_option), start + 2s, client, peer).size(), 1U);
}

TEST_F(Watching, EndsSubscriptionsOfWhoWasStartedAnew) {
  covers({"feat_req_someipsd_765"});
  hear(sd_message(7, subscribe_entry, client_option), start, client, peer);
  hear(sd_message(3, find_entry, ""), start, client);  // counted apart, so no sign of a reboot
  EXPECT_FALSE(view.subscriptions().begin()->second.gone);
  EXPECT_THAT(hear(sd_message(1, find_entry, ""), start + 1s, client),
              ElementsAre("rebooted      0x1111.0x0001  eventgroup 0x0004  by 10.0.0.9  at 10.0.0.5",
                          "looked_for    0x2222.*  *.*  by 10.0.0.9"));
  // All its counters began anew: that is the same reboot, not another.
  EXPECT_THAT(hear(sd_message(1, subscribe_entry, client_option), start + 1s, client, peer),
              ElementsAre(testing::StartsWith("subscribed ")));
}

TEST_F(Watching, KeepsNoMoreSubscriptionsThanThereIsRoomFor) {
  for (std::uint8_t host = 1; host <= 5; ++host) {
    const Endpoint from{IpAddress::v4(10, 0, 1, host), 30490};
    EXPECT_EQ(hear(sd_message(1, subscribe_entry, client_option), start, from, peer).size(),
              host <= 3 ? 1U : 0U);
  }
  EXPECT_EQ(view.subscriptions().size(), 3U);
  EXPECT_EQ(view.counters().not_kept, 2U);
}

TEST_F(Watching, TellsTheSameAsJson) {
  std::vector<Sighting> sightings;
  view.on_datagram(sd_message(1, offer_entry, udp_option), peer, group, start, sightings);
  view.on_datagram(sd_message(2, "06 00 00 10 1111 0001 01 000003 00000004", udp_option), client, peer, start,
                   sightings);
  ASSERT_EQ(sightings.size(), 2U);
  EXPECT_EQ(to_json(sightings[0], "T"),
            R"({"time":"T","seen":"offered","service":"0x1111","instance":"0x0001","major_version":1,)"
            R"("minor_version":0,"udp":"10.0.0.5:30509","peer":"10.0.0.5:30490","ttl":3})");
  EXPECT_EQ(to_json(sightings[1]),
            R"({"seen":"subscribed","service":"0x1111","instance":"0x0001","major_version":1,)"
            R"("eventgroup":"0x0004","udp":"10.0.0.5:30509","peer":"10.0.0.9:30490",)"
            R"("server":"10.0.0.5:30490","ttl":3})");
}

TEST_F(Watching, NamesTheEndpointInThePlaceOfTheSender) {
  covers({"feat_req_someipsd_1151"});
  const std::string sd_option = "0009 24 00 0a000007 00 11 771a";
  const std::string entry = "01 01 00 10 1111 0001 01 000003 00000000";  // its option is the second one
  EXPECT_THAT(hear(sd_message(1, entry, sd_option + udp_option), start),
              ElementsAre("offered       0x1111.0x0001  1.0  udp 10.0.0.5:30509  by 10.0.0.7  ttl 3 s"));
}

TEST_F(Watching, KeepsOfferersOfOneServiceApart) {
  hear(sd_message(1, offer_entry, udp_option), start);
  const Endpoint other{IpAddress::v4(10, 0, 0, 6), 30490};
  EXPECT_EQ(hear(sd_message(1, offer_entry, udp_option), start, other).size(), 1U);
  EXPECT_EQ(hear(sd_message(2, stop_entry, udp_option), start, other).size(), 1U);
  EXPECT_FALSE(view.services().begin()->second.gone);
}

TEST_F(Watching, IsNotFilledUp) {
  for (std::uint8_t host = 1; host <= 5; ++host) {
    const Endpoint from{IpAddress::v4(10, 0, 1, host), 30490};
    EXPECT_EQ(hear(sd_message(1, offer_entry, udp_option), start, from).size(), host <= 3 ? 1U : 0U);
  }
  EXPECT_EQ(view.services().size(), 3U);
  EXPECT_EQ(view.counters().not_kept, 2U);
  wait_until(start + 3s);
  view.forget_gone(start + 2999ms);
  EXPECT_EQ(view.services().size(), 3U);
  view.forget_gone(start + 3s);
  EXPECT_THAT(view.services(), IsEmpty());
}

TEST_F(Watching, CountsWhatIsMalformed) {
  const auto good = sd_message(1, offer_entry, udp_option);
  for (std::size_t size = 1; size < good.size(); ++size) {
    EXPECT_THAT(hear({good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size)}, start), IsEmpty());
  }
  EXPECT_EQ(view.counters().malformed, good.size() - 1);
  auto not_sd = good;
  not_sd[3] = std::byte{1};
  EXPECT_THAT(hear(not_sd, start), IsEmpty());
  EXPECT_EQ(view.counters().malformed, good.size());
  EXPECT_EQ(view.counters().messages, 0U);
  // An entry whose option is not there is still an offer, with no endpoint.
  EXPECT_THAT(hear(sd_message(1, offer_entry, ""), start),
              ElementsAre("offered       0x1111.0x0001  1.0  by 10.0.0.5  ttl 3 s"));
}

}  // namespace
}  // namespace trestle::traffic::network_view_test
