#include "test/bridge/carry/runtime/route_test.hpp"

namespace trestle::test::method_to_service_test {
namespace {

using someip::ReturnCode;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;
using testing::SizeIs;
using namespace std::chrono_literals;

// std_srvs/srv/SetBool: {bool data} and {bool success, string message}.
const Bytes on = hex("01");
const Bytes on_cdr = hex("00010000 01");
const Bytes done = hex("01 00000004 efbbbf 00");
const Bytes done_cdr = hex("00010000 01 000000 01000000 00");

class MethodToServiceTest : public RouteTest {
 protected:
  MethodToServiceTest() { config_.methods = {method(carry::Server::ros)}; }
  carry::MethodRoute& settings() { return config_.methods.front(); }
  void start_ready() {
    start();
    dds_.wake();
    work();
  }
  void end(std::size_t call, tl::expected<dds::ServiceMessage, dds::CallFault> how) {
    std::exchange(dds_.called.at(call).handler, nullptr)(std::move(how));
  }
  void reply(std::size_t call, const Bytes& cdr) { end(call, dds::ServiceMessage{cdr}); }
  void fail(std::size_t call, dds::CallFault why) { end(call, tl::unexpected{why}); }
};

TEST_F(MethodToServiceTest, CarriesACallAndItsAnswer) {
  start_ready();
  someip_.request(on);
  ASSERT_EQ(dds_.called.size(), 1U);
  EXPECT_EQ(dds_.called.front().request, on_cdr);
  EXPECT_EQ(count("in_flight"), 1U);
  reply(0, done_cdr);
  EXPECT_THAT(someip_.answers, ElementsAre(Pair(ReturnCode::ok, done)));
  EXPECT_EQ(count("received"), 1U);
  EXPECT_EQ(count("answered"), 1U);
  EXPECT_EQ(count("in_flight"), 0U);
}

TEST_F(MethodToServiceTest, CountsAndAnswersWhatCannotBeConverted) {
  start_ready();
  someip_.request({});
  EXPECT_THAT(someip_.answers, ElementsAre(Pair(ReturnCode::malformed_message, IsEmpty())));
  EXPECT_EQ(count("not_convertible"), 1U);
  EXPECT_THAT(dds_.called, IsEmpty());
  someip_.request(on);
  reply(0, wrong);
  EXPECT_EQ(someip_.answers.back().first, ReturnCode::not_ok);
  EXPECT_EQ(count("answers_not_convertible"), 1U);
}

TEST_F(MethodToServiceTest, RefusesWhatIsTooLarge) {
  settings().tp.max_message = 1;
  start_ready();
  someip_.request(hex("01 00"));
  EXPECT_THAT(someip_.answers, ElementsAre(Pair(ReturnCode::not_ok, IsEmpty())));
  EXPECT_EQ(count("too_large"), 1U);
  someip_.request(on);
  reply(0, done_cdr);
  EXPECT_EQ(someip_.answers.back().first, ReturnCode::not_ok);
  EXPECT_EQ(count("answers_too_large"), 1U);
}

TEST_F(MethodToServiceTest, AnswersWithTheReasonOfACallThatFails) {
  start_ready();
  const auto answer_to = [&](dds::CallFault why) {
    someip_.request(on);
    fail(dds_.called.size() - 1, why);
    return someip_.answers.back().first;
  };
  EXPECT_EQ(answer_to(dds::CallFault::unavailable), ReturnCode::not_ready);
  EXPECT_EQ(answer_to(dds::CallFault::too_many), ReturnCode::not_ready);
  EXPECT_EQ(answer_to(dds::CallFault::gone), ReturnCode::not_reachable);
  EXPECT_EQ(answer_to(dds::CallFault::timed_out), ReturnCode::timeout);
  EXPECT_EQ(answer_to(dds::CallFault::not_written), ReturnCode::not_ok);
  EXPECT_EQ(count("answered"), 0U);
  EXPECT_EQ(count("in_flight"), 0U);
}

TEST_F(MethodToServiceTest, AnswersWhenTheTimeoutIsOver) {
  settings().timeout = 3s;
  start_ready();
  someip_.request(on);
  pass(1s);
  someip_.request(on);
  pass(2s - 1ns);
  EXPECT_THAT(someip_.answers, IsEmpty());
  pass(1ns);
  EXPECT_THAT(someip_.answers, ElementsAre(Pair(ReturnCode::timeout, IsEmpty())));
  EXPECT_EQ(count("in_flight"), 1U);
  reply(1, done_cdr);
  pass(1h);
  EXPECT_THAT(someip_.answers, SizeIs(2));
  EXPECT_EQ(someip_.answers.back().first, ReturnCode::ok);
}

TEST_F(MethodToServiceTest, ForgetsACallerWhoHasBeenSilentForAMinute) {
  settings().max_calls = 4;
  settings().timeout = 1h;
  start_ready();
  const auto request_of = [&](std::uint8_t host) {
    someip_.request(on, 0, nullptr, {IpAddress::v4(10, 0, 0, host), 30490});
    return count("in_flight");
  };
  request_of(2);
  reply(0, done_cdr);
  for (int i = 0; i < 10; ++i) {
    request_of(1);
  }
  EXPECT_EQ(count("in_flight"), 2U) << "half is left to the other";
  pass(1min - 1ns);
  EXPECT_EQ(request_of(1), 2U);
  pass(1ns);
  EXPECT_EQ(request_of(1), 3U);
}

TEST_F(MethodToServiceTest, CountsAnAnswerThatCannotBeSent) {
  start_ready();
  someip_.sends_answers = false;
  someip_.request(on);
  reply(0, done_cdr);
  EXPECT_EQ(count("answers_not_sent"), 1U);
  EXPECT_EQ(count("answered"), 0U);
}

TEST_F(MethodToServiceTest, LetsNoCallerTakeAllPlaces) {
  settings().max_calls = 8;
  start_ready();
  const auto request_of = [&](std::uint8_t host) {
    someip_.request(on, 0, nullptr, {IpAddress::v4(10, 0, 0, host), 30490});
    return dds_.called.size();
  };
  request_of(2);
  reply(0, done_cdr);
  someip_.answers.clear();
  for (int i = 0; i < 100; ++i) {
    request_of(1);
  }
  EXPECT_EQ(count("in_flight"), 4U);
  EXPECT_EQ(count("over_share"), 96U);
  EXPECT_EQ(someip_.answers.size(), 96U);
  EXPECT_EQ(someip_.answers.back().first, ReturnCode::not_ready);
  EXPECT_EQ(request_of(2), 6U) << "of the other";
  reply(1, done_cdr);
  EXPECT_EQ(request_of(1), 7U) << "a place that it had";
}

TEST_F(MethodToServiceTest, OffersTheMethodWhileTheServiceIsThere) {
  dds_.ready = false;
  start_ready();
  EXPECT_FALSE(someip_.offered);
  EXPECT_EQ(state(), "WARN: the ROS service is not there");
  int changes = 0;
  route_at(0).on_change([&] { ++changes; });
  dds_.ready = true;
  dds_.wake();
  work();
  EXPECT_TRUE(someip_.offered);
  EXPECT_EQ(state(), "OK: ready");
  EXPECT_EQ(changes, 1);
}

TEST_F(MethodToServiceTest, LooksForNothingOnceItIsStopped) {
  dds_.ready = false;
  start_ready();
  routes_->stop();
  dds_.ready = true;
  dds_.wake();
  work();
  EXPECT_FALSE(someip_.offered);
  EXPECT_EQ(state(), "WARN: the ROS service is not there");
}

}  // namespace
}  // namespace trestle::test::method_to_service_test
