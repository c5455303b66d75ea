// The keys by which ends of routes come and go with those at the other side.
#include <gmock/gmock.h>

#include "bridge/carry/commands/summary.hpp"
#include "test/bridge/carry/config/problems_of.hpp"

namespace trestle::test::presence_test {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;

// Line 4 is the first that is the route's own.
std::string with(const std::string& direction, const std::string& keys) {
  return "someip: {address: 127.0.0.1}\n"
         "routes:\n"
         "  - {topic: /a, type: std_msgs/msg/String, service: 1, instance: 2, eventgroup: 3, event: 0x8004,\n"
         "     direction: " +
         direction + ", " + keys + "}\n";
}

carry::Presence presence_of(const std::string& text) {
  const auto loaded = carry::parse_config(text, "b.yaml");
  if (!loaded) {
    ADD_FAILURE() << to_string(loaded.error().front());
    return {};
  }
  return loaded->config.routes.at(0).presence;
}

TEST(PresenceKeys, AreAllAlwaysByDefault) {
  EXPECT_EQ(presence_of(with("dds_to_someip", "port: 40001")), carry::Presence{});
  EXPECT_EQ(presence_of(with("someip_to_dds", "major: 1")), carry::Presence{});
  EXPECT_EQ(presence_of(with("dds_to_someip", "port: 40001, offer: always")), carry::Presence{});
  EXPECT_EQ(presence_of(with("someip_to_dds", "write: always, subscribe: always")), carry::Presence{});
}

TEST(PresenceKeys, AreReadOneByOne) {
  EXPECT_EQ(presence_of(with("dds_to_someip", "port: 40001, offer: while_published")),
            (carry::Presence{
                .offer_while_published = true, .write_while_offered = false, .subscribe_while_read = false}));
  EXPECT_EQ(presence_of(with("someip_to_dds", "write: while_offered")),
            (carry::Presence{
                .offer_while_published = false, .write_while_offered = true, .subscribe_while_read = false}));
  EXPECT_EQ(presence_of(with("someip_to_dds", "subscribe: while_read")),
            (carry::Presence{
                .offer_while_published = false, .write_while_offered = false, .subscribe_while_read = true}));
}

TEST(PresenceKeys, BelongToOneDirection) {
  EXPECT_THAT(problems_of(with("dds_to_someip", "port: 40001, write: while_offered, subscribe: always")),
              ElementsAre("b.yaml:4:52: error: write: is for routes with direction: someip_to_dds",
                          "b.yaml:4:78: error: subscribe: is for routes with direction: someip_to_dds"));
  EXPECT_THAT(problems_of(with("someip_to_dds", "offer: while_published")),
              ElementsAre("b.yaml:4:39: error: offer: is for routes with direction: dds_to_someip"));
}

TEST(PresenceKeys, KnowTheirWordsOnly) {
  EXPECT_THAT(
      problems_of(with("dds_to_someip", "port: 40001, offer: while_offered")),
      ElementsAre(
          "b.yaml:4:52: error: offer: expected one of always, while_published, found 'while_offered'"));
}

TEST(PresenceKeys, AreShownByCheck) {
  const auto summary = [](const std::string& text) {
    const auto loaded = carry::parse_config(text, "b.yaml");
    return loaded ? carry::summary(loaded->config, {}) : to_string(loaded.error().front());
  };
  EXPECT_THAT(summary(with("dds_to_someip", "port: 40001, offer: while_published")),
              HasSubstr("\n  there offered while published\n"));
  EXPECT_THAT(summary(with("someip_to_dds", "write: while_offered, subscribe: while_read")),
              HasSubstr("\n  there written while offered, subscribed to while read\n"));
  EXPECT_THAT(summary(with("someip_to_dds", "subscribe: while_read")),
              HasSubstr("\n  there subscribed to while read\n"));
  EXPECT_THAT(summary(with("someip_to_dds", "write: always")), testing::Not(HasSubstr("there")));
}

TEST(DdsLease, IsReadCheckedAndShown) {
  const auto with_lease = [](const std::string& lease) {
    return with("someip_to_dds", "major: 1") + "dds: {lease: " + lease + "}\n";
  };
  const auto loaded = carry::parse_config(with_lease("2.5 s"), "b.yaml");
  ASSERT_TRUE(loaded.has_value());
  EXPECT_EQ(loaded->config.dds.lease, 2500ms);
  EXPECT_THAT(carry::summary(loaded->config, {}), HasSubstr("domain 0, all interfaces, lease 2.5 s\n"));
  const auto usual = carry::parse_config(with("someip_to_dds", "major: 1"), "b.yaml");
  ASSERT_TRUE(usual.has_value());
  EXPECT_EQ(usual->config.dds.lease, 20s);
  EXPECT_THAT(carry::summary(usual->config, {}), HasSubstr("domain 0, all interfaces\n"));
  EXPECT_THAT(problems_of(with_lease("0.5 s")),
              ElementsAre(HasSubstr("b.yaml:5:14: error: lease: expected ")));
}

}  // namespace
}  // namespace trestle::test::presence_test
