#include "test/bridge/carry/runtime/route_test.hpp"

namespace trestle::test::getter_to_topic_test {
namespace {

using someip::ReturnCode;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;

/// A field: its notifier is the first route, its getter the second.
class GetterToTopicTest : public RouteTest {
 protected:
  GetterToTopicTest() {
    config_.routes = {route(carry::Direction::dds_to_someip)};
    config_.routes.front().qos.transient_local = true;
    config_.routes.front().getter.emplace(carry::FieldGetter{.id = someip::MethodId{0x31}});
  }
};

TEST_F(GetterToTopicTest, AnswersWithTheLastSample) {
  start();
  dds_.on_sample(dds::Sample{hello_cdr, {}, 1});
  work();
  someip_.request({});
  EXPECT_THAT(someip_.answers, ElementsAre(Pair(ReturnCode::ok, hello)));
  EXPECT_EQ(count("received", 1), 1U);
  EXPECT_EQ(count("answered", 1), 1U);
}

TEST_F(GetterToTopicTest, HasNoAnswerBeforeThereIsAValue) {
  start();
  someip_.request({});
  EXPECT_THAT(someip_.answers, ElementsAre(Pair(ReturnCode::not_ready, IsEmpty())));
  EXPECT_EQ(count("without_value", 1), 1U);
}

TEST_F(GetterToTopicTest, HasNoneWhereTheValueCannotBeConverted) {
  start();
  dds_.on_sample(dds::Sample{wrong, {}, 1});
  work();
  someip_.request({});
  EXPECT_EQ(someip_.answers.front().first, ReturnCode::not_ready);
  EXPECT_EQ(count("not_convertible"), 1U);
}

TEST_F(GetterToTopicTest, CountsAnAnswerThatCannotBeSent) {
  start();
  dds_.on_sample(dds::Sample{hello_cdr, {}, 1});
  work();
  someip_.sends_answers = false;
  someip_.request({});
  EXPECT_EQ(count("answers_not_sent", 1), 1U);
}

TEST_F(GetterToTopicTest, RefusesARequestThatFailsItsCheckAndTellsOfIt) {
  config_.routes.front().getter->e2e.emplace();
  start();
  EXPECT_TRUE(route_at(1).has_checks());
  const someip::e2e::CheckResult bad{.status = someip::e2e::CheckStatus::error,
                                     .state = someip::e2e::State::invalid};
  someip_.request({}, 0, &bad);
  EXPECT_NE(someip_.answers.front().first, ReturnCode::ok);
  EXPECT_EQ(count("e2e_error", 1), 1U);
  std::vector<carry::Diagnosis> told;
  route_at(1).append_diagnoses(told, false);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told.front().name, "trestle: E2E of the getter of /talk");
}

TEST_F(GetterToTopicTest, HasNoAnswerOnceItIsStopped) {
  start();
  dds_.on_sample(dds::Sample{hello_cdr, {}, 1});
  work();
  routes_->stop();
  someip_.request({});
  EXPECT_EQ(someip_.answers.front().first, ReturnCode::not_ready);
}

}  // namespace
}  // namespace trestle::test::getter_to_topic_test
