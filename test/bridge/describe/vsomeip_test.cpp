#include <fmt/format.h>
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "bridge/describe/join.hpp"
#include "bridge/describe/lower.hpp"
#include "bridge/describe/model_json.hpp"
#include "bridge/describe/read/vsomeip/json_tree.hpp"
#include "bridge/describe/read/vsomeip/read_vsomeip.hpp"
#include "bridge/describe/write/vsomeip/write_vsomeip.hpp"
#include "test/bridge/describe/lost.hpp"

namespace trestle::describe {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

Reading read_one(std::string text) {
  const SourceText source{"config/car.json", std::move(text)};
  return read_vsomeip({&source, 1});
}

std::vector<std::string> told(const Reading& reading) {
  std::vector<std::string> lines;
  for (const documents::Problem& problem : reading.problems) {
    lines.push_back(to_string(problem));
  }
  return lines;
}

constexpr const char* newer = R"({
  "unicast": "192.168.0.1",
  "services": [
    {
      "service": "0x1234", "instance": "22",
      "reliable": {"port": "30506", "enable-magic-cookies": "false"},
      "unreliable": 30501,
      "events": [
        {"event": "0x8001", "is_field": "true", "is_reliable": "false"},
        {"event": 32770, "is_field": false, "is_reliable": true, "cycle": "200"}
      ],
      "eventgroups": [
        {"eventgroup": "0x5", "events": ["0x8001", "0x8002"],
         "multicast": {"address": "224.225.226.233", "port": "32344"}, "threshold": "4"}
      ],
      "someip-tp": {
        "client-to-service": ["0x1", {"method": "0x2", "max-segment-length": "160", "separation-time": "300"}],
        "service-to-client": ["0x8001"]
      },
      "debounce-times": {"responses": {"0x8002": {"debounce-time": "10", "maximum-retention-time": "100"}}}
    }
  ],
  "service-discovery": {"enable": "true", "multicast": "224.244.224.245", "port": "30490",
    "initial_delay_min": "10", "initial_delay_max": "100", "repetitions_base_delay": "200",
    "repetitions_max": "3", "ttl": "0x10", "cyclic_offer_delay": "2000", "request_response_delay": "1500"},
  "e2e": {"e2e_enabled": "true", "protected": [
    {"service_id": "0x1234", "event_id": "0x8001", "profile": "P04", "variant": "protector",
     "crc_offset": "64", "data_id": "0x2d"}]},
  "routing": {"host": {"name": "routingmanagerd"}}
})";

TEST(ReadVsomeip, ReadsServicesAndTheirEndpoints) {
  const Reading reading = read_one(newer);
  ASSERT_THAT(told(reading), IsEmpty());
  ASSERT_THAT(reading.model.services, SizeIs(1));
  const Service& service = reading.model.services[0];
  EXPECT_EQ(service.name, "service_1234");
  EXPECT_EQ(service.id, someip::ServiceId{0x1234});
  ASSERT_THAT(service.fields, SizeIs(1));
  EXPECT_EQ(service.fields[0].notifier, someip::MethodId{0x8001});
  EXPECT_EQ(service.fields[0].notifier_transfer.segment_bytes, 1392);
  EXPECT_EQ(service.fields[0].e2e.profile, "4");
  EXPECT_EQ(service.fields[0].e2e.numbers.at("data_id"), 0x2d);
  ASSERT_THAT(service.events, SizeIs(1));
  EXPECT_EQ(service.events[0].transfer.transport, Transport::tcp);
  EXPECT_EQ(service.events[0].cycle, 200ms);
  EXPECT_EQ(service.events[0].transfer.retention, 100ms);
  EXPECT_THAT(service.events[0].eventgroups, ElementsAre(someip::EventgroupId{5}));
  ASSERT_THAT(service.methods, SizeIs(2));
  EXPECT_EQ(service.methods[1].request_transfer.segment_bytes, 160);
  EXPECT_EQ(service.methods[1].request_transfer.separation, 300us);

  ASSERT_THAT(reading.model.instances, SizeIs(1));
  const Instance& instance = reading.model.instances[0];
  EXPECT_EQ(instance.id, someip::InstanceId{22});
  EXPECT_EQ(instance.address, IpAddress::v4(192, 168, 0, 1));
  EXPECT_EQ(instance.udp_port, 30501);
  EXPECT_EQ(instance.tcp_port, 30506);
  EXPECT_THAT(instance.multicast,
              ElementsAre(Multicast{someip::EventgroupId{5}, {IpAddress::v4(224, 225, 226, 233), 32344}, 4}));
  ASSERT_TRUE(instance.timing);
  EXPECT_EQ(instance.timing->ttl_s, 16);
  EXPECT_EQ(instance.timing->request_response_delay_max, 1500ms);
  ASSERT_THAT(reading.model.machines, SizeIs(1));
  EXPECT_EQ(reading.model.machines[0].name, "car");
  EXPECT_EQ(reading.model.machines[0].sd_multicast, IpAddress::v4(224, 244, 224, 245));
}

TEST(ReadVsomeip, TellsOnceOfEachKeyThatItLeavesOut) {
  const Reading reading = read_one(R"({
    "servces": [{"service": 1}],
    "services": [
      {"service": "1", "instance": "1", "reliable": {"port": "30506", "enable-magic-cookies": "true"}, "evnts": []},
      {"service": "2", "instance": "1", "reliable": {"port": "30507", "enable-magic-cookies": "true"}, "evnts": []}],
    "clients": [{"service": "3", "instance": "1", "reliable": ["40000"], "unreliable": [40001]},
                {"service": "4", "instance": "1", "reliable": ["40002"]},
                {"reliable_client_ports": {"first": 1, "last": 2}}],
    "service-discovery": {"tttl": 3}})");
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(
      told(reading),
      ElementsAre(HasSubstr("config/car.json:2:5: warning: vsomeip knows no key 'servces' of a vsomeip "
                            "configuration: it is left out; did you mean 'services'?"),
                  AllOf(HasSubstr("config/car.json:4:"), HasSubstr("'enable-magic-cookies'")),
                  AllOf(HasSubstr("config/car.json:4:"), HasSubstr("'evnts'"), HasSubstr("'events'")),
                  AllOf(HasSubstr("config/car.json:6:"), HasSubstr("'reliable'"), HasSubstr("clients")),
                  AllOf(HasSubstr("config/car.json:6:"), HasSubstr("'unreliable'")),
                  AllOf(HasSubstr("config/car.json:8:"), HasSubstr("'reliable_client_ports'")),
                  AllOf(HasSubstr("config/car.json:9:"), HasSubstr("'tttl'"), HasSubstr("'ttl'"))));
}

