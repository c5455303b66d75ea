#include "bridge/console/viewer.hpp"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "bridge/console/inbox.hpp"

namespace trestle::console::viewer_test {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<foxglove::Channel> channel(std::uint32_t id, const std::string& topic) {
  return {{id, topic, "cdr", "a/msg/B", "ros2msg", ""}};
}

MessageBytes bytes(std::size_t size) {
  return std::make_shared<const std::vector<std::byte>>(size);
}

class ViewerTest : public testing::Test {
 protected:
  ViewerTest() {
    viewer_.offer(channel(1, "/one"));
    viewer_.offer(channel(2, "/two"));
    EXPECT_EQ(text(), "{}");
    EXPECT_EQ(json::parse(text())["op"], "advertise");
    EXPECT_EQ(json::parse(text())["op"], "advertise");
  }
  void subscribe(std::uint32_t id, std::uint32_t channel) {
    const json wish{{"op", "subscribe"}, {"subscriptions", {{{"id", id}, {"channelId", channel}}}}};
    EXPECT_TRUE(viewer_.on_text(wish.dump()).has_value());
  }
  /// What waits, which is a text; or nothing.
  std::string text() {
    const auto frame = viewer_.next();
    return frame && frame->is_text ? frame->head : std::string{};
  }
  std::string status() {
    const std::string message = text();
    return message.empty() ? std::string{} : json::parse(message)["message"].get<std::string>();
  }
  /// The sizes of messages that are sent.
  std::vector<std::size_t> sizes() {
    std::vector<std::size_t> result;
    while (const auto frame = viewer_.next()) {
      if (!frame->is_text) {
        result.push_back(frame->bytes->size());
      }
    }
    return result;
  }

