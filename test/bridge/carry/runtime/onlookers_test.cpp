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
  const Bytes large(Onlooker::most_bytes + 1);
  onlooker.keep_payload(large);
  EXPECT_EQ(onlooker.newest()->size, large.size());
  EXPECT_TRUE(onlooker.newest()->bytes.empty());
}

}  // namespace
}  // namespace trestle::test::onlookers_test
