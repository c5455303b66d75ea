#include "bridge/console/metrics.hpp"

#include <gmock/gmock.h>

#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <set>
#include <string>

#include "bridge/picture/causes.hpp"

namespace trestle::console {
namespace {

using carry::Picture;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;

/// Two routes: one flows, one waits.
Picture picture() {
  Picture result;
  result.program = "1.0";
  result.configuration = "drive.yaml";
  result.running_s = 12.5;
  result.someip.heard = 1;
  result.someip.discovery_received = 3;
  result.someip.hosts = {{.address = "10.0.0.2", .port = 30490, .seen_s = 0.5, .offers = 1}};
  result.dds.domain = 7;
  result.dds.heard = 2;
  result.limits = {{"max_peers", 1, 64}};
  result.counters = {{"SOME/IP", {{"datagrams_received", 7, "traffic"}, {"malformed", 1, "loss"}}}};
  carry::RoutePicture flowing;
  flowing.kind = "event_to_topic";
  flowing.name = "/points";
  flowing.direction = "someip_to_dds";
  flowing.service = 0x1234;
  flowing.instance = 1;
  flowing.received = 12;
  flowing.carried = 10;
  flowing.bytes = 1000;
  flowing.per_second = 5;
  flowing.last_ns = 1'700'000'000'500'000'000;
  flowing.last_carried_ns = flowing.last_ns;
  flowing.dds.matched = 3;
  flowing.someip.subscribed = true;
  flowing.counters = {{"received", 12, "traffic"},
                      {"no_reader", 2, "loss"},
                      {"dds_overwritten", 1, "doubt"},
                      {"readers", 3, "now"}};
  flowing.conversion = {
      .count = 10, .max_ns = 40'000, .sum_ns = 90'000, .buckets = {{2'047, 4}, {40'959, 6}}};
  carry::RoutePicture waiting;
  waiting.kind = "event_to_topic";
  waiting.name = "/say \"hello\"\\";
  waiting.direction = "someip_to_dds";
  waiting.service = 0x1111;
  waiting.instance = 2;
  result.routes = {flowing, waiting};
  explain(result);
  return result;
}

TEST(Metrics, HaveTheNumbersOfRoutesWithLabels) {
  const std::string text = metrics(picture(), MetricsForm::prometheus);
  const std::string labels =
      R"({route="/points",kind="event_to_topic",direction="someip_to_dds",service="0x1234",instance="0x0001")";
  EXPECT_THAT(text, HasSubstr("# TYPE trestle_route_received_messages_total counter\n"
                              "trestle_route_received_messages_total" +
                              labels + "} 12\n"));
  EXPECT_THAT(text, HasSubstr("trestle_route_carried_bytes_total" + labels + "} 1000\n"));
  EXPECT_THAT(text,
              HasSubstr("trestle_route_dropped_messages_total" + labels + ",reason=\"no_reader\"} 2\n"));
  EXPECT_THAT(
      text, HasSubstr("trestle_route_doubtful_messages_total" + labels + ",reason=\"dds_overwritten\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("trestle_route_state" + labels + ",state=\"flowing\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("trestle_route_state" + labels + ",state=\"failing\"} 0\n"));
  EXPECT_THAT(text, HasSubstr("trestle_route_last_message_timestamp_seconds" + labels + "} 1700000000.5\n"));
  EXPECT_THAT(text, HasSubstr("trestle_someip_host_seen_seconds{peer=\"10.0.0.2\",port=\"30490\"} 0.5\n"));
  EXPECT_THAT(text, HasSubstr("trestle_dds_participants{domain=\"7\"} 2\n"));
  EXPECT_THAT(text, HasSubstr("trestle_limit_most{limit=\"max_peers\"} 64\n"));
  EXPECT_THAT(text, HasSubstr("{group=\"SOME/IP\",name=\"malformed\",kind=\"loss\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("trestle_build_info{version=\"1.0\",configuration=\"drive.yaml\"} 1\n"));
  EXPECT_THAT(text, Not(HasSubstr("readers")));
}

TEST(Metrics, NameTheCauseWhyNothingFlows) {
  const std::string text = metrics(picture(), MetricsForm::prometheus);
  EXPECT_THAT(text, HasSubstr(R"(trestle_route_cause{route="/say \"hello\"\\",kind="event_to_topic",)"
                              R"(direction="someip_to_dds",service="0x1111",instance="0x0002",)"
                              R"(cause="not_offered"} 1)"));
  EXPECT_THAT(text, Not(HasSubstr(R"(trestle_route_cause{route="/points")")));
}

TEST(Metrics, HaveLatenciesAsHistograms) {
  const std::string text = metrics(picture(), MetricsForm::prometheus);
  const auto bucket = [](const char* bound, int count) {
    return "instance=\"0x0001\",le=\"" + std::string{bound} + "\"} " + std::to_string(count) + "\n";
  };
  EXPECT_THAT(text, HasSubstr("# TYPE trestle_route_conversion_seconds histogram\n"));
  EXPECT_THAT(text, HasSubstr(bucket("1e-06", 0)));
  EXPECT_THAT(text, HasSubstr(bucket("2.5e-06", 4)));
  EXPECT_THAT(text, HasSubstr(bucket("2.5e-05", 4)));
  EXPECT_THAT(text, HasSubstr(bucket("5e-05", 10)));
  EXPECT_THAT(text, HasSubstr(bucket("+Inf", 10)));
  EXPECT_THAT(text, HasSubstr("instance=\"0x0001\"} 9e-05\n"));
  EXPECT_THAT(text, Not(HasSubstr("trestle_route_path_seconds_count"))) << "nothing was measured";
}

TEST(Metrics, AreOpenMetricsWhereThatIsWanted) {
  const std::string text = metrics(picture(), MetricsForm::openmetrics);
  EXPECT_THAT(text, HasSubstr("# TYPE trestle_route_received_messages counter\n"
                              "trestle_route_received_messages_total{"));
  EXPECT_THAT(text, HasSubstr("# TYPE trestle_build info\ntrestle_build_info{"));
  EXPECT_THAT(text, HasSubstr("# UNIT trestle_running_seconds seconds\n"));
  EXPECT_THAT(text, EndsWith("\n# EOF\n"));
  EXPECT_THAT(metrics(picture(), MetricsForm::prometheus), Not(HasSubstr("# EOF")));
}

// A new field also has to be in metrics.cpp.
TEST(Metrics, HaveEachCounterOfViewersOnALineOfItsOwn) {
  constexpr std::size_t fields = sizeof(ViewerCounters) / sizeof(std::uint64_t);
  const auto of_viewers = [](const std::array<std::uint64_t, fields>& numbers) {
    return metrics({}, MetricsForm::prometheus, std::bit_cast<ViewerCounters>(numbers));
  };
  std::set<std::string> texts{of_viewers({})};
  for (std::size_t field = 0; field < fields; ++field) {
    std::array<std::uint64_t, fields> numbers{};
    numbers.at(field) = 1;
    EXPECT_TRUE(texts.insert(of_viewers(numbers)).second) << "field " << field << " of ViewerCounters";
  }
}

/// For promtool_test.py.
TEST(Metrics, AreWrittenForOthersToJudge) {
  const char* const folder = std::getenv("METRICS_FOLDER");
  if (folder == nullptr) {
    GTEST_SKIP() << "nobody wants them";
  }
  std::ofstream{std::string{folder} + "/prometheus.txt"} << metrics(picture(), MetricsForm::prometheus);
  std::ofstream{std::string{folder} + "/openmetrics.txt"} << metrics(picture(), MetricsForm::openmetrics);
}

}  // namespace
}  // namespace trestle::console