  Viewer viewer_{"{}",
                 {.subscriptions = 2,
                  .queued_bytes = 100,
                  .queued_messages = 3,
                  .queued_texts = 10,
                  .queued_text_bytes = 1000}};
};

TEST_F(ViewerTest, GetsWhatItHasSubscribedTo) {
  viewer_.add(1, 5, bytes(10));
  EXPECT_FALSE(viewer_.next().has_value()) << "it has not asked for it";
  subscribe(7, 1);
  EXPECT_THAT(viewer_.wanted(), ElementsAre(1));
  viewer_.add(1, 5, bytes(10));
  viewer_.add(2, 5, bytes(20));
  const auto frame = viewer_.next();
  ASSERT_TRUE(frame.has_value());
  EXPECT_FALSE(frame->is_text);
  EXPECT_EQ(frame->head, foxglove::message_head(7, 5));
  EXPECT_EQ(frame->bytes->size(), 10U);
  EXPECT_FALSE(viewer_.next().has_value());
  EXPECT_EQ(viewer_.sent(), 1U);
}

TEST_F(ViewerTest, GetsNothingAfterItHasUnsubscribedNotEvenWhatWaited) {
  subscribe(7, 1);
  subscribe(8, 2);
  viewer_.add(1, 5, bytes(10));
  viewer_.add(2, 5, bytes(20));
  EXPECT_TRUE(viewer_.on_text(R"({"op": "unsubscribe", "subscriptionIds": [7]})").has_value());
  EXPECT_EQ(viewer_.queued_bytes(), 20U);
  viewer_.add(1, 5, bytes(10));
  EXPECT_THAT(sizes(), ElementsAre(20));
  subscribe(7, 1);
  EXPECT_TRUE(viewer_.wants(1)) << "the number may be used again";
}

TEST_F(ViewerTest, LosesTheOldestWhereItReadsTooSlowlyAndIsToldSo) {
  subscribe(7, 1);
  for (const std::size_t size : {10U, 20U, 30U, 40U}) {
    viewer_.add(1, 5, bytes(size));
  }
  EXPECT_EQ(status(), "messages not sent, because this viewer reads too slowly: 1; the last one of /one");
  EXPECT_THAT(sizes(), ElementsAre(20, 30, 40)) << "at most three wait";
  viewer_.add(1, 5, bytes(60));
  viewer_.add(1, 5, bytes(50));
  EXPECT_THAT(sizes(), ElementsAre(50)) << "at most 100 bytes wait";
  EXPECT_EQ(viewer_.queued_bytes(), 0U);
  EXPECT_THAT(viewer_.lost(), ElementsAre(2, 0, 0));
}

TEST_F(ViewerTest, IsToldOfTheFirstTheTenthAndTheHundredthLoss) {
  subscribe(7, 1);
  std::vector<std::string> told;
  for (int i = 0; i < 250; ++i) {
    viewer_.lose(1, ViewerLoss::unreadable, 1, "too short");
    if (std::string one = status(); !one.empty()) {
      told.push_back(one.substr(one.find(": ") + 2, one.find(';') - one.find(": ") - 2));
    }
  }
  EXPECT_THAT(told, ElementsAre("1", "10", "100"));
  viewer_.lose(1, ViewerLoss::unreadable, 5000, "too short");
  EXPECT_EQ(status(),
            "messages not sent, because they cannot be converted: 5250; the last one of /one: too short");
  viewer_.lose(2, ViewerLoss::slow);
  EXPECT_THAT(status(), IsEmpty()) << "it does not want that channel";
}

TEST_F(ViewerTest, GetsNothingThatIsTooLarge) {
  subscribe(7, 1);
  viewer_.add(1, 5, bytes(10));
  viewer_.add(1, 5, bytes(101));
  EXPECT_THAT(status(), HasSubstr("they are too large"));
  EXPECT_THAT(sizes(), ElementsAre(10)) << "what waits stays";
  EXPECT_THAT(viewer_.lost(), ElementsAre(0, 1, 0));
}

TEST_F(ViewerTest, MayHaveSoManySubscriptionsEachOnce) {
  viewer_.offer(channel(3, "/three"));
  text();
  subscribe(7, 9);
  EXPECT_EQ(status(), "there is no channel 9");
  subscribe(7, 1);
  subscribe(7, 2);
  EXPECT_EQ(status(), "subscription 7 is there already");
  subscribe(8, 1);
  EXPECT_EQ(status(), "channel 1 has a subscription already");
  subscribe(8, 2);
  subscribe(9, 3);
  EXPECT_EQ(status(), "a viewer may have 2 subscriptions");
  EXPECT_THAT(viewer_.wanted(), ElementsAre(1, 2));
}

TEST_F(ViewerTest, LosesChannelsThatAreThereNoLonger) {
  subscribe(7, 1);
  viewer_.add(1, 5, bytes(10));
  viewer_.withdraw(std::vector<std::uint32_t>{1});
  EXPECT_THAT(viewer_.wanted(), IsEmpty());
  EXPECT_EQ(json::parse(text())["op"], "unadvertise");
  EXPECT_FALSE(viewer_.next().has_value());
  subscribe(7, 1);
  EXPECT_EQ(status(), "there is no channel 1");
}

TEST_F(ViewerTest, ChangesNothing) {
  EXPECT_TRUE(viewer_.on_text(R"({"op": "advertise", "channels": []})").has_value());
  EXPECT_THAT(status(), HasSubstr("advertise: this bridge only shows"));
  EXPECT_TRUE(viewer_.on_bytes("\x01").has_value());
  EXPECT_THAT(status(), HasSubstr("publishing of messages: this bridge only shows"));
  EXPECT_FALSE(viewer_.on_text("hello").has_value());
  EXPECT_FALSE(viewer_.on_bytes("").has_value());
  EXPECT_TRUE(viewer_.on_text(R"({"op": "unsubscribe", "subscriptionIds": [5]})").has_value());
  EXPECT_EQ(status(), "there is no subscription 5");
}

TEST_F(ViewerTest, IsLostWhenItReadsNothingOfWhatItAskedFor) {
  for (int i = 0; i < 10; ++i) {
    subscribe(7, 9);
  }
  EXPECT_FALSE(viewer_.is_lost());
  subscribe(7, 9);
  EXPECT_TRUE(viewer_.is_lost());
  subscribe(7, 9);
  std::size_t texts = 0;
  while (!text().empty()) {
    ++texts;
  }
  EXPECT_EQ(texts, 11U) << "then nothing more waits for it";
}

TEST_F(ViewerTest, IsLostWhenItReadsNothingOfLongTexts) {
  viewer_.offer(channel(3, std::string(200, 'a')));
  EXPECT_FALSE(viewer_.is_lost()) << "of one text a client has to take whatever length it has";
  viewer_.offer(channel(4, std::string(200, 'a')));
  EXPECT_FALSE(viewer_.is_lost());
  viewer_.offer(channel(5, std::string(1000, 'a')));
  EXPECT_TRUE(viewer_.is_lost());
}

TEST_F(ViewerTest, IsToldInOneTextWhatIsWrongWithAList) {
  EXPECT_TRUE(viewer_
                  .on_text(R"({"op": "subscribe", "subscriptions": [{"id": 7, "channelId": 8},
                               {"id": 7, "channelId": 1}, {"id": 7, "channelId": 2}]})")
                  .has_value());
  EXPECT_EQ(status(), "there is no channel 8; and 1 more");
  EXPECT_THAT(viewer_.wanted(), ElementsAre(1));
  EXPECT_TRUE(viewer_.on_text(R"({"op": "unsubscribe", "subscriptionIds": [1, 2, 7, 3]})").has_value());
  EXPECT_EQ(status(), "there is no subscription 1; and 2 more");
  EXPECT_THAT(viewer_.wanted(), IsEmpty());
  EXPECT_THAT(text(), IsEmpty());
}

