#include "bridge/picture/picture_json.hpp"

#include <gmock/gmock.h>

namespace trestle::test::picture_json_test {
namespace {

using carry::Picture;
using testing::HasSubstr;
using testing::Not;

TEST(PictureJson, GoesBothWays) {
  Picture picture;
  picture.program = "1.2";
  picture.pid = 42;
  picture.someip.hosts = {{.address = "10.0.0.2", .port = 30490, .seen_s = 0.5, .offers = 3}};
  picture.dds.participants = {{.name = "talker", .guid = "01", .addresses = {"10.0.0.3"}}};
  picture.limits = {{"max_peers", 2, 64}};
  picture.counters = {{"SOME/IP", {{"datagrams_received", 7, "traffic"}}}};
  carry::RoutePicture route;
  route.kind = "event_to_topic";
  route.name = "/points";
  route.service = 0x1234;
  route.service_name = "Door";
  route.service_id_is_chosen = true;
  route.member_id_is_chosen = true;
  route.eventgroup_id_is_chosen = true;
  route.eventgroup_name = "motion";
  route.minor = 0xffff'ffff;
  route.per_second = 9.5;
  route.counters = {{"received", 12, "traffic"}};
  route.conversion = {.count = 1, .p50_ns = 2000, .max_ns = 2000, .sum_ns = 2000, .buckets = {{2047, 1}}};
  route.slowest = {{.at_ns = 5, .source_ns = -1, .convert_ns = 7}};
  route.someip.other_ids = {0x8002};
  route.dds.writers = {{.topic = "/points", .type = "a/msg/B", .node = "/n", .qos = {.reliable = false}}};
  route.state = carry::RouteState::failing;
  route.cause = {"dropped", "words"};
  picture.routes = {route};
  const std::string json = to_json(picture);
  EXPECT_THAT(json, HasSubstr("\"trestle\":1"));
  EXPECT_THAT(json, HasSubstr("\"state\":\"failing\""));
  EXPECT_THAT(json, HasSubstr("\"service\":4660"));
  EXPECT_THAT(json, HasSubstr("\"eventgroup_name\":\"motion\""));
  for (const char* const chosen : {"service", "member", "eventgroup"}) {
    EXPECT_THAT(json, HasSubstr(std::string{"\""} + chosen + "_id_is_chosen\":true"));
  }
  EXPECT_THAT(json, Not(HasSubstr("\n")));
  const auto again = carry::picture_from_json(json);
  ASSERT_TRUE(again) << again.error();
  EXPECT_EQ(to_json(*again), json);
  EXPECT_EQ(again->routes.at(0).dds.writers.at(0).qos, route.dds.writers.at(0).qos);
}

TEST(PictureJson, TakesWhatLacksMembersAndHasOthers) {
  const auto picture =
      carry::picture_from_json(R"({"trestle":1,"pid":3,"later":{},"routes":[{"name":"/a"}]})");
  ASSERT_TRUE(picture);
  EXPECT_EQ(picture->pid, 3U);
  EXPECT_EQ(picture->routes.at(0).name, "/a");
}

TEST(PictureJson, RefusesWhatIsNoPicture) {
  for (const char* const text : {"", "nothing", "[]", "{}", "{\"trestle\":2}",
                                 "{\"trestle\":1,\"pid\":\"x\"}", "{\"trestle\":1,\"routes\":[7]}"}) {
    EXPECT_FALSE(carry::picture_from_json(text)) << text;
  }
  EXPECT_THAT(carry::picture_from_json("{\"trestle\":2}").error(), HasSubstr("another version (2)"));
}

TEST(PictureJson, IsJsonWhateverOthersCallThemselves) {
  Picture picture;
  picture.dds.participants = {{.name = "\xff\xfe\"\n", .guid = "", .addresses = {}}};
  EXPECT_TRUE(carry::picture_from_json(to_json(picture)));
}

}  // namespace
}  // namespace trestle::test::picture_json_test