TEST(ReadVsomeip, ReadsWhatOlderReleasesHad) {
  const Reading reading = read_one(R"({
    "unicast": "192.168.0.1",
    "servicegroups": [{"name": "default", "services": [
      {"service": "4660", "instance": "0x1", "reliable": ["30506"], "unreliable": "0",
       "multicast": {"address": "224.0.0.5", "port": "30502"},
       "events": [{"event": "0x8001", "update-cycle": "1000"}],
       "eventgroups": [{"eventgroup": "1", "is_multicast": "true", "events": [{"event": "0x8001"}]},
                       {"eventgroup": "2", "is_multicast": "false", "events": [{"event": "0x8002", "is_field": "true"}]},
                       {"eventgroup": "3", "multicast": "224.0.0.6", "events": "0x8003"}]}]}],
    "clients": [{"service": "0x7", "instance": "0x2", "unreliable": ["0x11", 34511]}],
    "routing": "routingmanagerd",
    "service-discovery": {"enable": "false"}
  })");
  ASSERT_THAT(told(reading), ElementsAre(HasSubstr("'unreliable': the ports of clients are left out")));
  ASSERT_THAT(reading.model.services, SizeIs(2));
  const Service& service = reading.model.services[0];
  ASSERT_THAT(service.events, SizeIs(2));
  EXPECT_EQ(service.events[0].cycle, 1s);
  EXPECT_EQ(service.events[0].transfer.transport, Transport::tcp);  // there is no UDP port
  EXPECT_THAT(service.fields, SizeIs(1));
  ASSERT_THAT(reading.model.instances, SizeIs(2));
  const Instance& instance = reading.model.instances[0];
  EXPECT_EQ(instance.tcp_port, 30506);
  EXPECT_EQ(instance.udp_port, std::nullopt);
  EXPECT_THAT(instance.multicast,
              ElementsAre(Multicast{someip::EventgroupId{1}, {IpAddress::v4(224, 0, 0, 5), 30502}, 1},
                          Multicast{someip::EventgroupId{3}, {IpAddress::v4(224, 0, 0, 6), 0}, 0}));
  EXPECT_EQ(instance.timing, std::nullopt);
  EXPECT_EQ(reading.model.instances[1].role, Instance::Role::required);
  EXPECT_EQ(reading.model.instances[1].service, "service_0007");
}

/// The times of service discovery stood in groups of services, in other words.
TEST(ReadVsomeip, ReadsTheDelaysOfGroups) {
  const auto timing_of = [](const std::string& discovery) {
    const Reading reading = read_one(R"({
      "servicegroups": [{"name": "default",
        "delays": {"initial": {"minimum": "15", "maximum": "150"}, "repetition-base": "250",
                   "repetition-max": "7", "cyclic-offer": "2132", "cyclic-request": "2001", "ttl": "5"},
        "services": [{"service": "0x1234", "instance": "0x22", "unreliable": "31000"}]}])" +
                                     discovery + "}");
    EXPECT_THAT(told(reading), IsEmpty());
    EXPECT_THAT(reading.model.instances, SizeIs(1));
    return reading.model.instances.at(0).timing;
  };
  const sd::Timing expected{.initial_delay_min = 15ms,
                            .initial_delay_max = 150ms,
                            .repetitions_base_delay = 250ms,
                            .repetitions_max = 7,
                            .cyclic_offer_delay = 2132ms,
                            .request_response_delay_min = 0ms,
                            .request_response_delay_max = 2001ms,
                            .ttl_s = 5};
  EXPECT_EQ(timing_of(""), expected);
  // What is said in both is as in the newer words.
  sd::Timing other = expected;
  other.cyclic_offer_delay = 500ms;
  EXPECT_EQ(timing_of(R"(, "service-discovery": {"cyclic_offer_delay": "500"})"), other);
  const Reading wrong = read_one(R"({"servicegroups": [{"delays": {"initial": {"maxi": "1"},
    "ttl": "soon"}, "services": []}]})");
  EXPECT_THAT(told(wrong), ElementsAre(AllOf(HasSubstr("config/car.json:1:"), HasSubstr("'maxi'")),
                                       AllOf(HasSubstr("config/car.json:2:12"), HasSubstr("ttl"))));
}

TEST(ReadVsomeip, TellsAllThatIsWrongWithPlaces) {
  const Reading reading = read_one(R"({
  "unicast": "192.168.0.300",
  "services": [
    {"service": "0x12345", "instance": "1", "unreliable": "y"},
    {"service": "0x1"},
    {"service": "0x2", "instance": "1", "unreliable": "x", "events": [{"event": {}}]},
    {"service": "0x2", "instance": "1"},
    7
  ]
})");
  EXPECT_FALSE(reading.ok());
  EXPECT_THAT(told(reading),
              ElementsAre("config/car.json:2:14: error: expected the host's address, an address such as "
                          "\"192.168.0.1\", not the text "
                          "'192.168.0.300'",
                          "config/car.json:4:17: error: expected a service id, a whole number from 1 to "
                          "65534 such as \"0x12\" or 18, "
                          "not the text '0x12345'",
                          "config/car.json:4:59: error: expected a UDP port, a whole number from 0 to 65535 "
                          "such as \"0x12\" or 18, "
                          "not the text 'y'",
                          "config/car.json:5:5: error: expected a \"instance\" with its id",
                          "config/car.json:6:55: error: expected a UDP port, a whole number from 0 to 65535 "
                          "such as \"0x12\" or 18, "
                          "not the text 'x'",
                          "config/car.json:6:81: error: expected an event id, a whole number from 1 to 65534 "
                          "such as \"0x12\" or 18, "
                          "not an object",
                          "config/car.json:7:5: warning: a second description of instance 0x0001 of "
                          "service_0002: what it adds is taken, but vsomeip takes the first alone",
                          "config/car.json:8:5: error: expected a service, an object, not '7'"));
}

