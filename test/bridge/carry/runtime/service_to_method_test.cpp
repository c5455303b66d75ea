#include "sd/net/call_errors.hpp"
#include "test/bridge/carry/runtime/route_test.hpp"

namespace trestle::test::service_to_method_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::MatchesRegex;
using testing::SizeIs;
using namespace std::chrono_literals;

// std_srvs/srv/SetBool: {bool data} and {bool success, string message}.
const Bytes on = hex("01");
const Bytes on_cdr = hex("00010000 01");
const Bytes done = hex("01 00000004 efbbbf 00");
const Bytes done_cdr = hex("00010000 01 000000 01000000 00");

class ServiceToMethodTest : public RouteTest {
 protected:
  ServiceToMethodTest() { config_.methods = {method(carry::Server::someip)}; }
  carry::MethodRoute& settings() { return config_.methods.front(); }
  void start_there() {
    start();
    someip_.service_comes_or_goes(true);
    work();
  }
  void request(const Bytes& cdr) { dds_.on_request({}, dds::ServiceMessage{cdr}); }
  /// A request of one of the clients of a participant. Gives how many have been put to the SOME/IP service.
  std::size_t request_of(std::uint8_t participant, std::uint8_t client = 0) {
    dds::RequestId id;
    id.request.writer.front() = static_cast<std::byte>(participant);
    id.request.writer.back() = static_cast<std::byte>(client);
    dds_.on_request(id, dds::ServiceMessage{on_cdr});
    return someip_.called.size();
  }
  /// The `message` of the last answer.
  std::string said() const {
    const Bytes& reply = dds_.replies.back();
    std::string text;
    for (std::size_t i = 12; i + 1 < reply.size() && reply[i] != std::byte{0}; ++i) {
      text += static_cast<char>(reply[i]);
    }
    return text;
  }
};

TEST_F(ServiceToMethodTest, CarriesACallAndItsAnswer) {
  start_there();
  request(on_cdr);
  ASSERT_THAT(someip_.called, SizeIs(1));
  EXPECT_EQ(someip_.called.front().payload, on);
  EXPECT_EQ(someip_.called.front().spec.method, someip::MethodId{0x21});
  EXPECT_EQ(count("in_flight"), 1U);
  someip_.respond(0, {}, done);
  EXPECT_THAT(dds_.replies, ElementsAre(done_cdr));
  EXPECT_EQ(count("received"), 1U);
  EXPECT_EQ(count("answered"), 1U);
  EXPECT_EQ(count("in_flight"), 0U);
}

TEST_F(ServiceToMethodTest, CountsAndAnswersWhatCannotBeConverted) {
  start_there();
  request(hex("000100ff"));
  EXPECT_THAT(someip_.called, IsEmpty());
  EXPECT_EQ(count("not_convertible"), 1U);
  EXPECT_EQ(count("failures_answered"), 1U);
  ASSERT_THAT(dds_.replies, SizeIs(1));
  EXPECT_EQ(dds_.replies.front()[4], std::byte{0}) << "no success";
  EXPECT_EQ(count("in_flight"), 0U);
  request(on_cdr);
  someip_.respond(0, {}, hex("01"));
  EXPECT_EQ(count("answers_not_convertible"), 1U);
}

TEST_F(ServiceToMethodTest, TellsWhatStandsInTheWayOfAConversion) {
  start_there();
  request(hex("00010000 07"));
  EXPECT_THAT(said(), MatchesRegex("the request cannot be converted: .* \\(of 5 bytes; there stands 07\\)"));
  request(on_cdr);
  someip_.respond(0, {}, hex("01 00000005 68656c6c6f"));
  EXPECT_THAT(said(),
              MatchesRegex("the answer cannot be converted: .* \\(of 10 bytes; there stands .*68 65 6c.*"
                           "without a byte order mark: write `wire: \\{string_bom: false\\}`"));
}

