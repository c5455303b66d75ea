#include "bridge/conform/profile.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridge/documents/document.hpp"
#include "test/source_dir.hpp"

namespace trestle::conform::profile_test {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;

constexpr const char* small = R"(name: Device
network: {device: 192.0.2.1, tester: 192.0.2.2}
services:
  - id: 0x1234
    instance: 1
    udp: 30501
)";

std::vector<std::string> errors_of(const std::string& text) {
  std::vector<std::string> lines;
  if (const auto profile = read_profile(text, "p.yaml"); !profile) {
    for (const documents::Problem& problem : profile.error()) {
      lines.push_back(documents::to_string(problem));
    }
  }
  return lines;
}

TEST(Profile, NeedsLittle) {
  const auto profile = read_profile(small, "p.yaml");
  ASSERT_TRUE(profile) << testing::PrintToString(errors_of(small));
  EXPECT_EQ(profile->service().service, someip::ServiceId{0x1234});
  EXPECT_EQ(profile->service().udp_port, 30501);
  EXPECT_FALSE(profile->service().tcp_port);
  EXPECT_EQ(profile->multicast, IpAddress::v4(224, 244, 224, 245));
  EXPECT_EQ(profile->sd_port, 30490);
  EXPECT_FALSE(profile->can_restart());
  EXPECT_FALSE(profile->ets);
}

TEST(Profile, OfTheReferenceDeviceIsGood) {
  const auto text = documents::read_text_file(test::source_dir() + "/examples/ets_device/profile.yaml");
  ASSERT_TRUE(text);
  const auto profile = read_profile(*text, "profile.yaml");
  ASSERT_TRUE(profile) << testing::PrintToString(errors_of(*text));
  EXPECT_TRUE(profile->ets);
  EXPECT_TRUE(profile->can_restart());
  EXPECT_EQ(profile->services.size(), 5U);
  EXPECT_EQ(profile->timing.cyclic_offer_delay, 500ms);
  EXPECT_THAT(profile->service().request->payload, ElementsAre(std::byte{0x2a}));
}

TEST(Profile, TellsWhereAMistakeIs) {
  EXPECT_THAT(errors_of(std::string{small} + "capabilites: 1\n"),
              ElementsAre(testing::AllOf(testing::StartsWith("p.yaml:7:1: error: "),
                                         testing::HasSubstr("capabilites"))));
  EXPECT_THAT(errors_of("name: D\nnetwork: {device: 192.0.2.1, tester: 192.0.2.x}\nservices:\n  - {id: 1, "
                        "instance: 1, udp: 1}\n"),
              ElementsAre(testing::StartsWith("p.yaml:2:38: error: ")));
  EXPECT_THAT(errors_of("name: D\nnetwork: {device: 192.0.2.1, tester: 192.0.2.1}\nservices:\n  - {id: 1, "
                        "instance: 1, udp: 1}\n"),
              ElementsAre(testing::HasSubstr("two addresses")));
  EXPECT_THAT(
      errors_of(
          "name: D\nnetwork: {device: 192.0.2.1, tester: 192.0.2.2}\nservices:\n  - {id: 1, instance: 1}\n"),
      ElementsAre(testing::AllOf(testing::StartsWith("p.yaml:4:5"), testing::HasSubstr("port"))));
  EXPECT_THAT(errors_of("name: D\nnetwork: {device: 192.0.2.1, tester: 192.0.2.2}\nservices:\n  - {id: 1, "
                        "instance: 1, udp: 1}\n  - {id: 1, instance: 1, major: 2, udp: 1}\n  - {id: 1, "
                        "instance: 1, major: 1, udp: 2}\n"),
              ElementsAre(testing::AllOf(testing::StartsWith("p.yaml:6:5: error: "),
                                         testing::HasSubstr("than those of a service above"))));
  EXPECT_THAT(errors_of("name: D\nnetwork: {device: 192.0.2.1, tester: \"fd00::2\"}\nservices:\n  - {id: 1, "
                        "instance: 1, udp: 1}\n"),
              ElementsAre(testing::HasSubstr("all of IPv4, or all of IPv6")));
  EXPECT_THAT(
      errors_of("name: D\nnetwork: {device: \"fd00::1\", tester: \"fd00::2\", multicast: \"ff15::1\"}\n"
                "services:\n  - {id: 1, instance: 1, udp: 1}\n"),
      testing::IsEmpty());
  EXPECT_THAT(errors_of("name: D\nnetwork: {device: 192.0.2.1, tester: 192.0.2.2}\nservices:\n  - {id: 1, "
                        "instance: 1, udp: 1, eventgroups: [{id: 1, initial_values: true}]}\n"),
              ElementsAre(testing::HasSubstr("'events' that have initial values")));
  // Each key once, also those of sections that this profile does not have.
  EXPECT_THAT(
      errors_of(std::string{small} + "speed_of_light: 1\n"),
      ElementsAre(testing::HasSubstr(
          "known here: name, version, network, services, uses, ets, tp, timing, policy, lifecycle, faults")));
  EXPECT_THAT(
      errors_of("name: D\nnetwork: {device: 192.0.2.1, tester: 192.0.2.2}\n"),
      ElementsAre(testing::HasSubstr("expected 'services' that the device offers, or one that it uses")));
  EXPECT_FALSE(errors_of("").empty());
  EXPECT_FALSE(errors_of("name: [").empty());
}

