// What a device takes of a description, what it only tells of, and what it says of that it does not take.
#include <gmock/gmock.h>

#include "test/sd/device/fixture.hpp"

namespace trestle::test {
namespace {

using device::Argument;
using device::BadArgument;
using device::Error;
using testing::ElementsAre;
using testing::IsEmpty;

using Ids = std::vector<std::uint16_t>;

// Offers the service of the tables, and tells which of its ids the device speaks of.
Ids unusual_ids_of(Tables& tables) {
  device::Settings settings = device_settings();
  settings.services = tables.services;
  Rig<> rig{settings};
  EXPECT_TRUE(rig.device().offer(0, rig.now));
  Ids ids;
  rig.poll([&](const Happening& what) {
    const auto& unusual = std::get<device::UnusualId>(what);
    EXPECT_EQ(unusual.service, 0U);
    ids.push_back(someip::value(unusual.id));
  });
  return ids;
}

TEST(DeviceIds, OfEventsBelow0x8000AreTakenAndTold) {
  covers({"feat_req_someip_626"});
  Tables tables;
  EXPECT_THAT(unusual_ids_of(tables), IsEmpty());
  const std::array low{device::Event{.id = MethodId{0x8001}, .eventgroups = Tables::group_1},
                       device::Event{.id = MethodId{0x0100}, .eventgroups = Tables::group_1}};
  tables.services[0].events = low;
  tables.fields[1].notifier = MethodId{0x0120};
  EXPECT_THAT(unusual_ids_of(tables), ElementsAre(0x0100, 0x0120));
}

TEST(DeviceIds, OfMethodsFrom0x8000OnAreTakenAndTold) {
  covers({"feat_req_someip_626"});
  Tables tables;
  const std::array high{device::Method{.id = MethodId{0x8100}}};
  tables.services[0].methods = high;
  tables.fields[0].getter = MethodId{0x8110};
  tables.fields[0].setter = MethodId{0x8111};
  EXPECT_THAT(unusual_ids_of(tables), ElementsAre(0x8100, 0x8110, 0x8111));
}

TEST(DeviceIds, ThatAreReservedAreTakenAndTold) {
  covers({"feat_req_someipids_636"});
  Tables tables;
  const std::array event{device::Event{.id = MethodId{0x8000}, .eventgroups = Tables::group_1}};
  tables.services[0].events = event;
  tables.fields[2].getter = MethodId{0x7fff};
  EXPECT_THAT(unusual_ids_of(tables), ElementsAre(0x8000, 0x7fff));
}

TEST(DeviceIds, AreToldOncePerOffer) {
  Tables tables;
  tables.fields[1].notifier = MethodId{0x0120};
  device::Settings settings = device_settings();
  settings.services = tables.services;
  Rig<> rig{settings};
  ASSERT_TRUE(rig.device().offer(0, rig.now));
  rig.run_for(5s);
  EXPECT_THAT(rig.happenings, ElementsAre(place_of<device::UnusualId>()));
  rig.device().withdraw(0, rig.now);
  rig.run_for(1s);
  ASSERT_TRUE(rig.device().offer(0, rig.now));
  rig.run_for(5s);
  EXPECT_THAT(rig.happenings, ElementsAre(place_of<device::UnusualId>(), place_of<device::UnusualId>()));
}

TEST(DeviceIds, OfAnEventBelow0x8000ReachItsSubscriber) {
  covers({"feat_req_someip_626"});
  Tables tables;
  const std::array low{device::Event{.id = MethodId{0x0100}, .eventgroups = Tables::group_1}};
  tables.services[0].events = low;
  tables.services[0].fields = {};
  device::Settings settings = device_settings();
  settings.services = tables.services;
  Rig<> rig{settings};
  ASSERT_TRUE(rig.device().offer(0, rig.now));
  rig.run_for(100ms);
  FakePeer peer{peer_at};
  rig.receive(peer.unicast({subscribe(1, {udp(peer_udp)})}), peer_at, own);
  ASSERT_TRUE(rig.device().notify(0, MethodId{0x0100}, hex("2a")));
  rig.poll();
  EXPECT_THAT(rig.take_sent(), ElementsAre("40001 < 123401000000000900000001010102002a"));
}

// --- What is not taken, and which it is -------------------------------------------------------------------

template <typename Spoil>
BadArgument refused_offer(Spoil spoil) {
  Tables tables;
  spoil(tables.services[0], tables);
  device::Settings settings = device_settings();
  settings.services = tables.services;
  Rig<> rig{settings};
  const auto offered = rig.device().offer(0, rig.now);
  if (offered) {
    return {};
  }
  EXPECT_EQ(offered.error(), Error::bad_argument);
  return rig.device().bad_argument();
}

TEST(DeviceArguments, OfAServiceAreNamed) {
  using S = device::Service;
  using T = Tables;
  EXPECT_EQ(refused_offer([](S&, T&) {}), (BadArgument{}));
  EXPECT_EQ(refused_offer([](S& s, T&) { s.service = ServiceId{0}; }), (BadArgument{Argument::service_id}));
  EXPECT_EQ(refused_offer([](S& s, T&) { s.service = ServiceId{0xfffe}; }),
            (BadArgument{Argument::service_id}));
  EXPECT_EQ(refused_offer([](S& s, T&) { s.instance = InstanceId{0xffff}; }),
            (BadArgument{Argument::instance}));
  EXPECT_EQ(refused_offer([](S& s, T&) { s.major = 0xff; }), (BadArgument{Argument::major}));
  EXPECT_EQ(refused_offer([](S& s, T&) { s.port = 0; }), (BadArgument{Argument::port}));
  EXPECT_EQ(refused_offer([](S& s, T&) { s.port = own.port; }), (BadArgument{Argument::port}));
  EXPECT_EQ(refused_offer([](S& s, T&) { s.ttl_s = 0; }), (BadArgument{Argument::ttl_s}));
  EXPECT_EQ(refused_offer([](S& s, T&) { s.ttl_s = 0x1000000; }), (BadArgument{Argument::ttl_s}));
}

TEST(DeviceArguments, OfAServicesMembersAreNamedWithTheirPlace) {
  using S = device::Service;
  using T = Tables;
  const std::array by_tcp{sd::Eventgroup{.id = EventgroupId{1}},
                          sd::Eventgroup{.id = EventgroupId{2}, .tcp = true}};
  const std::array no_group{sd::Eventgroup{.id = EventgroupId{0}}};
  const std::array no_kind{device::Method{.id = MethodId{1}, .kind = someip::MethodKind::unknown}};
  const std::array no_event{device::Event{.id = MethodId{0x8001}}, device::Event{}};
  const std::array no_method{device::Method{}};
  EXPECT_EQ(refused_offer([&](S& s, T&) { s.eventgroups = by_tcp; }), (BadArgument{Argument::eventgroup, 1}));
  EXPECT_EQ(refused_offer([&](S& s, T&) { s.eventgroups = no_group; }),
            (BadArgument{Argument::eventgroup, 0}));
  EXPECT_EQ(refused_offer([&](S& s, T&) { s.methods = no_kind; }), (BadArgument{Argument::method, 0}));
  EXPECT_EQ(refused_offer([&](S& s, T&) { s.methods = no_method; }), (BadArgument{Argument::method, 0}));
  EXPECT_EQ(refused_offer([&](S& s, T&) { s.events = no_event; }), (BadArgument{Argument::listed_event, 1}));
  EXPECT_EQ(refused_offer([](S& s, T&) { s.eventgroups = s.eventgroups.first(1); }),
            (BadArgument{Argument::event_eventgroups, 1}));
  EXPECT_EQ(refused_offer([](S& s, T&) {
              s.eventgroups = s.eventgroups.first(1);
              s.events = {};
            }),
            (BadArgument{Argument::field_eventgroups, 1}));
  EXPECT_EQ(refused_offer([](S&, T& tables) { tables.fields[0].initial_bytes = 5; }),
            (BadArgument{Argument::field_initial_bytes, 0}));
}

TEST(DeviceArguments, NameAnIdThatIsThereTwice) {
  covers({"feat_req_someip_625"});
  using S = device::Service;
  using T = Tables;
  EXPECT_EQ(refused_offer([](S&, T& tables) { tables.fields[2].getter = MethodId{0x0001}; }),
            (BadArgument{Argument::field_getter, 2}));
  EXPECT_EQ(refused_offer([](S&, T& tables) { tables.fields[1].setter = tables.fields[1].getter; }),
            (BadArgument{Argument::field_setter, 1}));
  EXPECT_EQ(refused_offer([](S&, T& tables) { tables.fields[1].notifier = MethodId{0x8001}; }),
            (BadArgument{Argument::field_notifier, 1}));
  const std::array as_method{device::Event{.id = MethodId{0x0002}}};
  EXPECT_EQ(refused_offer([&](S& s, T&) { s.events = as_method; }), (BadArgument{Argument::listed_event, 0}));
  const std::array two{device::Method{.id = MethodId{7}}, device::Method{.id = MethodId{7}}};
  EXPECT_EQ(refused_offer([&](S& s, T&) { s.methods = two; }), (BadArgument{Argument::method, 1}));
}

TEST(DeviceArguments, OfItsOwnAddressAreNamed) {
  Tables tables;
  device::Settings settings = device_settings();
  settings.discovery.unicast.address = {};
  settings.services = tables.services;
  Rig<> rig{settings};
  EXPECT_EQ(rig.device().offer(0, rig.now).error(), Error::bad_argument);
  EXPECT_EQ(rig.device().bad_argument(), (BadArgument{Argument::discovery}));
}

TEST(DeviceArguments, OfCallsAreNamed) {
  Tables tables;
  device::Settings settings = device_settings();
  settings.services = tables.services;
  Rig<device::Limits{.needs = 1, .remote_services = 1, .calls = 1}> rig{settings};
  device::Device& device = rig.device();
  const auto argument_of = [&](const auto& result) {
    return !result && result.error() == Error::bad_argument ? device.bad_argument().argument : Argument::none;
  };
  ASSERT_TRUE(device.offer(0, rig.now));
  EXPECT_EQ(device.bad_argument(), (BadArgument{}));
  device::Request no_service{.service = 1};
  device::Request no_setter{.header = {.method = MethodId{0x0010}}};
  EXPECT_EQ(argument_of(device.offer(1, rig.now)), Argument::service);
  EXPECT_EQ(argument_of(device.notify(0, MethodId{0x8010}, {})), Argument::event);
  EXPECT_EQ(argument_of(device.notify(1, MethodId{0x8001}, {})), Argument::service);
  EXPECT_EQ(argument_of(device.set_field(0, 3, {})), Argument::field);
  EXPECT_EQ(argument_of(device.set_field(1, 0, {})), Argument::service);
  EXPECT_EQ(argument_of(device.respond(no_service, {})), Argument::service);
  EXPECT_EQ(argument_of(device.respond_error(no_service, someip::ReturnCode::not_ok)), Argument::service);
  EXPECT_EQ(argument_of(device.respond_error({}, someip::ReturnCode::ok)), Argument::return_code);
  EXPECT_EQ(argument_of(device.accept(no_service, {})), Argument::service);
  EXPECT_EQ(argument_of(device.accept(no_setter, {})), Argument::request);
  EXPECT_EQ(argument_of(device.require(0, rig.now)), Argument::need);
  EXPECT_EQ(argument_of(device.call(0, MethodId{1}, {}, 1s, rig.now)), Argument::need);
  EXPECT_EQ(argument_of(device.tell(0, MethodId{1}, {})), Argument::need);
}

TEST(DeviceArguments, OfANeedAreNamed) {
  const auto refused = [](const auto& spoil) {
    std::array subscriptions{device::Subscription{.eventgroup = EventgroupId{1}},
                             device::Subscription{.eventgroup = EventgroupId{2}}};
    std::array needs{device::Need{.service = ServiceId{0x1234},
                                  .instance = InstanceId{1},
                                  .port = 40000,
                                  .subscriptions = subscriptions}};
    spoil(needs[0], subscriptions);
    device::Settings settings = device_settings();
    settings.needs = needs;
    Rig<device::Limits{.needs = 1, .subscriptions = 2, .remote_services = 1}> rig{settings};
    const auto required = rig.device().require(0, rig.now);
    return required ? BadArgument{} : rig.device().bad_argument();
  };
  using N = device::Need;
  using Two = std::array<device::Subscription, 2>;
  EXPECT_EQ(refused([](N&, Two&) {}), (BadArgument{}));
  EXPECT_EQ(refused([](N& n, Two&) { n.service = ServiceId{0xffff}; }), (BadArgument{Argument::service_id}));
  EXPECT_EQ(refused([](N& n, Two&) { n.instance = InstanceId{0}; }), (BadArgument{Argument::instance}));
  EXPECT_EQ(refused([](N& n, Two&) { n.instance = someip::any_instance; }),
            (BadArgument{Argument::instance}));
  EXPECT_EQ(refused([](N& n, Two&) { n.port = own.port; }), (BadArgument{Argument::port}));
  EXPECT_EQ(refused([](N&, Two& s) { s[1].ttl_s = 0; }), (BadArgument{Argument::ttl_s, 1}));
  EXPECT_EQ(refused([](N&, Two& s) { s[1].eventgroup = EventgroupId{0}; }),
            (BadArgument{Argument::subscription, 1}));
  EXPECT_EQ(refused([](N&, Two& s) { s[0].silence_timeout = 0ms; }),
            (BadArgument{Argument::subscription, 0}));
}

TEST(DeviceArguments, HaveNames) {
  EXPECT_STREQ(to_string(Argument::none), "none");
  EXPECT_STREQ(to_string(Argument::service), "service");
  EXPECT_STREQ(to_string(Argument::listed_event), "listed_event");
  EXPECT_STREQ(to_string(Argument::field_initial_bytes), "field_initial_bytes");
}

}  // namespace
}  // namespace trestle::test