TEST_F(ServiceToMethodTest, RefusesMoreCallsThanMayWait) {
  start_there();
  request(on_cdr);
  request(on_cdr);
  request(on_cdr);
  EXPECT_THAT(someip_.called, SizeIs(2));
  EXPECT_EQ(count("too_many"), 1U);
  EXPECT_EQ(count("failures_answered"), 1U);
  someip_.respond(0, {}, done);
  request(on_cdr);
  EXPECT_THAT(someip_.called, SizeIs(3));
}

TEST_F(ServiceToMethodTest, LetsNoParticipantTakeAllPlaces) {
  settings().max_calls = 8;
  start_there();
  request_of(2);
  someip_.respond(0, {}, done);
  dds_.replies.clear();
  for (std::uint8_t i = 0; i < 100; ++i) {
    request_of(1, i);  // each of another client of it
  }
  EXPECT_EQ(count("in_flight"), 4U);
  EXPECT_EQ(count("over_share"), 96U);
  EXPECT_EQ(count("too_many"), 0U);
  EXPECT_THAT(dds_.replies, SizeIs(96)) << "each is told so";
  EXPECT_EQ(said(), "participant 010000000000000000000000 has its share of `max_calls`, 4 of 8 wait");
  EXPECT_EQ(request_of(2), 6U) << "of the other";
  someip_.respond(1, {}, done);
  EXPECT_EQ(request_of(1), 7U) << "a place that it had";
}

TEST_F(ServiceToMethodTest, GivesWhoComesLateThePlacesThatBecomeFree) {
  settings().max_calls = 4;
  start_there();
  for (int i = 0; i < 10; ++i) {
    request_of(1);
  }
  EXPECT_EQ(count("in_flight"), 4U) << "all, while it is alone";
  EXPECT_EQ(count("too_many"), 6U);
  EXPECT_EQ(request_of(2), 4U);
  EXPECT_EQ(said(), "as many as `max_calls` wait for an answer");
  someip_.respond(0, {}, done);
  EXPECT_EQ(request_of(1), 4U) << "kept for the other";
  EXPECT_EQ(request_of(2), 5U);
}

TEST_F(ServiceToMethodTest, LeavesNoPlaceTakenByWhatIsNotConvertible) {
  settings().max_calls = 4;
  start_there();
  for (int i = 0; i < 10; ++i) {
    request(hex("00010000 07"));
  }
  EXPECT_EQ(count("not_convertible"), 10U);
  for (int i = 0; i < 4; ++i) {
    request(on_cdr);
  }
  EXPECT_THAT(someip_.called, SizeIs(4));
}

// A setter whose value is refused, and whose call goes on as one of the getter.
TEST_F(ServiceToMethodTest, CountsACallOfTheGetterAsThatOfTheSetter) {
  settings().max_calls = 4;
  settings().type = "std_msgs_fields/srv/SetBool";
  settings().value_type = "std_msgs/msg/Bool";
  settings().access = messages::FieldAccess::set;
  settings().getter.emplace().id = someip::MethodId{0x22};
  start_there();
  request_of(2);
  someip_.respond(0, {}, on);
  EXPECT_EQ(request_of(1), 2U);
  EXPECT_EQ(request_of(1), 3U);
  someip_.respond(1, make_error_code(someip::ReturnCode::not_ok), {});
  ASSERT_THAT(someip_.called, SizeIs(4));
  EXPECT_EQ(someip_.called.back().spec.method, someip::MethodId{0x22});
  EXPECT_EQ(count("in_flight"), 2U);
  EXPECT_EQ(request_of(1), 4U) << "it has its share";
  someip_.respond(3, {}, on);
  EXPECT_EQ(count("in_flight"), 1U);
  EXPECT_EQ(request_of(1), 5U);
}

TEST_F(ServiceToMethodTest, CountsByTheirReasonsCallsThatFail) {
  start_there();
  const auto fails = [&](boost::system::error_code why, const std::string& counter) {
    request(on_cdr);
    someip_.respond(someip_.called.size() - 1, why, {});
    return count(counter);
  };
  EXPECT_EQ(fails(sd::CallFault::unavailable, "unavailable"), 1U);
  EXPECT_EQ(fails(sd::CallFault::not_connected, "unavailable"), 2U);
  EXPECT_EQ(fails(sd::CallFault::timed_out, "timed_out"), 1U);
  EXPECT_EQ(fails(sd::CallFault::not_sent, "not_sent"), 1U);
  EXPECT_EQ(fails(sd::CallFault::too_many_calls, "too_many"), 1U);
  EXPECT_EQ(fails(make_error_code(someip::ReturnCode::not_ok), "errors"), 1U);
  EXPECT_EQ(count("answered"), 0U);
  EXPECT_THAT(dds_.replies, SizeIs(6));
}