TEST(ReadVsomeip, TakesTemplatesWithAWarning) {
  const Reading reading =
      read_one(R"({"unicast": "@TEST_IP@", "services": [{"service": 1, "instance": 1}]})");
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(told(reading),
              ElementsAre("config/car.json:1:13: warning: the host's address is still to be filled "
                          "in: '@TEST_IP@'"));
  EXPECT_THAT(reading.model.services, SizeIs(1));
}

TEST(ReadVsomeip, TakesWhatIsStillToBeFilledInAsNotGiven) {
  const Reading reading = read_one(R"({
"services": [{"service": 1, "instance": "@INSTANCE@", "reliable": {"port": "${TCP}"}, "unreliable": "__UDP__",
"events": [{"event": "0x8001", "is_field": "__IS_FIELD__", "update-cycle": "@CYCLE@"}]}],
"service-discovery": {"port": "__SD_PORT__"}})");
  EXPECT_THAT(
      told(reading),
      ElementsAre(
          "config/car.json:2:41: warning: an instance id is still to be filled in: '@INSTANCE@'",
          "config/car.json:2:76: warning: a TCP port is still to be filled in: '${TCP}'",
          "config/car.json:2:101: warning: a UDP port is still to be filled in: '__UDP__'",
          "config/car.json:3:44: warning: true or false is still to be filled in: '__IS_FIELD__'",
          "config/car.json:3:76: warning: a cycle in milliseconds is still to be filled in: '@CYCLE@'",
          "config/car.json:4:31: warning: the port of service discovery is still to be filled in: "
          "'__SD_PORT__'"));
  ASSERT_THAT(reading.model.instances, SizeIs(1));
  EXPECT_EQ(reading.model.instances[0].id, std::nullopt);
  EXPECT_EQ(reading.model.instances[0].udp_port, std::nullopt);
  EXPECT_THAT(
      told(read_one(R"({"services": [{"service": "__ID__", "instance": 1}]})")),
      ElementsAre("config/car.json:1:27: error: expected a service id, which is still to be filled in: "
                  "'__ID__'"));
  EXPECT_FALSE(read_one(R"({"services": [{"service": 1, "instance": 1, "unreliable": "__"}]})").ok());
}

TEST(ReadVsomeip, TakesTheInstanceId0AsNotGiven) {
  const Reading reading =
      read_one(R"({"services": [{"service": 1, "instance": "0x0"}, {"service": 1, "instance": 0}],
"clients": [{"service": 2, "instance": 0}]})");
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(told(reading),
              testing::Each(testing::HasSubstr(
                  "warning: the instance id 0, which no instance can have, counts as not given")));
  ASSERT_THAT(reading.model.instances, SizeIs(3));
  EXPECT_EQ(reading.model.instances[0].id, std::nullopt);
  EXPECT_EQ(reading.model.instances[2].id, std::nullopt);
}

TEST(ReadVsomeip, KnowsPlaceholdersFromMistypedAddresses) {
  for (const char* placeholder :
       {"XXX.XXX.XXX.XXX", "__HOST_IP__", "UNICAST_PLACEHOLDER", "${IP}", "<address>"}) {
    EXPECT_TRUE(read_one(std::string{"{\"unicast\": \""} + placeholder + "\"}").ok()) << placeholder;
  }
  for (const char* mistyped : {"192.1680.0.1", "192.168.0", "fd00::12345", ""}) {
    EXPECT_FALSE(read_one(std::string{"{\"unicast\": \""} + mistyped + "\"}").ok()) << mistyped;
  }
}

TEST(ReadVsomeip, TakesATtlOf32BitsForOneThatNeverEnds) {
  const Reading reading = read_one(R"({"service-discovery": {"ttl": "0xffffffff"},
    "services": [{"service": 1, "instance": 1}]})");
  EXPECT_THAT(told(reading),
              ElementsAre(HasSubstr("warning: an entry has 24 bits for its ttl: 0xffffff is taken")));
  ASSERT_TRUE(reading.model.instances.at(0).timing);
  EXPECT_EQ(reading.model.instances[0].timing->ttl_s, 0xff'ffffU);
}

TEST(ReadVsomeip, LeavesOutAnEventgroupWithoutId) {
  const Reading reading = read_one(R"({"services": [{"service": 1, "instance": 1,
    "eventgroups": [{"event": "0x8001", "is_field": "true"}, {"eventgroup": 5, "events": ["0x8001"]}]}]})");
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(told(reading),
              ::testing::Contains(HasSubstr(
                  "warning: expected an \"eventgroup\" with its id; without it, vsomeip leaves this out")));
  EXPECT_THAT(reading.model.services.at(0).eventgroups, SizeIs(1));
}

TEST(ReadVsomeip, TakesLocalhostWithAWarning) {
  const Reading reading =
      read_one(R"({"unicast": "localhost", "services": [{"service": 1, "instance": 1}]})");
  EXPECT_THAT(told(reading),
              ElementsAre("config/car.json:1:13: warning: vsomeip accepts only addresses: 'localhost' is "
                          "read as 127.0.0.1"));
  EXPECT_EQ(reading.model.instances[0].address, IpAddress::v4(127, 0, 0, 1));
}

TEST(ReadVsomeip, JoinsTheFilesOfAFolder) {
  const std::vector<SourceText> sources{{"net.json", R"({"unicast": "10.0.0.1"})"},
                                        {"a.json", R"({"services": [{"service": 1, "instance": 1}]})"},
                                        {"b.json", R"({"services": [{"service": 1, "instance": 2}]})"}};
  const Reading reading = read_vsomeip(sources);
  EXPECT_THAT(reading.model.services, SizeIs(1));
  ASSERT_THAT(reading.model.instances, SizeIs(2));
  EXPECT_EQ(reading.model.instances[1].address, IpAddress::v4(10, 0, 0, 1));
  EXPECT_EQ(reading.model.instances[1].place.file, 2);
}

