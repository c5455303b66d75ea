// What methods and the parts of fields and actions have of what routes have: `e2e`, `multicast`, `subscribe`.
#include <gmock/gmock.h>

#include "bridge/carry/commands/summary.hpp"
#include "test/bridge/carry/config/problems_of.hpp"

namespace trestle::test::parts_test {
namespace {

using namespace carry;
namespace e2e = someip::e2e;
using someip::MethodId;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

std::string method(const std::string& keys) {
  return "someip: {address: 127.0.0.1}\nmethods:\n"
         "  - {ros_service: /s, type: std_srvs/srv/Trigger, service: 1, instance: 2, method: 3,\n"
         "     " +
         keys + "}\n";
}

std::string field(const std::string& keys) {
  return "someip: {address: 127.0.0.1}\nfields:\n"
         "  - {topic: /f, type: std_msgs/msg/Int32, service: 1, instance: 2,\n"
         "     " +
         keys + "}\n";
}
const std::string all_parts = ", event: 0x8004, eventgroup: 3, getter: 4, setter: 5";

std::string action(const std::string& keys) {
  return "someip: {address: 127.0.0.1}\nactions:\n"
         "  - {action: /a, type: test_msgs/action/Fibonacci, service: 1, instance: 2, eventgroup: 3,\n"
         "     methods: {send_goal: 1, cancel_goal: 2, get_result: 3}, events: {feedback: 0x8011, status: "
         "0x8012},\n     " +
         keys + "}\n";
}

TEST(MethodE2e, HasTheProfilesOfEventsAndOfMethods) {
  const auto settings = [](const std::string& keys) {
    return config_of(method("server: someip, e2e: {" + keys + "}")).methods.at(0).e2e.value();
  };
  const E2eSettings usual = settings("profile: 4m, data_id: 0x2d");
  EXPECT_EQ(usual.profile, (e2e::Config{e2e::Profile4m{{.data_id = 0x2d}}}));
  EXPECT_EQ(usual.source_id, 0U);
  EXPECT_FALSE(usual.pass_failed);
  const E2eSettings all = settings(
      "profile: 7m, data_id: 1, offset_bits: 72, max_delta_counter: 3, source_id: 0x0fffffff, failed: pass, "
      "state_machine: {min_ok_init: 2, window_size_init: 3}");
  EXPECT_EQ(all.profile,
            (e2e::Config{e2e::Profile7m{{.data_id = 1, .offset_bits = 72, .max_delta_counter = 3}}}));
  EXPECT_EQ(all.source_id, 0x0fff'ffffU);
  EXPECT_TRUE(all.pass_failed);
  EXPECT_EQ(all.state_machine.min_ok_init, 2);
  EXPECT_EQ(settings("profile: 44m, data_id: 1").profile, (e2e::Config{e2e::Profile44m{{.data_id = 1}}}));
  EXPECT_EQ(settings("profile: 5, data_id: 1, data_bits: 96").profile,
            (e2e::Config{e2e::Profile5{.data_id = 1, .data_bits = 96}}));
}

TEST(MethodE2e, NamesWhatCannotBe) {
  EXPECT_THAT(problems_of(method("server: someip, e2e: {profile: 9}")),
              ElementsAre("b.yaml:4:37: error: profile: expected one of 1, 2, 4, 5, 6, 7, 8, 11, 22, 44, 4m, "
                          "7m, 8m, 44m, found '9'"));
  EXPECT_THAT(problems_of(method("server: someip, e2e: {profile: 4, data_id: 1, source_id: 7}")),
              ElementsAre(HasSubstr("b.yaml:4:52: error: unknown key 'source_id' in e2e")));
  EXPECT_THAT(problems_of(method("server: someip, e2e: {profile: 4m, data_id: 1, source_id: 0x10000000}")),
              ElementsAre(HasSubstr("error: source_id: expected an id from 0x0000 to 0xfffffff")));
  EXPECT_THAT(problems_of(method("server: ros, port: 40001, e2e: {profile: 4m, data_id: 1, source_id: 7}")),
              ElementsAre(HasSubstr("error: source_id: identifies the caller, with server: someip")));
}

TEST(MethodE2e, MayBeAnotherInEachInstance) {
  const BridgeConfig config = config_of(
      method("server: someip, e2e: {profile: 4m, data_id: 1}}\n"
             "  - {ros_service: /t, type: std_srvs/srv/Trigger, service: 1, instance: 9, method: 3, "
             "server: someip, e2e: {profile: 4m, data_id: 2}"));
  ASSERT_THAT(config.methods, SizeIs(2));
  EXPECT_EQ(config.methods[0].e2e->profile, (e2e::Config{e2e::Profile4m{{.data_id = 1}}}));
  EXPECT_EQ(config.methods[1].e2e->profile, (e2e::Config{e2e::Profile4m{{.data_id = 2}}}));
}

TEST(MethodE2e, IsShownByCheck) {
  const std::string text =
      summary(config_of(method("server: someip, e2e: {profile: 4m, data_id: 0x2d, source_id: 7}")), {});
  EXPECT_THAT(text, HasSubstr("  E2E   profile 4m, data id 0x2d, header at bit 64 from the Request ID on, "
                              "source id 0x7; protected and checked, what fails is dropped\n"
                              "          for /s\n"));
  EXPECT_THAT(text, HasSubstr("checks are published on /diagnostics, every 1 s"));
  EXPECT_THAT(summary(config_of(method("server: someip, fire_and_forget: true, e2e: {profile: 4m, data_id: "
                                       "0x2d}")),
                      {}),
              HasSubstr("from the Request ID on; protected\n"));
  EXPECT_THAT(
      problems_of(method("server: someip, e2e: {profile: 4m, data_id: 1}") +
                  "routes: [{topic: /diagnostics, type: std_msgs/msg/String, direction: dds_to_someip, "
                  "service: 7, instance: 1, eventgroup: 1, event: 0x8001, port: 40007}]\n"),
      ElementsAre(HasSubstr("type: /diagnostics is where the diagnostics of this bridge are published")));
}

TEST(FieldE2e, IsThatOfEachPart) {
  const std::string parts =
      ", e2e: {event: {profile: 4, data_id: 1}, getter: {profile: 4m, data_id: 2}, setter: {profile: 7m, "
      "data_id: 3}}";
  const BridgeConfig ros = config_of(field("server: ros, port: 40001" + all_parts + parts));
  EXPECT_EQ(ros.routes.at(0).e2e->profile, (e2e::Config{e2e::Profile4{.data_id = 1}}));
  EXPECT_EQ(ros.routes[0].getter->id, MethodId{4});
  EXPECT_EQ(ros.routes[0].getter->e2e->profile, (e2e::Config{e2e::Profile4m{{.data_id = 2}}}));
  ASSERT_THAT(ros.methods, SizeIs(1));
  EXPECT_EQ(ros.methods[0].e2e->profile, (e2e::Config{e2e::Profile7m{{.data_id = 3}}}));
  EXPECT_EQ(ros.methods[0].getter, std::nullopt);
  EXPECT_THAT(summary(ros, {}), HasSubstr("protected and checked, what fails is dropped\n"
                                          "          for the getter of /f\n"));
  const BridgeConfig someip = config_of(field("server: someip" + all_parts + parts));
  EXPECT_EQ(someip.routes.at(0).e2e->profile, (e2e::Config{e2e::Profile4{.data_id = 1}}));
  EXPECT_EQ(someip.routes[0].getter, std::nullopt);
  ASSERT_THAT(someip.methods, SizeIs(2));
  EXPECT_EQ(someip.methods[0].e2e->profile, (e2e::Config{e2e::Profile4m{{.data_id = 2}}}));
  EXPECT_EQ(someip.methods[1].e2e->profile, (e2e::Config{e2e::Profile7m{{.data_id = 3}}}));
  // Whom the setter asks when a value was refused.
  EXPECT_EQ(someip.methods[0].getter, std::nullopt);
  EXPECT_EQ(someip.methods[1].getter, (FieldGetter{MethodId{4}, someip.methods[0].e2e}));
}

TEST(FieldE2e, NamesWhatCannotBe) {
  EXPECT_THAT(problems_of(field("server: someip, setter: 5, e2e: {getter: {profile: 4m, data_id: 2}}")),
              ElementsAre("b.yaml:4:38: error: e2e: has settings of the `getter`, which is missing"));
  EXPECT_THAT(problems_of(field("server: someip, setter: 5, e2e: {profile: 4m}")),
              ElementsAre(HasSubstr("b.yaml:4:39: error: unknown key 'profile' in e2e")));
  EXPECT_THAT(problems_of(field("server: ros, port: 40001" + all_parts +
                                ", e2e: {event: {profile: 4, data_id: 1, failed: drop}}")),
              ElementsAre(HasSubstr("error: failed: is for routes with direction: someip_to_dds")));
  EXPECT_THAT(problems_of(field("server: someip" + all_parts + ", e2e: {event: {profile: 4m, data_id: 1}}")),
              ElementsAre(HasSubstr("profile: expected one of 1, 2, 4, 5, 6, 7, 8, 11, 22, 44, found '4m'")));
}

TEST(FieldMulticast, IsThatOfItsEventgroup) {
  const std::string group = ", multicast: {address: 239.1.2.3, port: 40100, threshold: 3}";
  const auto config = config_of(field("server: ros, port: 40001" + all_parts + group));
  EXPECT_EQ(config.routes.at(0).multicast,
            (MulticastSettings{{.address = IpAddress::v4(239, 1, 2, 3), .port = 40100}, 3}));
  EXPECT_THAT(problems_of(field("server: someip" + all_parts + group)),
              ElementsAre(HasSubstr("multicast: the server names the group")));
  EXPECT_THAT(problems_of(field("server: ros, port: 40001, transport: tcp" + all_parts + group)),
              ElementsAre(HasSubstr("multicast: needs transport: udp")));
  EXPECT_THAT(problems_of(field("server: ros, port: 40001, setter: 5" + group)),
              ElementsAre(HasSubstr("multicast: belongs to the `event`, which is missing")));
  EXPECT_THAT(problems_of(field("server: no" + all_parts + group)),
              ElementsAre(HasSubstr("server: expected one of someip, ros")));
}

TEST(FieldSubscription, IsThereWhileTheTopicIsRead) {
  EXPECT_FALSE(config_of(field("server: someip" + all_parts)).routes.at(0).presence.subscribe_while_read);
  const auto config = config_of(field("server: someip, subscribe: while_read" + all_parts));
  EXPECT_TRUE(config.routes.at(0).presence.subscribe_while_read);
  EXPECT_TRUE(config.routes[0].presence.write_while_offered);
  EXPECT_THAT(problems_of(field("server: ros, port: 40001, subscribe: while_read" + all_parts)),
              ElementsAre(HasSubstr("subscribe: is for fields with server: someip")));
  EXPECT_THAT(problems_of(field("server: someip, subscribe: while_read, setter: 5")),
              ElementsAre(HasSubstr("subscribe: belongs to the `event`, which is missing")));
}

TEST(ActionParts, HaveWhatRoutesAndMethodsHave) {
  const auto ros = config_of(action(
      "server: ros, port: 40001, offer: always, multicast: {address: 239.1.2.3, port: 40100},\n"
      "     e2e: {send_goal: {profile: 4m, data_id: 1}, cancel_goal: {profile: 4m, data_id: 2}, get_result: "
      "{profile: 4m, data_id: 3}, feedback: {profile: 4, data_id: 4}, status: {profile: 44, data_id: 5}}"));
  ASSERT_THAT(ros.methods, SizeIs(3));
  for (std::uint32_t i = 0; i < 3; ++i) {
    EXPECT_EQ(ros.methods[i].e2e->profile, (e2e::Config{e2e::Profile4m{{.data_id = i + 1}}}));
    EXPECT_TRUE(ros.methods[i].offer_always);
  }
  ASSERT_THAT(ros.routes, SizeIs(2));
  EXPECT_EQ(ros.routes[0].e2e->profile, (e2e::Config{e2e::Profile4{.data_id = 4}}));
  EXPECT_EQ(ros.routes[1].e2e->profile, (e2e::Config{e2e::Profile44{{.data_id = 5}}}));
  for (const Route& route : ros.routes) {
    EXPECT_EQ(route.multicast->group.port, 40100);
    EXPECT_FALSE(route.presence.offer_while_published);
  }
  const auto someip = config_of(action("server: someip, subscribe: while_read"));
  for (const Route& route : someip.routes) {
    EXPECT_TRUE(route.presence.subscribe_while_read);
  }
}

TEST(ActionParts, NameWhatCannotBe) {
  EXPECT_THAT(problems_of(action("server: someip, offer: always")),
              ElementsAre(HasSubstr("offer: is for actions with server: ros")));
  EXPECT_THAT(problems_of(action("server: ros, port: 40001, subscribe: while_read")),
              ElementsAre(HasSubstr("subscribe: is for actions with server: someip")));
  EXPECT_THAT(problems_of(action("server: someip, multicast: {address: 239.1.2.3, port: 40100}")),
              ElementsAre(HasSubstr("multicast: the server names the group")));
  EXPECT_THAT(problems_of(action("server: someip, e2e: {send_gaol: {profile: 4m, data_id: 1}}")),
              ElementsAre(HasSubstr("unknown key 'send_gaol' in e2e; did you mean 'send_goal'?")));
}

std::string route(const std::string& keys) {
  return "someip: {address: 127.0.0.1}\nroutes:\n"
         "  - {topic: /r, type: std_msgs/msg/Int32, service: 1, instance: 2, eventgroup: 3, event: 0x8004,\n"
         "     " +
         keys + "}\n";
}
std::string pattern(const std::string& keys) {
  return "someip: {address: 127.0.0.1}\nlock_file: /tmp/none.lock\npatterns:\n  - {topics: /**,\n     " +
         keys + "}\n";
}
const std::string two_bridges = ", port: 40001, from_bridges: [10.0.0.1, 10.0.0.5]";
const std::vector both{IpAddress::v4(10, 0, 0, 1), IpAddress::v4(10, 0, 0, 5)};

TEST(FromBridges, AreOfWhatIsOfferedInSomeip) {
  const BridgeConfig of_route = config_of(route("direction: dds_to_someip" + two_bridges));
  EXPECT_EQ(of_route.routes.at(0).from_bridges, both);
  EXPECT_THAT(summary(of_route, {}), HasSubstr("also from the bridges 10.0.0.1 10.0.0.5"));
  EXPECT_EQ(config_of(pattern("direction: dds_to_someip, services: 0x6000-0x6fff" + two_bridges))
                .patterns.at(0)
                .route.from_bridges,
            both);
  EXPECT_EQ(config_of(method("server: ros" + two_bridges)).methods.at(0).from_bridges, both);
  const BridgeConfig of_field = config_of(field("server: ros" + two_bridges + all_parts));
  EXPECT_EQ(of_field.routes.at(0).from_bridges, both);
  EXPECT_EQ(of_field.methods.at(0).from_bridges, both);
  const BridgeConfig of_action = config_of(action("server: ros" + two_bridges));
  EXPECT_EQ(of_action.routes.at(1).from_bridges, both);
  EXPECT_EQ(of_action.methods.at(2).from_bridges, both);
}

TEST(FromBridges, AreNotOfWhatIsTakenFromSomeip) {
  const std::string key = ", from_bridges: [10.0.0.1]";
  EXPECT_THAT(problems_of(route("direction: someip_to_dds" + key)),
              ElementsAre(HasSubstr("error: from_bridges: is for routes with direction: dds_to_someip")));
  EXPECT_THAT(problems_of(pattern("direction: someip_to_dds" + key)),
              ElementsAre(HasSubstr("error: from_bridges: is for patterns with direction: dds_to_someip")));
  EXPECT_THAT(problems_of(method("server: someip" + key)),
              ElementsAre(HasSubstr("error: from_bridges: is for methods with server: ros")));
  EXPECT_THAT(problems_of(field("server: someip" + key + all_parts)),
              ElementsAre(HasSubstr("error: from_bridges: is for fields with server: ros")));
  EXPECT_THAT(problems_of(action("server: someip" + key)),
              ElementsAre(HasSubstr("error: from_bridges: is for actions with server: ros")));
  EXPECT_THAT(problems_of(route("direction: dds_to_someip, port: 1, from_bridges: [all]")),
              ElementsAre(HasSubstr("error: from_bridges: expected an")));
  EXPECT_THAT(
      problems_of(route("direction: dds_to_someip, port: 1, from_bridges: [1.0.0.1, 1.0.0.2, 1.0.0.3, "
                        "1.0.0.4, 1.0.0.5, 1.0.0.6, 1.0.0.7, 1.0.0.8, 1.0.0.9]")),
      ElementsAre(HasSubstr("error: from_bridges: has room for 8 addresses")));
}

}  // namespace
}  // namespace trestle::test::parts_test