TEST_F(ServiceToMethodTest, IsThereWhileTheServiceIs) {
  start();
  EXPECT_FALSE(dds_.serves);
  EXPECT_EQ(state(), "WARN: the SOME/IP service is not offered");
  int changes = 0;
  route_at(0).on_change([&] { ++changes; });
  someip_.service_comes_or_goes(true);
  work();
  EXPECT_TRUE(dds_.serves);
  EXPECT_EQ(state(), "OK: ready");
  request(on_cdr);
  someip_.service_comes_or_goes(false);
  work();
  EXPECT_FALSE(dds_.serves);
  EXPECT_EQ(changes, 2);
  someip_.respond(0, {}, done);
  EXPECT_EQ(count("ended"), 1U) << "whoever asked is gone with the ROS service";
}

TEST_F(ServiceToMethodTest, IsNotMadeForEachOfferThatIsSoonWithdrawn) {
  start();
  flap(1ms);
  // Of the first 4 changes every other one makes it; then there is one change in 200 ms.
  EXPECT_LE(dds_.made, 2 + 1001 / 200 + 1);
  pass(200ms);
  EXPECT_TRUE(dds_.serves) << "in the end the service is there";
  EXPECT_EQ(state(), "OK: ready");
}

TEST_F(ServiceToMethodTest, FollowsEachOfferThatStaysForAWhile) {
  start();
  flap(200ms);
  EXPECT_EQ(dds_.made, 501);
}

TEST_F(ServiceToMethodTest, HasTheServerSeeToAnswersInTime) {
  start_there();
  request(on_cdr);
  someip_.respond(0, {}, done);
  EXPECT_TRUE(dds_.served_until);
  pass(1s - 1ns);
  EXPECT_TRUE(dds_.served_until);
  pass(1ns);
  EXPECT_FALSE(dds_.served_until);
  EXPECT_EQ(clock_.armed(), 0);
}

TEST_F(ServiceToMethodTest, PutsCallsThatComeAgainAndAgainOnTrial) {
  settings().max_calls = 1000;
  start_there();
  const auto calls = [&](int number) {
    for (int i = 0; i < number; ++i) {
      dds::RequestId id;
      id.from_bridge = true;
      dds_.on_request(id, dds::ServiceMessage{on_cdr});
    }
    return someip_.called.size();
  };
  EXPECT_EQ(calls(101), 101U) << "the first, and 100 that repeat it";
  EXPECT_EQ(calls(1), 101U);
  EXPECT_EQ(count("looped"), 1U);
  pass(1s);  // in which none comes: there is a ring
  EXPECT_EQ(clock_.armed(), 0);
  EXPECT_EQ(calls(20), 101U + 3U) << "fewer in the minute after that";
  pass(1min + 2s);
  EXPECT_EQ(calls(20), 101U + 3U + 20U);
}

TEST_F(ServiceToMethodTest, CarriesNothingOnceItIsStopped) {
  start_there();
  request(on_cdr);
  routes_->stop();
  EXPECT_FALSE(dds_.serves);
  someip_.respond(0, {}, done);
  EXPECT_THAT(dds_.replies, IsEmpty());
  someip_.service_comes_or_goes(true);
  work();
  EXPECT_FALSE(dds_.serves);
}

TEST_F(ServiceToMethodTest, EndsWhileACallIsOutstanding) {
  start_there();
  request(on_cdr);
  routes_.reset();
  someip_.respond(0, {}, done);
  EXPECT_THAT(dds_.replies, IsEmpty());
}

}  // namespace
}  // namespace trestle::test::service_to_method_test