/// What vsomeip leaves out has to say the same as what it takes.
TEST(ReadVsomeip, TellsOfInstancesThatAreDescribedTwice) {
  const auto both = [](const std::string& more) {
    return read_one(R"({"services": [
{"service": 1, "instance": 1, "unreliable": 30501, "events": [{"event": "0x8001", "is_reliable": false}],
 "eventgroups": [{"eventgroup": 1, "events": ["0x8001"], "multicast": {"address": "239.0.0.1", "port": 30490}}]},
{"service": 1, "instance": 1)" +
                    more + "}]}");
  };
  const auto text = [](const char* at, const char* what) {
    return std::string{"config/car.json:"} + at + ": error: " + what +
           ": make them the same, or take one of them out";
  };
  EXPECT_THAT(told(both(R"(, "unreliable": 30502,
"eventgroups": [{"eventgroup": 1, "multicast": {"address": "239.0.0.2", "port": 30490}}],
"events": [{"event": "0x8001", "is_reliable": true}])")),
              ElementsAre(HasSubstr("config/car.json:4:1: warning: a second description"),
                          text("4:45",
                               "instance 0x0001 of service_0001 has the UDP port 30502 here, but 30501 at "
                               "config/car.json:2:45"),
                          text("5:48",
                               "instance 0x0001 of service_0001 has for eventgroup 0x0001 the multicast "
                               "address 239.0.0.2 here, but 239.0.0.1 at config/car.json:3:71"),
                          text("6:47",
                               "event 0x8001 has is_reliable true here, but false at "
                               "config/car.json:2:98")));
  const Reading same = both(R"(, "unreliable": "0x7725", "events": [{"event": 32769}])");
  EXPECT_TRUE(same.ok());
  EXPECT_THAT(told(same), ElementsAre(HasSubstr("a second description of instance 0x0001 of service_0001: "
                                                "what it adds is taken, but vsomeip takes the first alone")));
}

TEST(ReadVsomeip, TellsThatAThresholdHasNoMulticast) {
  const Reading reading = read_one(R"({"services": [{"service": 1, "instance": 1, "eventgroups": [
{"eventgroup": 1, "threshold": 4},
{"eventgroup": 2, "threshold": "0"},
{"eventgroup": 3, "multicast": "239.0.0.1", "threshold": 4},
{"eventgroup": 4, "threshold": "0x2"}]}]})");
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(told(reading),
              ElementsAre("config/car.json:2:32: warning: the threshold 4 of eventgroup 0x0001 is left out: "
                          "without \"multicast\", all of its subscribers get events by unicast",
                          "config/car.json:5:32: warning: the threshold 2 of eventgroup 0x0004 is left out: "
                          "without \"multicast\", all of its subscribers get events by unicast"));
}

/// As one host has them, whose applications have a file each.
TEST(ReadVsomeip, JoinsWhatTwoFilesSayOfOneInstance) {
  const std::vector<SourceText> sources{
      {"net.json", R"({"unicast": "10.0.0.1", "services": [{"service": 1, "instance": 1,
"events": [{"event": "0x8001"}, {"event": "0x8002", "is_reliable": false}],
"eventgroups": [{"eventgroup": 1, "events": ["0x8001"], "multicast": "239.0.0.1", "threshold": 4}],
"someip-tp": {"client-to-service": ["0x1", {"method": "0x2", "max-segment-length": 160}]}}]})"},
      {"app.json", R"({"services": [{"service": 1, "instance": 1, "unreliable": 30501, "reliable": 30502,
"events": [{"event": "0x8001", "is_field": true, "cycle": 100}, {"event": "0x8003", "is_reliable": true}],
"eventgroups": [{"eventgroup": 1, "events": ["0x8003"]}, {"eventgroup": 2, "events": ["0x8002"]}],
"someip-tp": {"client-to-service": [{"method": "0x1", "separation-time": 300}, "0x2"]},
"debounce-times": {"requests": {"0x1": {"maximum-retention-time": 20}}}}]})"}};
  for (const bool net_first : {true, false}) {
    const Reading reading =
        read_vsomeip(net_first ? sources : std::vector<SourceText>{sources[1], sources[0]});
    EXPECT_THAT(told(reading), IsEmpty());
    ASSERT_THAT(reading.model.instances, SizeIs(1));
    const Instance& instance = reading.model.instances[0];
    EXPECT_EQ(instance.address, IpAddress::v4(10, 0, 0, 1));
    EXPECT_EQ(instance.udp_port, 30501);
    EXPECT_EQ(instance.tcp_port, 30502);
    EXPECT_THAT(instance.multicast,
                ElementsAre(Multicast{someip::EventgroupId{1}, {IpAddress::v4(239, 0, 0, 1), 30501}, 4}));
    const Service& service = reading.model.services.at(0);
    EXPECT_THAT(service.eventgroups, SizeIs(2));
    ASSERT_THAT(service.fields, SizeIs(1));
    EXPECT_EQ(service.fields[0].cycle, 100ms);
    EXPECT_THAT(service.fields[0].eventgroups, ElementsAre(someip::EventgroupId{1}));
    ASSERT_THAT(service.events, SizeIs(2));
    ASSERT_THAT(service.methods, SizeIs(2));
    EXPECT_EQ(service.methods[0].request_transfer.segment_bytes, 1392U);
    EXPECT_EQ(service.methods[0].request_transfer.separation, 300us);
    EXPECT_EQ(service.methods[0].request_transfer.retention, 20ms);
    EXPECT_EQ(service.methods[1].request_transfer.segment_bytes, 160U);
  }
}

/// An event without "is_reliable" is carried by what the instance has, whichever file says it.
TEST(ReadVsomeip, KnowsTheUsualTransportOfAllDescriptions) {
  const SourceText bare{"a.json", R"({"services": [{"service": 1, "instance": 1,
"events": [{"event": "0x8001"}], "someip-tp": {"client-to-service": ["0x1"]}}]})"};
  const SourceText ported{"b.json", R"({"services": [{"service": 1, "instance": 1, "reliable": 30502}]})"};
  for (const std::vector<SourceText>& sources :
       {std::vector<SourceText>{bare, ported}, std::vector<SourceText>{ported, bare}}) {
    const Reading reading = read_vsomeip(sources);
    const Service& service = reading.model.services.at(0);
    EXPECT_EQ(service.events.at(0).transfer.transport, Transport::tcp);
    EXPECT_EQ(service.methods.at(0).request_transfer.transport, Transport::tcp);
  }
}