TEST_F(ViewerTest, GetsNothingOnceItIsGivenUp) {
  subscribe(7, 1);
  viewer_.add(1, 5, bytes(10));
  viewer_.give_up();
  viewer_.add(1, 5, bytes(10));
  viewer_.offer(channel(3, "/three"));
  EXPECT_TRUE(viewer_.is_lost());
  EXPECT_THAT(viewer_.wanted(), IsEmpty());
  EXPECT_EQ(viewer_.queued_bytes(), 0U);
  EXPECT_FALSE(viewer_.next().has_value());
}

carry::SeenMessage seen(std::size_t size) {
  return {.bytes = std::vector<std::byte>(size), .size = size};
}

TEST(Inbox, LosesTheOldestWhereTooMuchLiesThere) {
  const auto message = std::make_shared<const carry::SeenMessage>(seen(Inbox::most_bytes / 2));
  Inbox inbox;
  EXPECT_TRUE(inbox.add({1, message})) << "somebody is to be told";
  EXPECT_FALSE(inbox.add({2, message}));
  EXPECT_FALSE(inbox.add({3, message}));
  const auto content = inbox.take();
  ASSERT_EQ(content.messages.size(), 2U);
  EXPECT_EQ(content.messages[0].route, 2U);
  EXPECT_THAT(content.lost, ElementsAre(std::pair{1, 1}));
  EXPECT_TRUE(inbox.add({1, message}));
  EXPECT_THAT(inbox.take().lost, IsEmpty());
}

TEST(Inbox, HoldsSoManyMessages) {
  const auto message = std::make_shared<const carry::SeenMessage>(seen(0));
  Inbox inbox;
  for (std::size_t i = 0; i < Inbox::most_messages + 5; ++i) {
    static_cast<void>(inbox.add({1, message}));
  }
  const auto content = inbox.take();
  EXPECT_EQ(content.messages.size(), Inbox::most_messages);
  EXPECT_THAT(content.lost, ElementsAre(std::pair{1, 5}));
}

}  // namespace
}  // namespace trestle::console::viewer_test
