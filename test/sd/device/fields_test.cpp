#include "test/sd/device/fixture.hpp"

namespace trestle::test::fields_test {
namespace {

using device::Error;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

/// A device with the fields of Tables, and a peer that subscribed to both eventgroups.
class DeviceFields : public testing::Test {
 protected:
  DeviceFields() {
    EXPECT_TRUE(rig.device().offer(0, rig.now));
    rig.run_for(200ms);
    for (const std::uint16_t eventgroup : {std::uint16_t{1}, std::uint16_t{2}}) {
      rig.receive(peer.unicast({test::subscribe(eventgroup, {udp(peer_udp)}, 100)}), peer_at, own);
    }
    rig.take_sent();
    rig.happenings.clear();
  }
  device::Settings settings() const {
    device::Settings settings = device_settings();
    settings.services = tables.services;
    return settings;
  }
  device::Device& device() { return rig.device(); }
  std::string value_of(std::size_t field) {
    const auto value = device().field(0, field);
    return value ? to_hex(*value) : "none";
  }

  Tables tables;
  Rig<> rig{settings()};
  FakePeer peer{peer_at, sd::unicast_flag | sd::explicit_initial_data_flag};
};

TEST_F(DeviceFields, AnswersTheGetter) {
  covers({"feat_req_someip_633"});
  rig.receive("1234 0010 00000008 0102 0003 01 01 00 00");
  EXPECT_THAT(rig.take_sent(), ElementsAre("40001 < 1234"
                                           "0010"
                                           "0000000a"
                                           "01020003"
                                           "01018000"
                                           "002a"));
  rig.receive("1234 0020 00000008 0102 0003 01 01 00 00");  // has no value: E_NOT_READY
  EXPECT_THAT(rig.take_sent(), ElementsAre("40001 < 1234"
                                           "0020"
                                           "00000008"
                                           "01020003"
                                           "01018004"));
  EXPECT_THAT(rig.happenings, IsEmpty());
}

TEST_F(DeviceFields, SetsWhatASetterBringsAndNotifiesAfterTheResponse) {
  covers({"feat_req_someip_634", "feat_req_someip_635"});
  std::string told;
  rig.receive("1234 0011 0000000b 0102 0003 01 01 00 00 112233",
              [&](const Happening& what) { told = to_hex(std::get<device::FieldSet>(what).value); });
  EXPECT_THAT(rig.take_sent(), ElementsAre("40001 < 1234"
                                           "0011"
                                           "0000000b"
                                           "01020003"
                                           "01018000"
                                           "112233",
                                           "40001 < 1234"
                                           "8010"
                                           "0000000b"
                                           "00000001"
                                           "01010200"
                                           "112233"));
  EXPECT_EQ(told, "112233");
  EXPECT_EQ(value_of(0), "112233");
  rig.receive("1234 0011 0000000b 0102 0004 01 01 00 00 112233");  // the same value: no notification
  EXPECT_THAT(rig.take_sent(), ElementsAre("40001 < 1234"
                                           "0011"
                                           "0000000b"
                                           "01020004"
                                           "01018000"
                                           "112233"));
}

TEST_F(DeviceFields, RefusesAValueThatIsTooLong) {
  rig.receive("1234 0011 0000000d 0102 0003 01 01 00 00 1122334455");
  EXPECT_THAT(rig.take_sent(), ElementsAre("40001 < 1234"
                                           "0011"
                                           "00000008"
                                           "01020003"
                                           "01018009"));
  EXPECT_EQ(value_of(0), "002a");
  EXPECT_THAT(rig.happenings, IsEmpty());
  EXPECT_EQ(device().set_field(0, 0, hex("1122334455")).error(), Error::too_large);
  EXPECT_EQ(device().set_field(0, 3, {}).error(), Error::bad_argument);
}

TEST_F(DeviceFields, LetsTheApplicationJudgeAValue) {
  covers({"feat_req_someip_634"});
  const auto judge = [&](const Happening& what) {
    const auto& request = std::get<device::Request>(what);
    if (request.payload.size() == 2) {
      EXPECT_TRUE(device().accept(request, hex("0064")));  // as much as there may be
    } else {
      EXPECT_TRUE(device().respond_error(request, someip::ReturnCode::malformed_message));
    }
  };
  rig.receive("1234 0021 0000000a 0102 0003 01 01 00 00 ffff", judge);
  EXPECT_THAT(rig.take_sent(), ElementsAre("40001 < 1234"
                                           "0021"
                                           "0000000a"
                                           "01020003"
                                           "01018000"
                                           "0064",
                                           "40001 < 1234"
                                           "8020"
                                           "0000000a"
                                           "00000001"
                                           "01010200"
                                           "0064"));
  rig.receive("1234 0021 00000009 0102 0004 01 01 00 00 ff", judge);
  EXPECT_THAT(rig.take_sent(), ElementsAre("40001 < 1234"
                                           "0021"
                                           "00000008"
                                           "01020004"
                                           "01018009"));
  EXPECT_EQ(value_of(1), "0064");
}

TEST_F(DeviceFields, TellsOfChangesOnly) {
  covers({"feat_req_someip_635"});
  EXPECT_TRUE(device().set_field(0, 0, hex("002a")));
  rig.poll();
  EXPECT_THAT(rig.take_sent(), IsEmpty());
  EXPECT_TRUE(device().set_field(0, 0, hex("01")));
  EXPECT_TRUE(device().set_field(0, 0, hex("02")));
  rig.poll();
  EXPECT_THAT(rig.take_sent(), ElementsAre("40001 < 1234"
                                           "8010"
                                           "00000009"
                                           "00000001"
                                           "01010200"
                                           "01",
                                           "40001 < 1234"
                                           "8010"
                                           "00000009"
                                           "00000002"
                                           "01010200"
                                           "02"));
}

TEST_F(DeviceFields, KeepsALargeValueUntilItIsSent) {
  const auto first = pattern(8000);
  auto second = first;
  second.back() = std::byte{0xff};
  ASSERT_TRUE(device().set_field(0, 2, first));
  EXPECT_EQ(device().set_field(0, 2, second).error(), Error::busy);
  rig.poll();
  ASSERT_THAT(rig.sent, SizeIs(4));                         // a burst, and two segments are left
  rig.receive("1234 0031 00000008 0102 0003 01 01 00 00");  // a setter meanwhile: E_NOT_READY
  ASSERT_THAT(rig.sent, SizeIs(5));
  EXPECT_EQ(to_hex(rig.sent[4].bytes), "12340031000000080102000301018004");
  EXPECT_EQ(device().set_field(0, 2, second).error(), Error::busy);
  rig.run_for(2ms);
  EXPECT_THAT(rig.sent, SizeIs(7));
  EXPECT_TRUE(device().set_field(0, 2, second));
  EXPECT_TRUE(std::ranges::equal(*device().field(0, 2), second));
  EXPECT_THAT(rig.happenings, IsEmpty());  // no SendFinished: the memory is not the application's
}

TEST_F(DeviceFields, SendsTheValuesAgainToWhoAsksForThem) {
  covers({"feat_req_someipsd_1188"});
  FakePeer asking{other_peer_at, sd::unicast_flag | sd::explicit_initial_data_flag};
  for (int i = 0; i < 2; ++i) {
    rig.receive(asking.unicast({test::subscribe(1, {udp(other_peer_udp)}, 100, 0, true)}), other_peer_at,
                own);
  }
  EXPECT_THAT(rig.take_sent(), ElementsAre("40002 < 1234"
                                           "8010"
                                           "0000000a"
                                           "00000001"
                                           "01010200"
                                           "002a",
                                           "40002 < 1234"
                                           "8010"
                                           "0000000a"
                                           "00000002"
                                           "01010200"
                                           "002a"));
}

// --- Limits -----------------------------------------------------------------------------------------------

TEST_F(DeviceFields, RefusesWhatTheQueueHasNoRoomForAndChangesNothing) {
  for (int i = 0; i < 8; ++i) {
    ASSERT_TRUE(device().notify(0, MethodId{0x8001}, hex("aa")));
  }
  EXPECT_EQ(device().notify(0, MethodId{0x8001}, hex("bb")).error(), Error::no_room);
  EXPECT_EQ(device().set_field(0, 0, hex("01")).error(), Error::no_room);
  EXPECT_EQ(value_of(0), "002a");
  rig.poll();
  ASSERT_THAT(rig.sent, SizeIs(8));
  EXPECT_EQ(rig.sent[7].bytes[11], std::byte{8});  // no Session ID is lost
  const auto half = pattern(300);
  ASSERT_TRUE(device().notify(0, MethodId{0x8001}, half));
  EXPECT_EQ(device().notify(0, MethodId{0x8001}, half).error(),
            Error::no_room);  // 512 bytes are copied at most
  ASSERT_TRUE(device().notify(0, MethodId{0x8001}, ByteView{half}.first(212)));
}

TEST_F(DeviceFields, KeepsWhatIsCopiedApart) {
  rig.sent.clear();
  ASSERT_TRUE(device().notify(0, MethodId{0x8001}, hex("a1a2a3")));
  ASSERT_TRUE(device().notify(0, MethodId{0x8001}, {}));
  ASSERT_TRUE(device().notify(0, MethodId{0x8001}, hex("b1")));
  std::array<std::byte, 1416> room{};
  ASSERT_TRUE(device().poll_transmit(room, rig.now));
  ASSERT_TRUE(device().poll_transmit(room, rig.now));  // the first is over, the others have moved
  ASSERT_TRUE(device().notify(0, MethodId{0x8001}, hex("c1c2")));
  rig.poll();
  EXPECT_THAT(rig.take_sent(), ElementsAre("40001 < 1234"
                                           "8001"
                                           "00000009"
                                           "00000003"
                                           "01010200"
                                           "b1",
                                           "40001 < 1234"
                                           "8001"
                                           "0000000a"
                                           "00000004"
                                           "01010200"
                                           "c1c2"));
}

TEST_F(DeviceFields, DoesNotCopyWhatIsLargerThanTheQueue) {
  const auto payload = pattern(513);
  ASSERT_EQ(device().max_copied_bytes(), 512U);
  ASSERT_TRUE(device().notify(0, MethodId{0x8001}, payload));
  const std::byte* finished = nullptr;
  rig.poll([&](const Happening& what) { finished = std::get<device::SendFinished>(what).payload; });
  ASSERT_THAT(rig.sent, SizeIs(1));  // it fits a datagram all the same
  EXPECT_EQ(rig.sent[0].bytes.size(), 16U + 513);
  EXPECT_EQ(finished, payload.data());
}

TEST_F(DeviceFields, CountsWhatDoesNotFitTheRoomItIsGiven) {
  ASSERT_TRUE(device().notify(0, MethodId{0x8001}, pattern(300)));
  std::array<std::byte, 315> room{};
  EXPECT_FALSE(device().poll_transmit(room, rig.now));
  EXPECT_EQ(device().counters().room_too_small, 1U);
  EXPECT_FALSE(device().deadline() && *device().deadline() <= rig.now);
}

TEST(DeviceLimits, AreKeptByName) {
  Tables tables;
  auto services = std::to_array({tables.services[0], tables.services[0], tables.services[0]});
  services[1].service = ServiceId{0x2222};
  services[2].service = ServiceId{0x3333};
  services[2].events = {};
  services[2].fields = {};
  device::Settings settings = device_settings();
  settings.services = services;
  Rig<device::Limits{.services = 2, .eventgroups = 3, .events = 10}> rig{settings};
  ASSERT_TRUE(rig.device().offer(0, rig.now));
  EXPECT_EQ(rig.device().offer(0, rig.now).error(), Error::duplicate);
  EXPECT_EQ(rig.device().offer(1, rig.now).error(), Error::table_full);  // four eventgroups
  EXPECT_EQ(rig.device().offer(2, rig.now).error(), Error::table_full);  // a third service
  EXPECT_EQ(rig.device().offer(3, rig.now).error(), Error::bad_argument);
  Rig<device::Limits{.events = 9}> few_events{settings};
  ASSERT_TRUE(few_events.device().offer(0, few_events.now));
  EXPECT_EQ(few_events.device().offer(1, few_events.now).error(), Error::table_full);
}

TEST(DeviceLimits, HaveOneInstanceOfAServiceAtAPort) {
  covers({"feat_req_someip_445", "feat_req_someip_967"});
  for (const std::size_t first : {0U, 1U}) {
    Tables tables;
    auto services = std::to_array({tables.services[0], tables.services[0]});
    services[1].instance = InstanceId{0x0002};
    device::Settings settings = device_settings();
    settings.services = services;
    Rig<device::Limits{.services = 2, .eventgroups = 8, .events = 20}> rig{settings};
    ASSERT_TRUE(rig.device().offer(first, rig.now));
    EXPECT_EQ(rig.device().offer(1 - first, rig.now).error(), Error::duplicate);
    rig.device().withdraw(first, rig.now);
    EXPECT_TRUE(rig.device().offer(1 - first, rig.now));
  }
}

TEST(DeviceLimits, RefuseASubscriberTooManyWithANack) {
  covers({"feat_req_someipsd_1137"});
  Tables tables;
  device::Settings settings = device_settings();
  settings.services = tables.services;
  Rig<device::Limits{.subscribers = 2}> rig{settings};
  ASSERT_TRUE(rig.device().offer(0, rig.now));
  rig.run_for(100ms);
  FakePeer peer{peer_at};
  rig.receive(peer.unicast({subscribe(1, {udp(peer_udp)})}), peer_at, own);
  FakePeer other{other_peer_at};
  rig.receive(other.unicast({subscribe(1, {udp(other_peer_udp)})}), other_peer_at, own);
  rig.discovery.clear();
  rig.receive(other.unicast({subscribe(2, {udp(other_peer_udp)})}), other_peer_at, own);
  EXPECT_THAT(rig.take_discovery(),
              ElementsAre("10.0.0.3:30490 < s2 reboot: nack 1234.5678 v1 group 0002 ttl 0 counter 0"));
  EXPECT_EQ(rig.device().discovery().nacks_by_reason[static_cast<std::size_t>(sd::NackReason::no_room)], 1U);
}

TEST(DeviceLimits, RefuseADescriptionThatCannotBe) {
  const auto refused = [](const auto& spoil) {
    Tables tables;
    spoil(tables.services[0], tables);
    device::Settings settings = device_settings();
    settings.services = tables.services;
    Rig<> rig{settings};
    const auto offered = rig.device().offer(0, rig.now);
    return !offered && offered.error() == Error::bad_argument;
  };
  EXPECT_FALSE(refused([](device::Service&, Tables&) {}));
  EXPECT_TRUE(refused([](device::Service& one, Tables&) { one.port = 0; }));
  EXPECT_TRUE(refused([](device::Service& one, Tables&) { one.port = 30490; }));
  EXPECT_TRUE(refused([](device::Service& one, Tables&) { one.service = ServiceId{0xffff}; }));
  EXPECT_TRUE(refused([](device::Service& one, Tables&) { one.instance = InstanceId{0}; }));
  EXPECT_TRUE(refused([](device::Service& one, Tables&) { one.eventgroups = one.eventgroups.first(1); }));
  EXPECT_TRUE(refused([](device::Service&, Tables& tables) { tables.fields[0].initial_bytes = 5; }));
  EXPECT_TRUE(refused([](device::Service&, Tables& tables) { tables.fields[0].notifier = MethodId{0x11}; }));
}

// 4 services, 8 eventgroups and 16 subscribers, beside one buffer of 8 KB. On a machine with 64 bits it is
// more, also for what only such machines remember of silent hosts; and where it is not built for size, for
// what it remembers of clients that did not answer, and where ids of services lie.
TEST(DeviceLimits, TakeAtMost8KbByDefault) {
  constexpr device::Limits limits;
  EXPECT_EQ(limits.services, 4);
  EXPECT_EQ(limits.eventgroups, 8);
  EXPECT_EQ(limits.subscribers, 16);
  EXPECT_LE(sizeof(device::StaticDevice<limits>),
            8192U + (sizeof(void*) == 4 ? 8368U : 9000U) + (optimised_for_many ? 2'192U : 0U));
}

TEST(DeviceLimits, MakeTheMemoryThatTheyNeed) {
  constexpr device::Limits limits{
      .needs = 1, .remote_services = 1, .calls = 3, .tp_buffers = 2, .tp_buffer_bytes = 100};
  constexpr std::size_t bytes = device::memory_bytes(limits);
  alignas(device::memory_alignment) std::array<std::byte, bytes + 1> memory{};
  const auto view = device::lay_out(limits, memory);
  ASSERT_TRUE(view);
  EXPECT_EQ(view->calls.size(), 3U);
  EXPECT_EQ(view->tp_bytes.data() + view->tp_bytes.size(), memory.data() + bytes);  // to the last byte
  EXPECT_FALSE(device::lay_out(limits, ByteSpan{memory}.first(bytes - 1)));
  EXPECT_FALSE(device::lay_out(limits, ByteSpan{memory}.subspan(1)));
  EXPECT_FALSE(device::lay_out({.sends = 1}, memory));
  EXPECT_FALSE(device::are_possible({.services = 9}));  // more Stop entries than may wait
  EXPECT_FALSE(device::are_possible({.calls = 1}));
}

}  // namespace
}  // namespace trestle::test::fields_test