TEST(ReadVsomeip, TellsOfTransfersThatAreSaidDifferently) {
  const auto both = [](const char* instance, const char* other) {
    const auto text = [](const char* id, const char* settings) {
      return fmt::format(R"({{"services": [{{"service": 1, "instance": {}, {}}}]}})", id, settings);
    };
    const std::vector<SourceText> sources{
        {"a.json", text("1", R"("someip-tp": {"client-to-service": [{"method": 2, "max-segment-length": 160}],
"service-to-client": [{"method": "0x8001", "separation-time": 300}]},
"debounce-times": {"responses": {"2": {"debounce-time": 5, "maximum-retention-time": 20}}})")},
        {"b.json", text(instance, other)}};
    return told(read_vsomeip(sources));
  };
  const char* const other = R"("someip-tp": {"client-to-service": [{"method": 2, "max-segment-length": 320}],
"service-to-client": [{"method": "0x8001", "separation-time": 400}]},
"debounce-times": {"responses": {"2": {"debounce-time": 5, "maximum-retention-time": 30}}})";
  EXPECT_THAT(
      both("1", other),
      ElementsAre(
          "b.json:1:117: error: the request of method 0x0002 has the bytes of a segment 320 here, but "
          "160 at a.json:1:117: make them the same, or leave one of the two files out",
          HasSubstr("b.json:2:63: error: event 0x8001 has the time between segments 400 us here, but "
                    "300 us at a.json:2:63: make"),
          HasSubstr("b.json:3:86: error: the answer of method 0x0002 has the retention time 30 ms "
                    "here, but 20 ms at a.json:3:86: make")));
  EXPECT_THAT(
      both("2", other),
      testing::AllOf(SizeIs(3),
                     testing::Each(HasSubstr(", of another instance: an interface has one for all"))));
}

/// The file of the second is not the one that is read last.
TEST(ReadVsomeip, TellsOfContradictionsInTheirFile) {
  const std::vector<SourceText> sources{
      {"net.json", R"({"unicast": "10.0.0.1"})"},
      {"client.json",
       R"({"unicast": "10.0.0.2", "services": [{"service": 1, "instance": 1, "unicast": "10.0.0.9"}]})"},
      {"app.json", R"({"services": [{"service": 1, "instance": 1}]})"}};
  EXPECT_THAT(told(read_vsomeip(sources)),
              ElementsAre(HasSubstr("net.json:1:13: error: instance 0x0001 of service_0001 has the address "
                                    "10.0.0.1 here, but 10.0.0.9 at client.json:1:79")));
}

/// Whoever uses a service has to know where it is.
TEST(ReadVsomeip, KeepsTheClientOfAnotherHost) {
  const auto both = [](const char* port) {
    const std::vector<SourceText> sources{
        {"server.json",
         R"({"unicast": "10.0.0.1", "services": [{"service": 1, "instance": 1, "unreliable": 30501}]})"},
        {"client.json", fmt::format(R"({{"unicast": "10.0.0.2", "services": [
{{"service": 1, "instance": 1, "unicast": "10.0.0.1", "unreliable": {}}}]}})",
                                    port)}};
    return read_vsomeip(sources);
  };
  const Reading reading = both("30501");
  EXPECT_THAT(told(reading), IsEmpty());
  ASSERT_THAT(reading.model.instances, SizeIs(2));
  EXPECT_EQ(reading.model.instances[0].role, Instance::Role::provided);
  EXPECT_EQ(reading.model.instances[1].role, Instance::Role::required);
  EXPECT_THAT(
      told(both("30502")),
      ElementsAre(HasSubstr("client.json:2:68: error: instance 0x0001 of service_0001 has the UDP port "
                            "30502 here, but 30501 at server.json:1:")));
}

TEST(ReadVsomeip, TellsWhereAGroupStandsThatHasNoPort) {
  const SourceText one{"a.json", R"({"services": [{"service": 1, "instance": 1, "eventgroups": [
{"eventgroup": 1, "multicast": "239.0.0.1"},
{"eventgroup": 1, "multicast": {"address": "239.0.0.2"}}]}]})"};
  EXPECT_THAT(told(read_vsomeip({&one, 1})),
              ElementsAre(HasSubstr("a.json:3:32: error: instance 0x0001 of service_0001 has for eventgroup "
                                    "0x0001 the multicast address 239.0.0.2 here, but 239.0.0.1 at "
                                    "a.json:2:32")));
}

TEST(ReadVsomeip, TellsOfProtectionsThatContradict) {
  const auto both = [](const char* more) {
    const SourceText one{"a.json", fmt::format(R"({{"e2e": {{"protected": [
{{"service_id": 1, "event_id": "0x8001", "profile": "P04", "data_id": 1}},
{{"service_id": 1, "event_id": "0x8001", "profile": {}}}]}}}})",
                                               more)};
    return read_vsomeip({&one, 1});
  };
  EXPECT_THAT(
      told(both(R"("P04", "data_id": 2)")),
      ElementsAre("a.json:3:1: error: event 0x8001 of service_0001 has for E2E the data_id 2 here, but "
                  "1 at a.json:2:1: make them the same, or take one of them out"));
  EXPECT_THAT(told(both(R"("P07", "data_id": 1)")),
              ElementsAre(HasSubstr("has the E2E profile 7 here, but 4")));
  const Reading more = both(R"("P04", "max_delta_counter": 3)");
  EXPECT_THAT(told(more), IsEmpty());
  EXPECT_THAT(more.model.services.at(0).events.at(0).e2e.numbers,
              ElementsAre(testing::Pair("data_id", 1U), testing::Pair("max_delta_counter", 3U)));
}

TEST(ReadVsomeip, TellsOfEventsThatAreThereTwice) {
  const auto events = [](const std::string& list) {
    return read_one(R"({"services": [{"service": 1, "instance": 1, "events": [)" + list + "]}]}");
  };
  EXPECT_THAT(
      told(events(R"({"event": "0x8001", "is_field": false, "cycle": 100},
{"event": "32769", "is_field": true, "cycle": 200})")),
      ElementsAre("config/car.json:2:32: warning: event 0x8001 has is_field true here, but false at "
                  "config/car.json:1:88: the first is taken",  // vsomeip asks the application
                  HasSubstr("config/car.json:2:47: error: event 0x8001 has the cycle 200 ms here, but "
                            "100 ms at config/car.json:1:")));
  // What one of them says holds.
  const Reading reading =
      events(R"({"event": "0x8001"}, {"event": "0x8001", "is_field": true, "is_reliable": true},
{"event": "0x8001", "cycle": 100})");
  EXPECT_THAT(told(reading), IsEmpty());
  ASSERT_THAT(reading.model.services.at(0).fields, SizeIs(1));
  const Field& field = reading.model.services[0].fields[0];
  EXPECT_EQ(field.notifier_transfer.transport, Transport::tcp);
  EXPECT_EQ(field.cycle, 100ms);
  EXPECT_THAT(reading.model.services[0].events, IsEmpty());
}

/// vsomeip lets them have so. A model has one event of the service.
TEST(ReadVsomeip, WarnsOfEventsThatInstancesHaveDifferently) {
  const Reading reading = read_one(R"({"services": [
{"service": 1, "instance": 1, "reliable": 30501, "events": [{"event": "0x8001", "is_reliable": true}]},
{"service": 1, "instance": 2, "unreliable": 30502, "events": [{"event": "0x8001", "is_reliable": false}]},
{"service": 1, "instance": 3, "unreliable": 30503, "events": [{"event": "0x8001"}]}]})");
  EXPECT_THAT(
      told(reading),
      ElementsAre("config/car.json:3:98: warning: event 0x8001 has is_reliable false here, but true at "
                  "config/car.json:2:96, of another instance: an interface has one for all, and the first "
                  "is taken"));
  EXPECT_EQ(reading.model.services.at(0).events.at(0).transfer.transport, Transport::tcp);
}

