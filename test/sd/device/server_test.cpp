#include "test/sd/device/fixture.hpp"

#include <set>

namespace trestle::test::server_test {
namespace {

using device::Error;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

/// A device that offers the service of Tables, and peers by hand.
class DeviceServer : public testing::Test {
 protected:
  DeviceServer() {
    EXPECT_TRUE(rig.device().offer(0, rig.now));
    rig.run_for(200ms);
    rig.sent.clear();
    rig.discovery.clear();
  }

  device::Settings settings() const {
    device::Settings settings = device_settings();
    settings.services = tables.services;
    return settings;
  }

  void subscribe_to(FakePeer& who, std::uint16_t eventgroup, const Endpoint& at, bool initial = false) {
    rig.receive(who.unicast({test::subscribe(eventgroup, {udp(at)}, 3, 0, initial)}), who.endpoint(), own);
  }
  device::Device& device() { return rig.device(); }

  Tables tables;
  Rig<> rig{settings()};
  FakePeer peer{peer_at, sd::unicast_flag | sd::explicit_initial_data_flag};
  FakePeer other_peer{other_peer_at, sd::unicast_flag | sd::explicit_initial_data_flag};
};

TEST_F(DeviceServer, OffersItsServiceBySd) {
  covers({"feat_req_someipsd_22", "feat_req_someipsd_62"});
  Tables other;
  device::Settings offered = device_settings();
  offered.services = other.services;
  Rig<> fresh{offered};
  ASSERT_TRUE(fresh.device().offer(0, fresh.now));
  fresh.run_for(10ms);
  EXPECT_THAT(
      fresh.take_discovery(),
      ElementsAre("224.244.224.245:30490 < s1 reboot: offer 1234.5678 v1.0 ttl 3 udp 10.0.0.1:30501"));
  EXPECT_EQ(fresh.discovery.size(), 0U);
}

TEST_F(DeviceServer, HandsARequestToTheApplicationAndSendsItsResponse) {
  covers({"feat_req_someip_338", "feat_req_someip_655"});
  std::string asked;
  rig.receive("1234 0001 0000000a 0102 0003 01 01 00 00 abcd", [&](const Happening& what) {
    const auto& request = std::get<device::Request>(what);
    asked = to_hex(request.payload);
    EXPECT_EQ(request.service, 0U);
    EXPECT_EQ(request.from, peer_udp);
    EXPECT_TRUE(device().respond(request, hex("beef00")));
  });
  EXPECT_EQ(asked, "abcd");
  EXPECT_THAT(rig.take_sent(), ElementsAre("40001 < 123400010000000b0102000301018000beef00"));
  EXPECT_EQ(device().counters().requests, 1U);
}

TEST_F(DeviceServer, AnswersARequestLater) {
  std::optional<device::Request> kept;
  rig.receive("1234 0001 00000008 0102 0003 01 01 00 00",
              [&](const Happening& what) { kept = std::get<device::Request>(what); });
  EXPECT_THAT(rig.take_sent(), IsEmpty());
  rig.run_for(1s);
  ASSERT_TRUE(kept);
  EXPECT_TRUE(device().respond_error(*kept, someip::ReturnCode{0x20}));
  rig.poll();
  EXPECT_THAT(rig.take_sent(), ElementsAre("40001 < 12340001000000080102000301018020"));
}

TEST_F(DeviceServer, AnswersFireAndForgetWithNothing) {
  covers({"feat_req_someip_348", "feat_req_someip_597"});
  std::size_t requests = 0;
  rig.receive("1234 0002 00000009 0102 0003 01 01 01 00 55", [&](const Happening& what) {
    ++requests;
    EXPECT_TRUE(device().respond(std::get<device::Request>(what), hex("00")));
    EXPECT_TRUE(device().respond_error(std::get<device::Request>(what), someip::ReturnCode::not_ok));
  });
  EXPECT_EQ(requests, 1U);
  EXPECT_THAT(rig.take_sent(), IsEmpty());
}

TEST_F(DeviceServer, AnswersWhatDoesNotFitWithItsError) {
  covers({"feat_req_someip_718", "feat_req_someip_655"});
  const auto nothing = [](const Happening&) { ADD_FAILURE() << "the application is asked"; };
  rig.receive("1234 0003 00000008 0102 0003 01 01 00 00", nothing);  // unknown method
  EXPECT_THAT(rig.take_sent(), ElementsAre("40001 < 12340003000000080102000301018003"));
  rig.receive("4321 0001 00000008 0102 0003 01 01 00 00", nothing);  // unknown service
  EXPECT_THAT(rig.take_sent(), ElementsAre("40001 < 43210001000000080102000301018002"));
  rig.receive("1234 0001 00000008 0102 0003 01 02 00 00", nothing);  // another interface version
  EXPECT_THAT(rig.take_sent(), ElementsAre("40001 < 12340001000000080102000301028008"));
  rig.receive("1234 0002 00000008 0102 0003 01 01 00 00", nothing);  // REQUEST to fire and forget
  EXPECT_THAT(rig.take_sent(), ElementsAre("40001 < 1234000200000008010200030101800a"));
  rig.receive("1234 0001 00000008 0102 0003 02 01 00 00", nothing);  // another protocol version
  EXPECT_THAT(rig.take_sent(), ElementsAre("40001 < 12340001000000080102000301018007"));
  EXPECT_EQ(device().counters().requests_answered, 5U);
  EXPECT_EQ(device().counters().requests, 0U);
}

TEST_F(DeviceServer, NeverAnswersAnErrorOrAMulticast) {
  covers({"feat_req_someip_704", "feat_req_someip_597"});
  rig.receive("1234 0003 00000008 0102 0003 01 01 81 01");
  rig.receive(hex("1234 0001 00000008 0102 0003 01 01 00 00"), peer_udp,
              {IpAddress::v4(224, 1, 2, 3), service_port});
  EXPECT_THAT(rig.take_sent(), IsEmpty());
  EXPECT_THAT(rig.happenings, IsEmpty());
  EXPECT_EQ(device().counters().unexpected, 2U);
}

TEST_F(DeviceServer, DropsAndCountsWhatIsMalformed) {
  covers({"feat_req_someip_798"});
  rig.receive("");
  rig.receive("1234 0001 0000");
  rig.receive("1234 0001 00000007 0102 0003 01 01 00 00");  // Length below 8
  rig.receive("1234 0001 00000009 0102 0003 01 01 00 00");  // cut short
  EXPECT_EQ(device().counters().malformed, 4U);
  rig.receive("1234 0010 00000008 0102 0003 01 01 00 00 12");  // a getter, and then half a header
  EXPECT_EQ(device().counters().malformed, 5U);
  EXPECT_THAT(rig.take_sent(), ElementsAre("40001 < 1234001000000"
                                           "00a0102000301018000002a"));
  rig.receive(hex("ffff 8100 00000010"), peer_at, own);  // to discovery
  EXPECT_EQ(device().discovery().dropped_malformed, 1U);
}

TEST_F(DeviceServer, AnswersEachMessageOfADatagramWhateverTheirNumber) {
  covers({"feat_req_someip_702"});
  std::string digits;
  for (int i = 0; i < 80; ++i) {
    digits += "1234 0010 00000008 0102 0003 01 01 00 00";
  }
  rig.receive(digits);
  EXPECT_THAT(rig.sent, SizeIs(80));
  EXPECT_EQ(device().counters().send_queue_full, 0U);
}

TEST_F(DeviceServer, DropsTheRestOfADatagramThatWasNotPolled) {
  const auto two = hex("1234 0001 00000008 0102 0003 01 01 00 00 1234 0001 00000008 0102 0004 01 01 00 00");
  device().on_datagram(two, peer_udp, service_at, rig.now);
  rig.receive("1234 0001 00000008 0102 0005 01 01 00 00", [&](const Happening& what) {
    EXPECT_EQ(std::get<device::Request>(what).header.session, someip::SessionId{5});
  });
  EXPECT_EQ(device().counters().not_polled, 1U);
  EXPECT_EQ(device().counters().requests, 1U);
}

// --- Events -----------------------------------------------------------------------------------------------

TEST_F(DeviceServer, AcknowledgesASubscriptionBeforeItsInitialEvents) {
  covers({"feat_req_someipsd_107", "feat_req_someipsd_833"});
  rig.from_ports.clear();
  subscribe_to(peer, 1, peer_udp, true);
  EXPECT_THAT(rig.from_ports, ElementsAre(own.port, service_port));
  EXPECT_THAT(rig.take_discovery(),
              ElementsAre("10.0.0.2:30490 < s1 reboot: ack 1234.5678 v1 group 0001 ttl 3 counter 0 initial"));
  // Only the field's: 0x8001 and 0x8002 are events without a value.
  EXPECT_THAT(rig.take_sent(), ElementsAre("40001 < 12348010"
                                           "0000000a"
                                           "0000"
                                           "0001"
                                           "01010200"
                                           "002a"));
  EXPECT_THAT(rig.happenings, ElementsAre(place_of<device::SubscriberAdded>()));
}

TEST(DeviceEvents, GoToMoreSubscribersThanAByteHasBits) {
  Tables tables;
  device::Settings settings = device_settings();
  settings.services = tables.services;
  Rig<device::Limits{.subscribers = 20, .peers = 20}> rig{settings};
  ASSERT_TRUE(rig.device().offer(0, rig.now));
  rig.run_for(100ms);
  for (std::uint8_t host = 2; host < 22; ++host) {
    FakePeer one{{IpAddress::v4(10, 0, 0, host), 30490}};
    rig.receive(one.unicast({test::subscribe(1, {udp({one.endpoint().address, 40000})})}), one.endpoint(),
                own);
  }
  EXPECT_EQ(rig.device().subscribers(0, MethodId{0x8001}), 20U);
  rig.sent.clear();
  ASSERT_TRUE(rig.device().notify(0, MethodId{0x8001}, hex("aa")));
  rig.poll();
  std::set<std::uint8_t> reached;
  for (const auto& sent : rig.sent) {
    reached.insert(sent.to.address.bytes[3]);
  }
  EXPECT_EQ(rig.sent.size(), 20U);
  EXPECT_EQ(reached.size(), 20U);
}

TEST_F(DeviceServer, TellsASubscriberThatWantsItsInitialEventsAnewFromANewOne) {
  covers({"feat_req_someipsd_1188"});
  std::vector<bool> again;
  const auto note = [&](const Happening& what) {
    again.push_back(std::get<device::SubscriberAdded>(what).again);
  };
  for (int i = 0; i < 2; ++i) {
    rig.receive(peer.unicast({test::subscribe(1, {udp(peer_udp)}, 3, 0, true)}), peer.endpoint(), own, note);
    EXPECT_EQ(rig.take_sent().size(), 1U);
  }
  EXPECT_THAT(again, ElementsAre(false, true));
}

TEST_F(DeviceServer, SendsAnEventToEachSubscriberOnce) {
  covers({"feat_req_someipsd_1168", "feat_req_someip_667"});
  subscribe_to(peer, 1, peer_udp);
  subscribe_to(peer, 2, peer_udp);
  subscribe_to(other_peer, 2, other_peer_udp);
  rig.take_sent();
  EXPECT_EQ(device().subscribers(0, MethodId{0x8001}), 1U);
  EXPECT_EQ(device().subscribers(0, MethodId{0x8002}), 2U);
  ASSERT_TRUE(device().notify(0, MethodId{0x8002}, hex("aa")));
  ASSERT_TRUE(device().notify(0, MethodId{0x8002}, hex("bb")));
  ASSERT_TRUE(device().notify(0, MethodId{0x8001}, hex("cc")));
  rig.poll();
  EXPECT_THAT(
      rig.take_sent(),
      ElementsAre("40001 < 12348002000000090000000101010200aa", "40002 < 12348002000000090000000101010200aa",
                  "40001 < 12348002000000090000000201010200bb", "40002 < 12348002000000090000000201010200bb",
                  "40001 < 12348001000000090000000101010200cc"));
}

TEST_F(DeviceServer, SendsNothingToWhoseSubscriptionIsOver) {
  covers({"feat_req_someipsd_433", "feat_req_someipsd_435"});
  subscribe_to(peer, 1, peer_udp);
  ASSERT_TRUE(device().notify(0, MethodId{0x8001}, hex("aa")));  // waits
  rig.receive(peer.unicast({test::subscribe(1, {udp(peer_udp)}, 0)}), peer_at, own);
  EXPECT_THAT(rig.take_sent(), IsEmpty());
  EXPECT_EQ(device().subscribers(0, MethodId{0x8001}), 0U);
  EXPECT_EQ(rig.happenings.back(), place_of<device::SubscriberRemoved>());
  subscribe_to(peer, 1, peer_udp);
  device().unreachable(peer_udp);
  EXPECT_TRUE(device().notify(0, MethodId{0x8001}, hex("aa")));
  rig.poll();
  EXPECT_THAT(rig.take_sent(), IsEmpty());
}

TEST_F(DeviceServer, RefusesWhatCannotBeNotified) {
  EXPECT_EQ(device().notify(1, MethodId{0x8001}, {}).error(), Error::bad_argument);
  EXPECT_EQ(device().notify(0, MethodId{0x8003}, {}).error(), Error::bad_argument);
  EXPECT_EQ(device().notify(0, MethodId{0x8010}, {}).error(), Error::bad_argument);  // a field's
  device().withdraw(0, rig.now);
  EXPECT_EQ(device().notify(0, MethodId{0x8001}, {}).error(), Error::not_offered);
  EXPECT_EQ(device().set_field(0, 0, {}).error(), Error::not_offered);
}

// --- Large messages ---------------------------------------------------------------------------------------

TEST_F(DeviceServer, SendsALargeEventInPacedSegmentsWhileSmallOnesPass) {
  covers(
      {"feat_req_someiptp_765", "feat_req_someiptp_768", "feat_req_someiptp_770", "feat_req_someiptp_801"});
  subscribe_to(peer, 1, peer_udp);
  subscribe_to(peer, 2, peer_udp);
  subscribe_to(other_peer, 2, other_peer_udp);
  rig.take_sent();
  const auto large = pattern(5 * 1392 + 40);
  ASSERT_TRUE(device().notify(0, MethodId{0x8002}, large));
  rig.poll();
  // A burst of four segments to each of the two, then 1 ms of pause.
  ASSERT_THAT(rig.sent, SizeIs(8));
  EXPECT_EQ(to_hex(ByteView{rig.sent[0].bytes}.first(24)),
            "12348002"
            "0000057c"
            "00000001"
            "01012200"
            "00000001"
            "00010203");
  EXPECT_EQ(rig.sent[0].bytes.size(), 16U + 4 + 1392);
  EXPECT_EQ(rig.sent[1].to, other_peer_udp);
  EXPECT_EQ(to_hex(ByteView{rig.sent[2].bytes}.subspan(16, 4)), "00000571");
  ASSERT_TRUE(device().notify(0, MethodId{0x8001}, hex("cc")));
  ASSERT_TRUE(device().notify(0, MethodId{0x8002}, hex("dd")));  // the same event: keeps its order
  rig.sent.clear();
  rig.poll();
  EXPECT_THAT(rig.take_sent(), ElementsAre("40001 < 12348001000000090000000101010200cc"));
  ASSERT_EQ(device().deadline(), rig.now + 1ms);
  const std::byte* finished = nullptr;
  rig.run_for(1ms, [&](const Happening& what) { finished = std::get<device::SendFinished>(what).payload; });
  ASSERT_THAT(rig.sent, SizeIs(6));
  EXPECT_EQ(to_hex(ByteView{rig.sent[2].bytes}.first(22)),
            "12348002"
            "00000034"
            "00000001"
            "01012200"
            "00001b30" +
                to_hex(ByteView{large}.subspan(6960, 2)));
  EXPECT_EQ(rig.sent[2].bytes.size(), 16U + 4 + 40);
  EXPECT_EQ(to_hex(rig.sent[4].bytes), "12348002000000090000000201010200dd");
  EXPECT_EQ(finished, large.data());
}

TEST_F(DeviceServer, TellsThatALargePayloadIsFreeWhenItsReceiversAreGone) {
  subscribe_to(peer, 1, peer_udp);
  rig.take_sent();
  const auto large = pattern(20'000);
  ASSERT_TRUE(device().notify(0, MethodId{0x8001}, large));
  rig.poll();
  EXPECT_THAT(rig.sent, SizeIs(4));
  device().unreachable(peer_udp);
  rig.happenings.clear();
  rig.run_for(5ms);
  EXPECT_THAT(rig.sent, SizeIs(4));
  EXPECT_THAT(rig.happenings, testing::UnorderedElementsAre(place_of<device::SubscriberRemoved>(),
                                                            place_of<device::SendFinished>()));
}

TEST_F(DeviceServer, PutsALargeRequestTogetherAndAnswersInSegments) {
  covers({"feat_req_someiptp_784", "feat_req_someiptp_785", "feat_req_someiptp_789"});
  const auto payload = pattern(48);
  const auto segment = [&](std::string_view length, std::string_view tp, std::size_t from, std::size_t size) {
    auto bytes = hex("1234 0001" + std::string{length} + "0102 0003 01 01 20 00" + std::string{tp});
    bytes.insert(bytes.end(), payload.begin() + static_cast<std::ptrdiff_t>(from),
                 payload.begin() + static_cast<std::ptrdiff_t>(from + size));
    return bytes;
  };
  rig.receive(segment("0000001c", "00000021", 32, 16), peer_udp, service_at);  // 48 bytes, more to come
  rig.receive(segment("0000001c", "00000001", 0, 16), peer_udp, service_at);
  rig.receive(segment("0000001c", "00000011", 16, 16), peer_udp, service_at);
  EXPECT_THAT(rig.happenings, IsEmpty());
  const auto answer = pattern(1401);
  std::string got;
  rig.receive(segment("0000000c", "00000030", 48, 0), peer_udp, service_at, [&](const Happening& what) {
    if (const auto* request = std::get_if<device::Request>(&what)) {
      got = to_hex(request->payload);
      EXPECT_TRUE(device().respond(*request, answer));
    }
  });
  EXPECT_EQ(got, to_hex(payload));
  ASSERT_THAT(rig.sent, SizeIs(2));
  EXPECT_EQ(to_hex(ByteView{rig.sent[1].bytes}),
            "12340001"
            "00000015"
            "01020003"
            "0101a000"
            "00000570" +
                to_hex(ByteView{answer}.subspan(1392)));
  EXPECT_EQ(rig.happenings.back(), place_of<device::SendFinished>());
}

// A client that was started anew counts its sessions from 1 on, as before.
TEST_F(DeviceServer, TakesNothingOfBeforeForALargeRequestOfAClientThatWasStartedAnew) {
  covers({"feat_req_someipsd_863", "feat_req_someiptp_781"});
  Rig<device::Limits{.tp_buffers = 2}> two{settings()};
  ASSERT_TRUE(two.device().offer(0, two.now));
  std::vector<std::string> requests;
  const auto receive = [&](const Endpoint& from, std::string_view tp, const std::string& slice) {
    two.receive(
        hex("1234 0001 0000001c 0102 0001 01 01 20 00 " + std::string{tp} + slice), from, service_at,
        [&](const Happening& what) { requests.push_back(to_hex(std::get<device::Request>(what).payload)); });
  };
  const auto discover = [&](FakePeer& who) {
    for (int i = 0; i < 2; ++i) {  // so that the first one after a reboot is not the last one again
      two.receive(who.unicast({test::find(0x4321)}), who.endpoint(), own);
    }
  };
  constexpr std::string_view start_more = "00000001";
  constexpr std::string_view rest = "00000010";  // at byte 16
  const std::string before(32, '1');
  const std::string first(32, '2');
  const std::string last(32, '3');
  discover(peer);
  discover(other_peer);
  receive(peer_udp, start_more, before);
  receive(other_peer_udp, start_more, before);

  peer.reboot();
  discover(peer);
  EXPECT_EQ(two.device().discovery().reboots_detected, 1U);
  EXPECT_EQ(two.device().reassembly()[someip::TpDrop::replaced], 1U);
  receive(peer_udp, rest, last);
  EXPECT_THAT(requests, IsEmpty()) << "half of a message of before was taken";
  receive(peer_udp, start_more, first);
  receive(other_peer_udp, rest, last);  // whose own half is still there
  EXPECT_THAT(requests, ElementsAre(first + last, before + last));

  // Nor is the next one with that session a straggler of the one that was whole.
  peer.reboot();
  discover(peer);
  receive(peer_udp, start_more, before);
  receive(peer_udp, rest, last);
  EXPECT_THAT(requests, ElementsAre(first + last, before + last, before + last));
  EXPECT_EQ(two.device().reassembly()[someip::TpDrop::stale], 0U);
}

TEST_F(DeviceServer, DropsSegmentsThatItCannotPutTogether) {
  covers({"feat_req_someiptp_782"});
  // Beyond the 8 KB of the buffer; of a service that is not here; without session.
  rig.receive("1234 0001 0000001c 0102 0003 01 01 20 00 00002001 000102030405060708090a0b0c0d0e0f");
  EXPECT_EQ(device().counters().not_reassembled, 1U);
  EXPECT_EQ(device().reassembly()[someip::TpDrop::too_large], 1U);
  rig.receive("4321 0001 0000001c 0102 0003 01 01 20 00 00000001 000102030405060708090a0b0c0d0e0f");
  EXPECT_EQ(device().counters().unexpected, 1U);
  rig.receive("1234 0001 0000001c 0102 0000 01 01 20 00 00000001 000102030405060708090a0b0c0d0e0f");
  EXPECT_EQ(device().reassembly()[someip::TpDrop::session_zero], 1U);
  EXPECT_THAT(rig.happenings, IsEmpty());
}

}  // namespace
}  // namespace trestle::test::server_test
