#include "bridge/carry/runtime/onlookers.hpp"

#include "test/bridge/carry/runtime/route_test.hpp"

namespace trestle::test::onlookers_test {
namespace {

using namespace std::chrono_literals;
using carry::Onlooker;
using carry::Onlookers;

class OnlookersTest : public RouteTest {
 protected:
  void start_with(carry::Direction direction, std::size_t routes = 1) {
    for (std::size_t i = 0; i < routes; ++i) {
      config_.routes.push_back(route(direction));
      config_.routes.back().event = someip::MethodId{static_cast<std::uint16_t>(0x8001 + i)};
    }
    start();
    onlookers_.emplace(clock_);
  }
  [[nodiscard]] std::shared_ptr<const carry::SeenMessage> look(std::size_t index = 0) {
    return onlookers_->look((routes_->begin() + static_cast<std::ptrdiff_t>(index))->route);
  }
  void send(const Bytes& payload) {
    someip_.on_event({.payload = payload}, {IpAddress::v4(10, 0, 0, 2), 30501});
  }

  std::optional<Onlookers> onlookers_;
};

TEST_F(OnlookersTest, SeeWhatComesFromSomeipAlsoWhatCannotBeCarried) {
  start_with(carry::Direction::someip_to_dds);
  send(hello);
  EXPECT_EQ(look(), nullptr) << "nobody looked when it came";
  send(hello);
  ASSERT_NE(look(), nullptr);
  EXPECT_FALSE(look()->is_cdr);
  EXPECT_EQ(look()->bytes, hello);
  EXPECT_EQ(look()->size, hello.size());
  EXPECT_EQ(look()->at_ns, clock_.since_1970().count());
  send(wrong);
  EXPECT_EQ(look()->bytes, wrong);
  EXPECT_EQ(count("not_convertible"), 1U);
}

TEST_F(OnlookersTest, SeeWhatComesFromDdsAlsoWhenNobodySubscribes) {
  start_with(carry::Direction::dds_to_someip);
  someip_.subscriber_count = 0;
  EXPECT_EQ(look(), nullptr);
  dds_.on_sample(dds::Sample{hello_cdr, {}, 1});
  work();
  ASSERT_NE(look(), nullptr);
  EXPECT_TRUE(look()->is_cdr);
  EXPECT_EQ(look()->bytes, hello_cdr);
  EXPECT_EQ(count("no_subscriber"), 1U);
}

TEST_F(OnlookersTest, KeepNothingSomeSecondsAfterTheLastLook) {
  start_with(carry::Direction::someip_to_dds);
  EXPECT_EQ(look(), nullptr);
  pass(Onlookers::look_for - 1s);
  EXPECT_EQ(look(), nullptr);
  pass(Onlookers::look_for - 1s);
  send(hello);
  EXPECT_EQ(onlookers_->size(), 1U);
  pass(2s);
  EXPECT_EQ(onlookers_->size(), 0U);
  send(hello);
  EXPECT_EQ(look(), nullptr) << "what came before is gone";
}

TEST_F(OnlookersTest, AreFew) {
  start_with(carry::Direction::someip_to_dds, Onlookers::most_routes + 1);
  for (std::size_t i = 0; i <= Onlookers::most_routes; ++i) {
    EXPECT_EQ(look(i), nullptr);
    pass(1ms);
  }
  EXPECT_EQ(onlookers_->size(), Onlookers::most_routes);
}

TEST_F(OnlookersTest, LeaveARouteThatEnds) {
  start_with(carry::Direction::someip_to_dds);
  EXPECT_EQ(look(), nullptr);
  routes_.reset();
  pass(Onlookers::look_for);
  EXPECT_EQ(onlookers_->size(), 0U);
}

TEST_F(OnlookersTest, LeaveTheRoutesAtTheirOwnEnd) {
  start_with(carry::Direction::someip_to_dds);
  EXPECT_EQ(look(), nullptr);
  onlookers_.reset();
  send(hello);
  EXPECT_EQ(count("carried"), 1U);
}

TEST_F(OnlookersTest, CopyLargeMessagesOnlySoOften) {
  Onlooker onlooker{clock_};
  onlooker.ask(true);
  Bytes large(Onlooker::often_bytes + 1);
  onlooker.keep_payload(large);
  large[0] = std::byte{1};
  onlooker.keep_payload(large);
  EXPECT_EQ(onlooker.newest()->bytes[0], std::byte{0});
  clock_.pass(Onlooker::spacing);
  onlooker.keep_payload(large);
  EXPECT_EQ(onlooker.newest()->bytes[0], std::byte{1});
  const Bytes small(Onlooker::often_bytes);
  onlooker.keep_sample(small);
  EXPECT_EQ(onlooker.newest()->bytes, small) << "small ones each time";
}

TEST_F(OnlookersTest, DoNotCopyWhatIsTooLarge) {
  Onlooker onlooker{clock_};
  onlooker.ask(true);
  const Bytes large(Onlooker::most_bytes + 1);
  onlooker.keep_payload(large);
  EXPECT_EQ(onlooker.newest()->size, large.size());
  EXPECT_TRUE(onlooker.newest()->bytes.empty());
}

class FollowedTest : public OnlookersTest {
 protected:
  [[nodiscard]] std::shared_ptr<void> follow(std::size_t index = 0) {
    return onlookers_->follow((routes_->begin() + static_cast<std::ptrdiff_t>(index))->route,
                              [this](const auto& message) { seen_.push_back(message); });
  }
  std::vector<std::shared_ptr<const carry::SeenMessage>> seen_;
};

TEST_F(FollowedTest, ShowEachMessageUntilTheEnd) {
  start_with(carry::Direction::someip_to_dds);
  auto one = follow();
  auto other = follow();
  send(hello);
  ASSERT_EQ(seen_.size(), 2U);
  EXPECT_EQ(seen_[0], seen_[1]) << "one copy for all";
  EXPECT_EQ(seen_[0]->bytes, hello);
  pass(10 * Onlookers::look_for);
  send(wrong);
  EXPECT_EQ(seen_.size(), 4U) << "who follows need not ask again";
  one.reset();
  send(hello);
  EXPECT_EQ(seen_.size(), 5U);
  other.reset();
  EXPECT_EQ(onlookers_->size(), 0U);
  send(hello);
  EXPECT_EQ(seen_.size(), 5U);
}

TEST_F(FollowedTest, GoOnAfterSomebodyHasLooked) {
  start_with(carry::Direction::someip_to_dds);
  auto follower = follow();
  EXPECT_EQ(look(), nullptr);
  send(hello);
  EXPECT_EQ(seen_.size(), 1U);
  EXPECT_EQ(look(), seen_[0]) << "one copy for all";
  pass(2 * Onlookers::look_for);
  send(hello);
  EXPECT_EQ(seen_.size(), 2U);
  EXPECT_EQ(look(), nullptr) << "nobody looked when it came";
  follower.reset();
  send(hello);
  EXPECT_EQ(seen_.size(), 2U);
  EXPECT_NE(look(), nullptr) << "somebody still looks";
  pass(2 * Onlookers::look_for);
  EXPECT_EQ(onlookers_->size(), 0U);
}

TEST_F(FollowedTest, KeepNothing) {
  start_with(carry::Direction::someip_to_dds);
  const auto follower = follow();
  send(hello);
  ASSERT_EQ(seen_.size(), 1U);
  EXPECT_EQ(seen_[0].use_count(), 1) << "a thousand routes may be followed";
  EXPECT_EQ(look(), nullptr);
  send(hello);
  EXPECT_EQ(seen_[1].use_count(), 2);
  pass(2 * Onlookers::look_for);
  EXPECT_EQ(seen_[1].use_count(), 1);
}

TEST_F(FollowedTest, AreAskedAboutLikeOthers) {
  start_with(carry::Direction::someip_to_dds, Onlookers::most_routes + 1);
  const std::size_t followed = Onlookers::most_routes;  // the last one: that is sent to
  const auto follower = follow(followed);
  EXPECT_EQ(look(followed), nullptr);
  for (std::size_t i = 0; i < Onlookers::most_routes; ++i) {
    pass(1ms);
    EXPECT_EQ(look(i), nullptr);
  }
  EXPECT_EQ(onlookers_->size(), Onlookers::most_routes + 1);
  send(hello);
  ASSERT_EQ(seen_.size(), 1U);
  EXPECT_EQ(seen_[0].use_count(), 1) << "four others were asked about since";
}

TEST_F(FollowedTest, ShowEachLargeMessage) {
  start_with(carry::Direction::someip_to_dds);
  const auto follower = follow();
  const Bytes large(Onlooker::often_bytes + 1);
  send(large);
  send(large);
  EXPECT_EQ(seen_.size(), 2U);
}

TEST_F(FollowedTest, LeaveNothingOfARouteThatHasEnded) {
  start_with(carry::Direction::someip_to_dds);
  auto follower = follow();
  routes_.reset();
  EXPECT_EQ(onlookers_->size(), 1U);
  follower.reset();
  EXPECT_EQ(onlookers_->size(), 0U);
}

TEST_F(FollowedTest, MayEndBeforeWhoFollows) {
  start_with(carry::Direction::someip_to_dds);
  const auto of_the_route = follow();
  routes_.reset();
  onlookers_.reset();
}

}  // namespace
}  // namespace trestle::test::onlookers_test