/// Files that a script fills in are of several hosts, too, and nobody needs settings of what is turned off.
TEST(ReadVsomeip, TellsOfNoSettingsOfOtherHostsOrOfDiscoveryThatIsOff) {
  const auto both = [](const char* one, const char* other, const char* enable) {
    const auto text = [&](const char* unicast, const char* port) {
      return fmt::format(R"({{"unicast": "{}", "service-discovery": {{"enable": "{}", "port": "{}"}}}})",
                         unicast, enable, port);
    };
    const std::vector<SourceText> sources{{"a.json", text(one, "30490")}, {"b.json", text(other, "30491")}};
    return read_vsomeip(sources).ok();
  };
  EXPECT_TRUE(both("@MASTER@", "@SLAVE@", "true"));
  EXPECT_TRUE(both("10.0.0.1", "@SLAVE@", "true"));
  EXPECT_FALSE(both("@MASTER@", "@MASTER@", "true"));
  EXPECT_FALSE(both("10.0.0.1", "10.0.0.1", "true"));
  EXPECT_TRUE(both("10.0.0.1", "10.0.0.1", "false"));
}

TEST(ReadVsomeip, KeepsAnInstanceThatTwoHostsListTwice) {
  const auto both = [](const std::string& port) {
    const std::vector<SourceText> sources{
        {"client.json",
         R"({"unicast": "10.0.0.1", "services": [{"service": 1, "instance": 1)" + port + "}]}"},
        {"server.json",
         R"({"unicast": "10.0.0.2", "services": [{"service": 1, "instance": 1, "unreliable": 30502}]})"}};
    Reading reading = read_vsomeip(sources);
    EXPECT_TRUE(reading.ok());
    EXPECT_THAT(reading.model.instances, SizeIs(2));
    return join(reading.model).size();
  };
  EXPECT_EQ(both(R"(, "unreliable": 30502)"), 1U) << "a warning";
  EXPECT_EQ(both(""), 0U) << "what has no port is not offered on the network";
}

TEST(ReadVsomeip, TellsOfSettingsThatTwoFilesSayDifferently) {
  const std::vector<SourceText> one_host{
      {"net.json", R"({"unicast": "10.0.0.1", "service-discovery": {"ttl": 3, "cyclic_offer_delay": 1000}})"},
      {"a.json", R"({"service-discovery": {"ttl": "5", "cyclic_offer_delay": "1000"}})"}};
  EXPECT_THAT(
      told(read_vsomeip(one_host)),
      ElementsAre("a.json:1:31: error: the host has the ttl 5 here, but 3 at net.json:1:54: make them the "
                  "same, or leave one of the two files out"));
}

/// A file with another address is of another host.
TEST(ReadVsomeip, KeepsHostsApart) {
  const std::vector<SourceText> sources{
      {"first.json", R"({"unicast": "10.0.0.1", "service-discovery": {"ttl": 3},
"services": [{"service": 1, "instance": 1, "unreliable": 30501}]})"},
      {"second.json", R"({"unicast": "10.0.0.2", "service-discovery": {"ttl": 5},
"services": [{"service": 1, "instance": 2, "unreliable": 30501},
             {"service": 1, "instance": 3, "unicast": "10.0.0.1", "unreliable": 30503}]})"},
      {"more.json", R"({"services": [{"service": 2, "instance": 1, "unreliable": 30502}]})"}};
  const Reading reading = read_vsomeip(sources);
  EXPECT_THAT(told(reading), IsEmpty());
  ASSERT_THAT(reading.model.machines, SizeIs(2));
  EXPECT_EQ(reading.model.machines[1].name, "second");
  ASSERT_THAT(reading.model.instances, SizeIs(4));
  EXPECT_EQ(reading.model.instances[1].address, IpAddress::v4(10, 0, 0, 2));
  EXPECT_EQ(reading.model.instances[1].machine, "second");
  EXPECT_EQ(reading.model.instances[1].timing->ttl_s, 5U);
  EXPECT_EQ(reading.model.instances[2].role, Instance::Role::required);
  EXPECT_EQ(reading.model.instances[3].machine, "first");
  EXPECT_EQ(reading.model.instances[3].timing->ttl_s, 3U);
}

TEST(ReadVsomeip, KnowsConfigurationsByTheirKeys) {
  for (const char* text :
       {"{\"services\": []}", "// by hand\n{\"unicast\": \"10.0.0.1\"", "{}", "{ services: [",
        "\xef\xbb\xbf{\"a\": {\"services\": 1}, /* { */ \"applications\" : []}"}) {
    EXPECT_TRUE(is_vsomeip(text)) << text;
  }
  for (const char* text : {"", "[{\"services\": []}]", "{\"name\": \"services\", \"a\": {\"services\": []}}",
                           "{\"\\\"services\": 1}", "word"}) {
    EXPECT_FALSE(is_vsomeip(text)) << text;
  }
}

