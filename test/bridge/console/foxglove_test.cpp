#include "bridge/console/foxglove.hpp"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

namespace trestle::console::foxglove::foxglove_test {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string fault_of(std::string_view text) {
  const auto wish = read_text(text);
  return wish ? "" : wish.error();
}

TEST(Foxglove, TakesTheFirstProtocolOfAClientThatIsOurs) {
  EXPECT_EQ(chosen_of("foxglove.websocket.v1"), "foxglove.websocket.v1");
  EXPECT_EQ(chosen_of("foxglove.sdk.v1,foxglove.websocket.v1"), "foxglove.sdk.v1");
  EXPECT_EQ(chosen_of("chat, \tfoxglove.websocket.v1 , foxglove.sdk.v1"), "foxglove.websocket.v1");
  EXPECT_THAT(chosen_of(""), IsEmpty());
  EXPECT_THAT(chosen_of(" , ,foxglove.sdk.v2, foxglove.sdk"), IsEmpty());
}

// As docs/spec.md of foxglove/ws-protocol has them.
TEST(Foxglove, WritesTheMessagesOfTheSpecification) {
  EXPECT_EQ(
      json::parse(server_info("a bridge", "1")),
      json::parse(R"({"op": "serverInfo", "name": "a bridge", "capabilities": [], "supportedEncodings": [],
                            "metadata": {}, "sessionId": "1"})"));
  EXPECT_EQ(json::parse(advertise(std::vector<Channel>{
                {1, "/talk", "cdr", "std_msgs/msg/String", "ros2msg", "string data\n"}})),
            json::parse(R"({"op": "advertise", "channels": [{"id": 1, "topic": "/talk", "encoding": "cdr",
                "schemaName": "std_msgs/msg/String", "schema": "string data\n", "schemaEncoding": "ros2msg"}]})"));
  EXPECT_EQ(json::parse(advertise({})), json::parse(R"({"op": "advertise", "channels": []})"));
  EXPECT_EQ(json::parse(unadvertise(std::vector<std::uint32_t>{1, 2})),
            json::parse(R"({"op": "unadvertise", "channelIds": [1, 2]})"));
  EXPECT_EQ(json::parse(status(Level::warning, "a \xff", "x")),
            json::parse(R"({"op": "status", "level": 1, "message": "a \ufffd", "id": "x"})"));
  EXPECT_EQ(message_head(0x01020304, 0x1122334455667788),
            (std::string{"\x01\x04\x03\x02\x01\x88\x77\x66\x55\x44\x33\x22\x11", message_head_bytes}));
}

TEST(Foxglove, ReadsWhatAClientWants) {
  const auto wish = read_text(R"({"op": "subscribe", "subscriptions": [{"id": 0, "channelId": 3},
                                                                        {"id": 4294967295, "channelId": 5, "x": {}}]})");
  ASSERT_TRUE(wish.has_value());
  EXPECT_THAT(std::get<Subscribe>(*wish).subscriptions,
              ElementsAre(Subscribe::One{0, 3}, Subscribe::One{0xffffffff, 5}));
  const auto end = read_text(R"({"op": "unsubscribe", "subscriptionIds": [0, 1]})");
  ASSERT_TRUE(end.has_value());
  EXPECT_THAT(std::get<Unsubscribe>(*end).ids, ElementsAre(0, 1));
}

TEST(Foxglove, KnowsWhatItDoesNotOffer) {
  for (const char* const what : {"advertise", "unadvertise", "getParameters", "setParameters", "fetchAsset",
                                 "subscribeConnectionGraph", "somethingNew"}) {
    const auto wish = read_text(json{{"op", what}}.dump());
    ASSERT_TRUE(wish.has_value());
    EXPECT_EQ(std::get<NotOffered>(*wish).what, what);
  }
  EXPECT_EQ(std::get<NotOffered>(*read_text(json{{"op", std::string(1000, 'a')}}.dump())).what.size(), 40U);
  EXPECT_TRUE(std::holds_alternative<NotOffered>(*read_bytes("\x01 a message")));
  EXPECT_TRUE(std::holds_alternative<NotOffered>(*read_bytes("\x02")));
}

TEST(Foxglove, SaysWhatIsWrongWithWhatComes) {
  EXPECT_THAT(fault_of(""), HasSubstr("no JSON object"));
  EXPECT_THAT(fault_of("{\"op\":"), HasSubstr("no JSON object"));
  EXPECT_THAT(fault_of("[]"), HasSubstr("no JSON object"));
  EXPECT_THAT(fault_of(std::string(200'000, '[')), HasSubstr("no JSON object"));
  EXPECT_THAT(fault_of("{}"), HasSubstr("no text `op`"));
  EXPECT_THAT(fault_of(R"({"op": 1})"), HasSubstr("no text `op`"));
  EXPECT_THAT(fault_of(R"({"op": "subscribe"})"), HasSubstr("no array `subscriptions`"));
  EXPECT_THAT(fault_of(R"({"op": "subscribe", "subscriptions": {}})"), HasSubstr("no array"));
  for (const char* const one :
       {"1", "{}", R"({"id": 1})", R"({"id": -1, "channelId": 1})", R"({"id": 1.5, "channelId": 1})",
        R"({"id": 4294967296, "channelId": 1})", R"({"id": "1", "channelId": 1})"}) {
    EXPECT_THAT(fault_of(R"({"op": "subscribe", "subscriptions": [)" + std::string{one} + "]}"),
                HasSubstr("expected {"))
        << one;
  }
  EXPECT_THAT(fault_of(R"({"op": "unsubscribe", "subscriptionIds": 1})"), HasSubstr("no array"));
  EXPECT_THAT(fault_of(R"({"op": "unsubscribe", "subscriptionIds": ["a"]})"), HasSubstr("numbers"));
  EXPECT_FALSE(read_bytes("").has_value());
  EXPECT_FALSE(read_bytes("\x03").has_value());
}

}  // namespace
}  // namespace trestle::console::foxglove::foxglove_test
