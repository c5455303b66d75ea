// The state of methods, as diagnostics.
#include <gmock/gmock.h>

#include <algorithm>
#include <cstdio>
#include <map>

#include "test/bridge/end_to_end/services_end_to_end.hpp"

namespace trestle::test::method_state_test {
namespace {

constexpr someip::MethodId method{0x0021};

/// A diagnostic_msgs/msg/DiagnosticStatus: "WARN the ROS service is not there", and its values.
struct Status {
  std::string says;
  std::string at;
  std::map<std::string, std::string> values;
};

/// Those of a DiagnosticArray in little endian, by name.
std::map<std::string, Status> statuses_of(const Bytes& cdr) {
  std::size_t place = 4 + 8;  // the encapsulation, the stamp
  const auto number = [&] {
    place = (place + 3) / 4 * 4;
    std::uint32_t value = 0;
    for (unsigned i = 0; i < 4; ++i) {
      value |= std::to_integer<std::uint32_t>(cdr.at(place++)) << 8 * i;
    }
    return value;
  };
  const auto text = [&] {
    std::string result(number(), '\0');
    for (char& one : result) {
      one = static_cast<char>(cdr.at(place++));
    }
    result.pop_back();
    return result;
  };
  text();
  std::map<std::string, Status> result;
  for (std::uint32_t count = number(); count > 0; --count) {
    const std::byte level = cdr.at(place++);
    Status& status = result[text()];
    status.says = (level == std::byte{0} ? "OK " : level == std::byte{1} ? "WARN " : "ERROR ") + text();
    status.at = text();
    for (std::uint32_t values = number(); values > 0; --values) {
      const std::string key = text();
      status.values[key] = text();
    }
  }
  return result;
}

TEST_F(ServicesEndToEnd, RoutesTellTheirStateAsDiagnosticsWhereTheyAreWanted) {
  start_bridge(
      "diagnostics: {topic: /state, period: 200 ms}\n"
      "routes:\n"
      "  - {topic: /out, type: std_msgs/msg/String, direction: dds_to_someip, service: 0x1234, instance: 1, "
      "eventgroup: 1, event: 0x8001, port: 40001}\n"
      "  - {topic: /in, type: std_msgs/msg/String, direction: someip_to_dds, service: 0x1235, instance: 1, "
      "eventgroup: 1, event: 0x8002}\n");
  Inbox<Bytes> states;
  const auto state = reader("/state", "diagnostic_msgs/msg/DiagnosticArray", states);
  std::map<std::string, Status> last;
  const auto told = [&](const std::string& name, const std::string& says) {
    return until([&] {
      for (const Bytes& one : states.take()) {
        last = statuses_of(one);
      }
      return last[name].says == says;
    });
  };
  const std::string out = "trestle: route /out to SOME/IP";
  const std::string in = "trestle: route /in from SOME/IP";
  EXPECT_TRUE(told(out, "WARN nobody publishes the topic"));
  EXPECT_TRUE(told(in, "WARN the SOME/IP service is not there, or not subscribed to"));
  EXPECT_EQ(last[out].at, "SOME/IP 0x1234.0x0001 event 0x8001");
  EXPECT_EQ(last[out].values.at("received"), "0");
  EXPECT_FALSE(last[out].values.contains("too_large")) << "there are none";
  dds::Writer from = writer("/out");
  sd::Node node{io_, node_config()};
  const sd::Offer offer{
      node,
      {.service = someip::ServiceId{0x1235},
       .instance = someip::InstanceId{1},
       .eventgroups = {{.id = someip::EventgroupId{1}, .events = {someip::MethodId{0x8002}}}}}};
  EXPECT_TRUE(told(out, "OK ready"));
  EXPECT_TRUE(told(in, "OK ready"));
}

/// What was told last, of a bridge that repeats nothing: each change is to be told at once.
class StateChanges : public ServicesEndToEnd {
 protected:
  void start(const std::string& lists) {
    start_bridge("diagnostics: {topic: /state, period: 3600 s}\n" + lists);
    state_ = reader("/state", "diagnostic_msgs/msg/DiagnosticArray", states_);
    ASSERT_TRUE(until([&] { return state_->matched() == 1; }));
  }
  bool told(const std::string& name, const std::string& says) {
    return until([&] {
      for (const Bytes& one : states_.take()) {
        last_ = statuses_of(one);
      }
      const auto found = last_.find(name);
      return found == last_.end() ? says.empty() : found->second.says == says;
    });
  }
  Inbox<Bytes> states_;
  std::optional<dds::Reader> state_;
  std::map<std::string, Status> last_;
};

TEST_F(StateChanges, OfRoutesAreToldAtOnce) {
  start(
      "routes:\n"
      "  - {topic: /out, type: std_msgs/msg/String, direction: dds_to_someip, service: 0x1234, instance: 1, "
      "eventgroup: 1, event: 0x8001, port: 40001}\n"
      "  - {topic: /in, type: std_msgs/msg/String, direction: someip_to_dds, service: 0x1235, instance: 1, "
      "eventgroup: 1, event: 0x8002}\n");
  const std::string out = "trestle: route /out to SOME/IP";
  const std::string in = "trestle: route /in from SOME/IP";
  {
    const dds::Writer from = writer("/out");
    EXPECT_TRUE(told(out, "OK ready"));
  }
  EXPECT_TRUE(told(out, "WARN nobody publishes the topic"));
  sd::Node node{io_, node_config()};
  {
    const sd::Offer offer{
        node,
        {.service = someip::ServiceId{0x1235},
         .instance = someip::InstanceId{1},
         .eventgroups = {{.id = someip::EventgroupId{1}, .events = {someip::MethodId{0x8002}}}}}};
    EXPECT_TRUE(told(in, "OK ready"));
  }
  EXPECT_TRUE(told(in, "WARN the SOME/IP service is not there, or not subscribed to"));
}

TEST_F(StateChanges, OfDiscoveredRoutesAreToldAtOnce) {
  const std::string lock = testing::TempDir() + "trestle-states-" + std::to_string(getpid()) + ".lock";
  start("lock_file: " + lock +
        "\npatterns:\n  - {topics: /s/**, direction: dds_to_someip, port: 40001, services: "
        "0x6000-0x6fff}\n");
  const std::string route = "trestle: route /s/a to SOME/IP";
  const std::string pattern = "trestle: pattern /s/**";
  {
    const dds::Writer from = writer("/s/a");
    EXPECT_TRUE(told(route, "OK ready"));
    EXPECT_TRUE(told(pattern, "OK ready"));
    EXPECT_EQ(last_[pattern].at, "SOME/IP 0x6000-0x6fff");
    EXPECT_EQ(last_[pattern].values.at("routes"), "1");
    EXPECT_TRUE(last_[route].values.contains("received"));
  }
  EXPECT_TRUE(told(route, "")) << "it has ended";
  EXPECT_TRUE(told(pattern, "WARN nobody publishes a topic that matches"));
  const dds::Writer unknown = writer("/s/b", "nowhere_msgs/msg/Unknown");
  EXPECT_TRUE(told(pattern, "WARN no topic that matches gets a route"));
  std::remove(lock.c_str());
}

TEST_F(ServicesEndToEnd, MethodsTellTheirStateAsDiagnosticsWhereTheyAreWanted) {
  start_bridge(
      "diagnostics: {topic: /state, period: 500 ms}\n"
      "methods:\n"
      "  - {ros_service: /set, type: std_srvs/srv/SetBool, server: ros, service: 0x1234, instance: 1, "
      "method: "
      "0x21, port: 40001}\n"
      "  - {ros_service: /other, type: std_srvs/srv/SetBool, server: someip, service: 0x1235, instance: 1, "
      "method: 0x21, timeout: 3 s}\n");
  Inbox<Bytes> states;
  const auto state = reader("/state", "diagnostic_msgs/msg/DiagnosticArray", states);
  std::map<std::string, Status> last;
  const auto told = [&](const std::string& name, const std::string& says,
                        const std::map<std::string, std::string>& values) {
    return until([&] {
      for (const Bytes& one : states.take()) {
        last = statuses_of(one);
      }
      return last[name].says == says && std::ranges::all_of(values, [&](const auto& value) {
               const auto found = last[name].values.find(value.first);
               return found != last[name].values.end() && found->second == value.second;
             });
    });
  };
  const std::string by_ros = "trestle: method of ROS service /set";
  const std::string by_someip = "trestle: ROS service of method /other";
  EXPECT_TRUE(told(by_ros, "WARN the ROS service is not there", {{"ready", "0"}, {"received", "0"}}));
  EXPECT_TRUE(
      told(by_someip, "WARN the SOME/IP service is not offered", {{"ready", "0"}, {"received", "0"}}));
  EXPECT_EQ(last[by_ros].at, "SOME/IP 0x1234.0x0001 method 0x0021");
  EXPECT_EQ(last[by_someip].at, "SOME/IP 0x1235.0x0001 method 0x0021");
  EXPECT_EQ(last.size(), 2U);

  int came = 0;
  driver_.server(ros_, ros("/set", "std_srvs/srv/SetBool"),
                 [&](const dds::RequestId&, const dds::ServiceMessage&) { ++came; });
  sd::Node node{io_, node_config()};
  const sd::Offer offer{node,
                        {.service = someip::ServiceId{0x1235},
                         .instance = someip::InstanceId{1},
                         .methods = {{method, [&](const someip::Message&, sd::Responder responder) {
                                        responder.error(someip::ReturnCode{0x21});
                                      }}}}};
  EXPECT_TRUE(told(by_ros, "OK ready", {{"ready", "1"}}));
  EXPECT_TRUE(told(by_someip, "OK ready", {{"ready", "1"}}));
  sd::Proxy proxy{node, {.service = someip::ServiceId{0x1234}}};
  std::vector<Answer> answers;
  call(proxy, method, hex("01"), answers);
  ASSERT_TRUE(until([&] { return came == 1; }));
  EXPECT_TRUE(told(by_ros, "OK ready", {{"received", "1"}, {"answered", "0"}, {"in_flight", "1"}}));
  dds::ServiceClient& client = driver_.client(ros_, ros("/other", "std_srvs/srv/SetBool"));
  ASSERT_TRUE(until([&] { return client.ready(); }));
  ros_call(client, hex("00010000 01"), answers);
  EXPECT_TRUE(told(by_someip, "OK ready",
                   {{"received", "1"}, {"errors", "1"}, {"failures_answered", "1"}, {"in_flight", "0"}}));
  driver_.end_servers();
  EXPECT_TRUE(told(by_ros, "WARN the ROS service is not there", {{"gone", "1"}, {"in_flight", "0"}}));
}

}  // namespace
}  // namespace trestle::test::method_state_test