/// As the two sides of one system have it: each event once, though nothing but E2E tells of it.
TEST(ReadVsomeip, JoinsEventsOfWhichThereIsE2eAlone) {
  const auto side = [](const char* variant) {
    return std::string{
               R"({"e2e": {"protected": [)"
               R"({"service_id": "0x1234", "event_id": "0x8001", "profile": "P04", "data_id": 1, "variant": ")"} +
           variant +
           R"("}, {"service_id": "0x1234", "event_id": "0x0001", "profile": "P04", "data_id": 2}]}})";
  };
  const std::vector<SourceText> sources{{"a.json", side("protector")}, {"b.json", side("checker")}};
  Reading reading = read_vsomeip(sources);
  EXPECT_THAT(told(reading), IsEmpty());
  ASSERT_THAT(reading.model.services, SizeIs(1));
  EXPECT_THAT(reading.model.services[0].events, SizeIs(1));
  EXPECT_EQ(reading.model.services[0].events[0].e2e.numbers.at("data_id"), 1U);
  EXPECT_FALSE(reading.model.services[0].events[0].payload.known);
  EXPECT_THAT(reading.model.services[0].methods, SizeIs(1));
  EXPECT_THAT(join(reading.model), IsEmpty());
}

TEST(JsonTree, ReadsEscapesAndPlaces) {
  documents::Problems problems{"f"};
  const auto root =
      parse_json("\xef\xbb\xbf{ \"a\\u00e9\\n\": [1, true,\n null, \"\\ud83d\\ude00\"] }", problems);
  ASSERT_TRUE(root);
  EXPECT_EQ(root->members[0].name, "a\xc3\xa9\n");
  const JsonNode& list = root->members[0];
  ASSERT_THAT(list.elements, SizeIs(4));
  EXPECT_EQ(list.elements[2].mark, (documents::Mark{2, 2}));
  EXPECT_EQ(list.elements[3].text, "\xf0\x9f\x98\x80");
}

TEST(JsonTree, WarnsOfWhatPeopleAdd) {
  documents::Problems problems{"f"};
  EXPECT_TRUE(parse_json("// hello\n[1, /* two */ 2,]", problems));
  const auto all = problems.take();
  ASSERT_THAT(all, SizeIs(2));
  EXPECT_EQ(to_string(all[0]),
            "f:1:1: warning: a comment, which JSON does not have; vsomeip refuses such a file");
  EXPECT_EQ(to_string(all[1]), "f:2:16: warning: a comma too many, which vsomeip refuses");
}

TEST(JsonTree, RefusesWhatIsNoJson) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"", "f:1:1: error: expected a value, not the end of the file"},
      {"{\"a\" 1}", "f:1:6: error: expected ':', not '1}'"},
      {"[1 2]", "f:1:4: error: expected ',' or ']', not '2]'"},
      {"[1", "f:1:3: error: expected ',' or ']', not the end of the file"},
      {"\"abc", "f:1:5: error: expected a closing \", not the end of the file"},
      {"{} x", "f:1:4: error: expected the end of the file, not 'x'"},
      {"tru", "f:1:1: error: expected a value, not 'tru'"},
      {"\"\\u12\"", "f:1:2: error: expected one of \\\" \\\\ \\/ \\b \\f \\n \\r \\t \\uXXXX, not '\\u12\"'"},
      {"/*", "f:1:3: error: expected a value, not the end of the file"},
  };
  for (const auto& [text, expected] : cases) {
    documents::Problems problems{"f"};
    EXPECT_FALSE(parse_json(text, problems)) << text;
    const auto all = problems.take();
    ASSERT_FALSE(all.empty()) << text;
    EXPECT_EQ(to_string(all.back()), expected);
  }
}

TEST(JsonTree, RefusesTooDeepOnes) {
  documents::Problems problems{"f"};
  EXPECT_FALSE(parse_json(std::string(1000000, '['), problems));
  EXPECT_THAT(to_string(problems.take().front()), HasSubstr("at most 64 values nested in each other"));
}

TEST(WriteVsomeip, WritesWhatItReads) {
  const Model model = read_one(newer).model;
  const Written written = write_vsomeip(model);
  ASSERT_THAT(written.files, SizeIs(2));
  EXPECT_THAT(written.not_carried, IsEmpty());
  SourceText again{"config/car.json", written.files[0].text};
  const Reading reading = read_vsomeip({&again, 1});
  EXPECT_THAT(told(reading), IsEmpty());
  Model expected = model;
  // vsomeip's default for what the file does not say is the checker's.
  expected.services[0].fields[0].e2e.numbers["max_delta_counter"] = 1;
  EXPECT_EQ(canonical(reading.model), canonical(expected));
}

TEST(WriteVsomeip, WritesAClientThatKnowsItsSegments) {
  const Written written = write_vsomeip(read_one(newer).model);
  const auto json = nlohmann::json::parse(written.files[1].text);
  EXPECT_EQ(json["clients"].dump(), R"([{"instance":"0x0016","service":"0x1234"}])");
  EXPECT_EQ(json["services"][0]["someip-tp"]["client-to-service"][0], "0x0001");
  EXPECT_EQ(json["services"][0]["unicast"], "192.168.0.1");
  EXPECT_FALSE(json.contains("unicast"));
  EXPECT_EQ(json["e2e"]["protected"][0]["variant"], "checker");
}

// Else vsomeip and a bridge that says nothing of it do not meet.
TEST(WriteVsomeip, WritesTheGroupThatBothStacksHaveWhereNobodySaysOne) {
  const Written written = write_vsomeip({});
  ASSERT_THAT(written.files, SizeIs(2));
  for (const TextFile& file : written.files) {
    EXPECT_EQ(nlohmann::json::parse(file.text)["service-discovery"]["multicast"], "224.244.224.245");
  }
}

TEST(WriteVsomeip, TellsWhatItCannotCarry) {
  Model model;
  model.services.push_back({.name = "Door", .scope = "org.example"});
  model.services.push_back({.name = "Lock",
                            .scope = "org.example",
                            .id = someip::ServiceId{1},
                            .events = {{.name = "e", .selective = true, .e2e = {.profile = "11"}}}});
  model.services[1].events[0].e2e.set(someip::InstanceId{2}, {.profile = "4", .numbers = {{"data_id", 1}}});
  const Written written = write_vsomeip(model);
  EXPECT_THAT(
      lines_of(written.not_carried),
      ElementsAre("org.example.Door: a service without id", "org.example.Lock: a service without instance",
                  "org.example.Lock.e: E2E profile 11",
                  "org.example.Lock.e: E2E protection of each instance, here one for all: in instance 0x0002 "
                  "profile 4, data_id 0x0001",
                  "org.example.Lock.e: an event without id",
                  "org.example.Lock.e: no eventgroup: nobody can subscribe to it",
                  "org.example.Lock.e: selective"));
}