TEST(Profile, SaysWhatComesInSegmentsAndOverTcp) {
  const auto profile = read_profile(std::string{small} + R"(    eventgroups:
      - {id: 1, events: [0x8001, 0x8002], cycle: 100 ms}
      - {id: 2, events: [0x8003, 0x8004], trigger: 5}
      - {id: 3, events: [0x8005], tcp: true, cycle: 1 s}
    large: {request: 2, response: {method: 3, payload: "01 02"}, event: 0x8004}
)",
                                    "p.yaml");
  ASSERT_TRUE(profile);
  EXPECT_FALSE(large_request(*profile)->is_echo);
  EXPECT_EQ(large_request(*profile)->method, someip::MethodId{2});
  EXPECT_EQ(profile->service().large.response->payload.size(), 2U);
  EXPECT_EQ(large_event(*profile)->group, someip::EventgroupId{2});
  EXPECT_EQ(large_event(*profile)->trigger, someip::MethodId{5});
  EXPECT_EQ(event_source(*profile)->event, someip::MethodId{0x8001});
  EXPECT_EQ(tcp_event_source(*profile)->event, someip::MethodId{0x8005});
  EXPECT_EQ(tcp_event_source(*profile)->cycle, 1s);
}

TEST(Profile, WantsALargeEventThatCanBeWaitedFor) {
  for (const char* group : {"{id: 1, events: [0x8001, 0x8002], cycle: 100 ms}", "{id: 1, events: [0x8002]}",
                            "{id: 1, events: [0x8002], tcp: true, cycle: 1 s}"}) {
    EXPECT_THAT(
        errors_of(std::string{small} + "    eventgroups: [" + group + "]\n    large: {event: 0x8002}\n"),
        ElementsAre(testing::AllOf(testing::StartsWith("p.yaml:8:"),
                                   testing::HasSubstr("an event that can be waited for"))))
        << group;
  }
}

TEST(Profile, SaysHowMethodsAndEventsAreProtected) {
  const std::string groups = "    eventgroups: [{id: 1, events: [0x8001, 0x8002], cycle: 100 ms}]\n";
  const auto profile = read_profile(std::string{small} + groups + R"(    e2e:
      - {method: 2, profile: "4m", data_id: 7, source: 5}
      - {event: 0x8001, profile: "11", data_id: 0x123, nibble: true}
)",
                                    "p.yaml");
  ASSERT_TRUE(profile);
  ASSERT_EQ(profile->service().e2e.size(), 2U);
  EXPECT_FALSE(is_of_event(profile->service().e2e[0]));
  EXPECT_TRUE(is_of_event(profile->service().e2e[1]));
  EXPECT_EQ(profile->service().e2e[1].id, someip::MethodId{0x8001});
  for (const auto& [line, problem] : std::vector<std::pair<const char*, const char*>>{
           {"{profile: \"1\"}", "a 'method' or an 'event'"},
           {"{method: 2, event: 0x8001, profile: \"1\"}", "a 'method' or an 'event'"},
           {"{event: 0x7001, profile: \"1\"}", "0x8000"},
           {"{event: 0x8001, profile: \"7m\"}", "this one is for methods"},
           {"{event: 0x8002, profile: \"1\"}", "an event that can be waited for"}}) {
    EXPECT_THAT(errors_of(small + groups + "    e2e: [" + line + "]\n"),
                ElementsAre(testing::AllOf(testing::StartsWith("p.yaml:8:"), testing::HasSubstr(problem))))
        << line;
  }
}

TEST(Profile, FillsInCommands) {
  const auto profile = read_profile(small, "p.yaml");
  ASSERT_TRUE(profile);
  EXPECT_EQ(filled_in("{programs}/x {device} {tester} {multicast}:{sd_port} {fault} {other}", *profile,
                      "/bin", "none"),
            "/bin/x 192.0.2.1 192.0.2.2 224.244.224.245:30490 none {other}");
}

}  // namespace
}  // namespace trestle::conform::profile_test
