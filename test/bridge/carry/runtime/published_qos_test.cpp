// What a route asks for where its quality of service is as published, and what the log says of a misfit.
#include "bridge/carry/runtime/published_qos.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <regex>

#include "bridge/carry/config/load.hpp"
#include "bridge/carry/runtime/dds_words.hpp"
#include "dds_adapter/ros_names.hpp"

namespace trestle::test::published_qos_test {
namespace {

using namespace std::chrono_literals;
using carry::PublishedQos;
using carry::QosSettings;
using testing::HasSubstr;

constexpr QosSettings as_published{{}, true, true};

QosSettings with(std::initializer_list<dds::Qos> publishers, const QosSettings& settings = as_published) {
  PublishedQos published;
  for (const dds::Qos& one : publishers) {
    published.add(one);
  }
  return followed(settings, published);
}

TEST(PublishedQos, IsTheLeastThatAnyPublisherOffers) {
  const dds::Qos latched{.transient_local = true};
  const dds::Qos sensor{.reliable = false};
  EXPECT_EQ(with({}), as_published);
  EXPECT_TRUE(with({latched, latched}).transient_local);
  EXPECT_TRUE(with({latched, latched}).reliable);
  EXPECT_FALSE(with({latched, {}}).transient_local);
  EXPECT_TRUE(with({latched, {}}).reliable);
  EXPECT_FALSE(with({latched, sensor}).transient_local);
  EXPECT_FALSE(with({latched, sensor}).reliable);
  EXPECT_FALSE(with({{.reliable = false, .transient_local = true}}).transient_local) << "needs reliable";
}

TEST(PublishedQos, ChangesOnlyWhatFollows) {
  const QosSettings fixed{{.reliable = true, .transient_local = true}};
  EXPECT_EQ(with({{.reliable = false}}, fixed), fixed);
  const QosSettings reliability{{.reliable = true}, true};
  EXPECT_FALSE(with({{.reliable = false, .transient_local = true}}, reliability).reliable);
  EXPECT_FALSE(with({{.transient_local = true}}, reliability).transient_local);
}

std::string said_of(bool ours_reads, const std::string& policies, const dds::Qos& theirs) {
  dds::Happening event{};
  event.kind = dds::Happening::Kind::incompatible_qos;
  event.topic = "rt/a";
  event.detail = policies;
  event.ours_reads = ours_reads;
  event.theirs = theirs;
  event.ours = dds::Qos{};
  return carry::in_words(event);
}

TEST(DdsWords, NameWhatToWrite) {
  EXPECT_THAT(said_of(true, "reliability", {.reliable = false}),
              HasSubstr("`qos`: reliability; write `qos: {reliability: best_effort}`"));
  EXPECT_THAT(said_of(false, "reliability", {}), HasSubstr("write `qos: {reliability: reliable}`"));
  EXPECT_THAT(said_of(true, "durability, reliability", {.reliable = false}),
              HasSubstr("write `qos: {reliability: best_effort, durability: volatile}`"));
  EXPECT_THAT(said_of(false, "durability", {.transient_local = true}),
              HasSubstr("write `qos: {durability: transient_local}`"));
  EXPECT_THAT(said_of(true, "deadline", {.deadline = 300ms}), HasSubstr("write `qos: {deadline: 300 ms}`"));
  EXPECT_THAT(said_of(true, "deadline", {}), HasSubstr("; leave out `deadline`"));
  EXPECT_THAT(said_of(true, "liveliness", {.liveliness_lease = 2s}),
              HasSubstr("write `qos: {liveliness: automatic, liveliness_lease: 2 s}`"));
}

TEST(DdsWords, TellWhereAPolicyIsThatNoRouteHas) {
  EXPECT_THAT(said_of(true, "partition", {}), HasSubstr("take it out of the peer's settings"));
}

// Whatever the route says and the peer has: the suggestion, beside the keys that the route has, is taken.
TEST(DdsWords, NameWhatTheConfigurationTakes) {
  const std::regex suggestion{"`qos: \\{([^}]*)\\}`"};
  for (const bool ours_reads : {true, false}) {
    for (const char* const policies :
         {"reliability", "durability", "durability, reliability", "durability, deadline", "liveliness"}) {
      for (const auto& [reliability, durability] : {std::pair{"reliable", "volatile"},
                                                    {"reliable", "transient_local"},
                                                    {"best_effort", "volatile"}}) {
        for (const auto time : {0ns, 10ns, 1'500'000'000ns, 100'000'000'000'000ns}) {
          dds::Happening event{};
          event.kind = dds::Happening::Kind::incompatible_qos;
          event.topic = "rt/a";
          event.detail = policies;
          event.ours_reads = ours_reads;
          event.ours = dds::Qos{.reliable = std::string_view{reliability} == "reliable",
                                .transient_local = std::string_view{durability} == "transient_local"};
          event.theirs =
              dds::Qos{.deadline = time, .manual_liveliness = time == 10ns, .liveliness_lease = time};
          const std::string said = carry::in_words(event);
          std::smatch found;
          ASSERT_TRUE(std::regex_search(said, found, suggestion)) << said;
          std::string qos = found[1];
          for (const auto& [key, value] :
               {std::pair{"reliability", reliability}, {"durability", durability}}) {
            qos += qos.find(key) == std::string::npos ? fmt::format(", {}: {}", key, value) : "";
          }
          const auto loaded = carry::parse_config(
              fmt::format(
                  "someip: {{address: 127.0.0.1}}\nroutes:\n  - {{topic: /a, type: std_msgs/msg/String, "
                  "direction: {}, service: 1, instance: 1, eventgroup: 1, event: 0x8001{}, qos: {{{}}}}}\n",
                  ours_reads ? "dds_to_someip" : "someip_to_dds", ours_reads ? ", port: 40001" : "", qos),
              "bridge.yaml", {});
          EXPECT_TRUE(loaded) << said << ": " << (loaded ? "" : to_string(loaded.error().front()));
        }
      }
    }
  }
}

TEST(UserData, IsFoundByItsKey) {
  EXPECT_EQ(dds::user_data_value("a=1;typehash=RIHS01_00;b=2;", "typehash"), "RIHS01_00");
  EXPECT_EQ(dds::user_data_value("sertypehash=RIHS01_00;", "typehash"), "");
  EXPECT_EQ(dds::user_data_value("typehash", "typehash"), "");
  EXPECT_EQ(dds::user_data_value("typehash=x", "typehash"), "x");
  EXPECT_EQ(dds::user_data_value(";;;", "typehash"), "");
}

}  // namespace
}  // namespace trestle::test::published_qos_test