TEST(WriteVsomeip, TellsOfVersionsRolesAndTransports) {
  Model model;
  Service door{.name = "Door", .id = someip::ServiceId{1}, .major = 2, .minor = 3, .has_version = true};
  door.methods = {{.name = "open", .id = someip::MethodId{1}},
                  {.name = "ring", .id = someip::MethodId{2}, .fire_and_forget = true}};
  door.methods[0].request_transfer.transport = Transport::tcp;
  door.methods[0].timeout = std::chrono::milliseconds{5};
  door.fields = {
      {.name = "angle", .getter = someip::MethodId{3}, .setter = someip::MethodId{4}, .has_notifier = false}};
  model.services = {door};
  model.instances = {{.service = "Door",
                      .service_id = someip::ServiceId{1},
                      .id = someip::InstanceId{7},
                      .configuration = {{"a", "b"}}}};
  const auto lines = [&model] { return lines_of(write_vsomeip(model).not_carried); };
  // An instance without a name has that of its service and its id.
  EXPECT_THAT(lines(),
              ::testing::UnorderedElementsAre(
                  "Door 0x0007: no port: vsomeip offers it to this host alone", "Door: its version: 2.3",
                  "Door.open: that it is carried by TCP: a client takes either port",
                  "Door.open: its timeout", "Door.ring: that it has no answer",
                  "Door.open: the method 0x0001: there is a place for its settings alone, and it has none",
                  "Door.ring: the method 0x0002: there is a place for its settings alone, and it has none",
                  "Door.angle: which methods read and write it: getter 0x0003, setter 0x0004",
                  "Door 0x0007: configuration options"));
  // Where there is TCP alone, nothing else can be taken.
  model.instances[0].tcp_port = 30501;
  EXPECT_THAT(lines(), ::testing::Not(::testing::Contains(HasSubstr("carried by TCP"))));
}

/// A file is that of one host.
TEST(WriteVsomeip, TellsWhatInstancesHaveOfTheirOwn) {
  Model model;
  model.services = {
      {.name = "Door", .id = someip::ServiceId{1}, .eventgroups = {{.id = someip::EventgroupId{1}}}}};
  const auto instance = [](std::uint16_t id, std::uint8_t host) {
    return Instance{.service = "Door",
                    .id = someip::InstanceId{id},
                    .address = IpAddress::v4(10, 0, 0, host),
                    .udp_port = std::uint16_t{30501},
                    .timing = sd::Timing{}};
  };
  const Endpoint group{.address = IpAddress::v4(239, 0, 0, 1), .port = 1000};
  model.instances = {instance(1, 1), instance(2, 1), instance(3, 2)};
  model.instances[0].timing->request_response_delay_min = 5ms;
  model.instances[0].timing->initial_delay_min = 1500us;
  model.instances[1].timing->ttl_s = 99;
  model.instances[1].multicast = {{.eventgroup = someip::EventgroupId{1}, .group = group, .threshold = 1000},
                                  {.eventgroup = someip::EventgroupId{55}, .group = group, .threshold = 2}};
  model.instances[2].timing = model.instances[0].timing;
  EXPECT_THAT(
      lines_of(write_vsomeip(model).not_carried),
      ElementsAre(
          "Door 0x0001: its least delay of answers", "Door 0x0001: times in µs: 1500",
          "Door 0x0002: its threshold of 1000 subscribers: vsomeip has at most 255",
          "Door 0x0002: the group of an eventgroup that its service does not have: 0x0037",
          "Door 0x0002: its times of service discovery: a file has those of one instance, Door 0x0001",
          "Door 0x0003: its address 10.0.0.2: the file is that of one host, 10.0.0.1"));
}

TEST(WriteVsomeip, TellsOfNumbersThatItCannotWrite) {
  Model model = read_one(newer).model;
  Service& service = model.services[0];
  service.methods[1].request_transfer.segment_bytes = 1000;
  service.events[0].transfer.debounce = 10500us;
  service.events[0].cycle = 200us;
  const Written written = write_vsomeip(model);
  EXPECT_THAT(
      lines_of(written.not_carried),
      ElementsAre("service_1234.event_8002: times in µs: 10500", "service_1234.event_8002: times in µs: 200",
                  "service_1234.method_0002: segments of 1000 bytes: a multiple of 16, of at most "
                  "1392, here 992"));
  EXPECT_THAT(written.files[0].text, HasSubstr("\"max-segment-length\": \"992\""));
  // A file of a client has no events.
  for (Instance& instance : model.instances) {
    instance.role = Instance::Role::required;
  }
  EXPECT_THAT(write_vsomeip(model).not_carried,
              ::testing::Contains(
                  ::testing::Field(&NotCarried::what, "an event of a service that is used and not offered")));
}

TEST(ReadVsomeip, DoesNotTakeUnknownPayloadsForEmptyOnes) {
  const SourceText source{
      "a.json",
      "{\"services\": [{\"service\": \"0x1234\", \"instance\": \"1\", \"events\": [{\"event\": "
      "\"0x8001\"}, {\"event\": \"0x8002\", \"is_field\": \"true\"}]}]}"};
  const Reading reading = read_vsomeip({&source, 1});
  ASSERT_EQ(reading.model.services.size(), 1U);
  const Service& service = reading.model.services[0];
  ASSERT_EQ(service.events.size(), 1U);
  EXPECT_FALSE(service.events[0].payload.known);
  ASSERT_EQ(service.fields.size(), 1U);
  EXPECT_FALSE(service.fields[0].payload.known);
  // No ROS type is made of them.
  const Lowered lowered = lower(reading.model);
  EXPECT_TRUE(lowered.members.empty());
  ASSERT_EQ(lowered.not_carried.size(), 2U);
  EXPECT_EQ(lowered.not_carried[0].what, "what it carries is not known");
}

TEST(ReadVsomeip, RefusesFilesThatAreTooLarge) {
  const SourceText source{"v.json", "{\"services\": []}"};
  EXPECT_TRUE(read_vsomeip({&source, 1}, 16).ok());
  const Reading reading = read_vsomeip({&source, 1}, 15);
  ASSERT_EQ(reading.problems.size(), 1U);
  EXPECT_EQ(documents::to_string(reading.problems[0]),
            "v.json: error: the file has 16 bytes; expected at most 15");
}

}  // namespace
}  // namespace trestle::describe
