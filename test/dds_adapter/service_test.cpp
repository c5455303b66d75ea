#include "dds_adapter/service.hpp"

#include <gmock/gmock.h>

#include <atomic>
#include <map>

#include "dds_adapter/ros_names.hpp"
#include "test/dds_adapter/service_driver.hpp"

namespace trestle::dds::service_test {
namespace {

using namespace std::chrono_literals;
using test::add_service;
using test::copy;
using test::eventually;
using test::hex;
using test::Inbox;
using test::numbers;
using test::ServiceDriver;
using test::Sum;
using test::to_hex;
using testing::ElementsAre;

constexpr const char* request_type = "test_msgs::srv::dds_::Add_Request_";
constexpr const char* reply_type = "test_msgs::srv::dds_::Add_Response_";

class Service : public test::DdsTest {
 protected:
  ServiceConfig in_form(RosForm form) const {
    ServiceConfig result = add_service();
    result.form = form;
    return result;
  }

  Participant here_{config()};
  Participant there_{config()};
  ServiceDriver driver_;  // ends before the participants
};

TEST_F(Service, AnswersACall) {
  ServiceServer& server = driver_.adder(there_);
  ServiceClient& client = driver_.client(here_);
  ASSERT_TRUE(driver_.until([&] { return client.ready(); }));

  std::vector<Sum> results;
  ServiceDriver::add(client, 40, 2, results);
  ASSERT_TRUE(driver_.until([&] { return !results.empty(); }));
  EXPECT_EQ(results[0], 42);
  EXPECT_EQ(client.counters().requests, 1U);
  EXPECT_EQ(client.counters().replies, 1U);
  EXPECT_EQ(server.counters().requests, 1U);
  EXPECT_EQ(server.counters().replies, 1U);
  EXPECT_EQ(client.deadline(), std::nullopt);
}

TEST_F(Service, AnswersInCyclonesFormWhenTold) {
  driver_.adder(there_, in_form(RosForm::cyclonedds));
  ServiceClient& client = driver_.client(here_, in_form(RosForm::cyclonedds));
  std::vector<Sum> results;
  ServiceDriver::add(client, 40, 2, results);
  ServiceDriver::add(client, -1, -2, results);
  ASSERT_TRUE(driver_.until([&] { return results.size() == 2; }));
  EXPECT_THAT(results, ElementsAre(Sum{42}, Sum{-3}));
}

TEST_F(Service, KeepsManyCallsOfManyClientsApart) {
  for (const RosForm form : {RosForm::fastrtps, RosForm::cyclonedds}) {
    std::atomic<std::size_t> readers_of_replies = 0;
    Participant far{config([&](const Happening& event) {
      if (event.kind == Happening::Kind::matched && event.topic == "rr/addReply") {
        readers_of_replies = event.matched;
      }
    })};
    Participant third{config()};
    ServiceDriver driver;  // what it drives goes before its participants
    ServiceServer& server = driver.adder(far, in_form(form));
    std::array<ServiceClient*, 3> clients{&driver.client(here_, in_form(form)),
                                          &driver.client(here_, in_form(form)),
                                          &driver.client(third, in_form(form))};
    // A client that the server's side has not found yet would miss replies to the others.
    ASSERT_TRUE(driver.until([&] {
      return readers_of_replies == 3 &&
             std::ranges::all_of(clients, [](const auto* client) { return client->ready(); });
    }));
    std::array<std::vector<Sum>, 3> results;
    for (std::int64_t i = 0; i < 100; ++i) {
      for (std::size_t c = 0; c < clients.size(); ++c) {
        ServiceDriver::add(*clients[c], i, 1000 * static_cast<std::int64_t>(c + 1), results[c]);
      }
      if (i % 50 == 49) {  // a server takes 256 at once
        ASSERT_TRUE(driver.until([&] {
          return std::ranges::all_of(
              results, [&](const auto& got) { return got.size() == static_cast<std::size_t>(i) + 1; });
        })) << to_string(form);
      }
    }
    for (std::size_t c = 0; c < clients.size(); ++c) {
      for (std::int64_t i = 0; i < 100; ++i) {
        EXPECT_EQ(results[c][static_cast<std::size_t>(i)], i + 1000 * static_cast<std::int64_t>(c + 1));
      }
      // All see the replies to all, and take their own.
      EXPECT_EQ(clients[c]->counters().replies, 100U);
      EXPECT_TRUE(eventually([&] { return clients[c]->counters().foreign == 200; })) << to_string(form);
      EXPECT_EQ(clients[c]->counters().late, 0U);
    }
    EXPECT_EQ(server.counters().requests, 300U);
  }
}

TEST_F(Service, CarriesMegabytes) {
  for (const RosForm form : {RosForm::fastrtps, RosForm::cyclonedds}) {
    ServiceDriver driver;
    ServiceServer* server = nullptr;
    server = &driver.server(there_, in_form(form), [&](const RequestId& id, const ServiceMessage& request) {
      const ByteView whole = request.cdr();
      server->reply(id, {&whole, 1}, std::chrono::steady_clock::now());
    });
    ServiceClient& client = driver.client(here_, in_form(form));
    const auto large = test::make_sample(std::size_t{3} << 20U, 7);
    const std::array<ByteView, 2> slices{ByteView{large}.first(1000), ByteView{large}.subspan(1000)};
    std::vector<std::byte> got;
    client.call(slices, test::patience, std::chrono::steady_clock::now(),
                [&](const tl::expected<ServiceMessage, CallFault>& reply) { got = copy(reply->cdr()); });
    ASSERT_TRUE(driver.until([&] { return !got.empty(); })) << to_string(form);
    EXPECT_TRUE(got == large) << to_string(form);
  }
}

TEST_F(Service, WaitsForAServerThatComesInTime) {
  ServiceClient& client = driver_.client(here_);
  std::vector<Sum> results;
  ServiceDriver::add(client, 1, 2, results);
  driver_.work();
  EXPECT_TRUE(results.empty());
  EXPECT_TRUE(client.deadline());
  driver_.adder(there_);
  ASSERT_TRUE(driver_.until([&] { return !results.empty(); }));
  EXPECT_EQ(results[0], 3);
}

TEST_F(Service, IsUnavailableWithoutAServer) {
  ServiceConfig brief = add_service();
  brief.match_timeout = ServiceConfig{}.match_timeout;
  ServiceClient& client = driver_.client(here_, brief);
  std::vector<Sum> results;
  const auto now = std::chrono::steady_clock::now();
  const auto request = numbers({1, 2});
  const ByteView bytes = request;
  client.call({&bytes, 1}, 10s, now,
              [&](const auto& reply) { results.push_back(tl::unexpected{reply.error()}); });
  EXPECT_EQ(client.deadline(), now + 1s);
  client.work(now + 999ms);
  EXPECT_TRUE(results.empty());
  client.work(now + 1s);
  EXPECT_THAT(results, ElementsAre(Sum{tl::unexpected{CallFault::unavailable}}));
  EXPECT_EQ(client.counters().unavailable, 1U);
  EXPECT_EQ(client.counters().requests, 0U);
}

TEST_F(Service, TimesOutAndDropsTheLateAnswer) {
  std::vector<RequestId> ids;
  ServiceServer& server = driver_.server(
      there_, add_service(), [&](const RequestId& id, const ServiceMessage&) { ids.push_back(id); });
  ServiceClient& client = driver_.client(here_);
  ASSERT_TRUE(driver_.until([&] { return client.ready(); }));
  std::vector<Sum> results;
  ServiceDriver::add(client, 1, 2, results);
  ASSERT_TRUE(driver_.until([&] { return !ids.empty(); }));
  EXPECT_TRUE(results.empty());
  client.work(*client.deadline());
  EXPECT_THAT(results, ElementsAre(Sum{tl::unexpected{CallFault::timed_out}}));

  const auto sum = numbers({3});
  const ByteView bytes = sum;
  server.reply(ids[0], {&bytes, 1}, std::chrono::steady_clock::now());
  ASSERT_TRUE(driver_.until([&] { return client.counters().late == 1; }));
  EXPECT_EQ(results.size(), 1U);
  EXPECT_EQ(client.counters().timed_out, 1U);
  EXPECT_EQ(client.counters().replies, 0U);
}

TEST_F(Service, TellsThatTheServerHasLeft) {
  bool came = false;
  driver_.server(there_, add_service(), [&](const RequestId&, const ServiceMessage&) { came = true; });
  ServiceClient& client = driver_.client(here_);
  std::vector<Sum> results;
  ServiceDriver::add(client, 1, 2, results);
  ASSERT_TRUE(driver_.until([&] { return came; }));
  driver_.end_servers();
  ASSERT_TRUE(driver_.until([&] { return !results.empty(); }));
  EXPECT_THAT(results, ElementsAre(Sum{tl::unexpected{CallFault::gone}}));
  EXPECT_FALSE(client.ready());
  EXPECT_EQ(client.counters().gone, 1U);

  // Its successor answers.
  driver_.adder(there_);
  ASSERT_TRUE(driver_.until([&] { return client.ready(); }));
  ServiceDriver::add(client, 3, 4, results);
  ASSERT_TRUE(driver_.until([&] { return results.size() == 2; }));
  EXPECT_EQ(results[1], 7);
}

TEST_F(Service, RefusesCallsBeyondItsLimit) {
  ServiceConfig small = add_service();
  small.max_calls = 2;
  ServiceClient& client = driver_.client(here_, small);
  std::vector<Sum> results;
  for (int i = 0; i < 3; ++i) {
    ServiceDriver::add(client, 1, 2, results);
  }
  EXPECT_TRUE(results.empty());  // never from within call()
  client.work(std::chrono::steady_clock::now());
  EXPECT_THAT(results, ElementsAre(Sum{tl::unexpected{CallFault::too_many}}));
  EXPECT_EQ(client.counters().too_many, 1U);
}

TEST_F(Service, RefusesWhatDdsRefuses) {
  ServiceConfig small = add_service();
  small.max_sample_bytes = 100;
  driver_.adder(there_);
  ServiceClient& client = driver_.client(here_, small);
  ASSERT_TRUE(driver_.until([&] { return client.ready(); }));
  std::vector<Sum> results;
  const auto large = test::make_sample(101, 1);
  const ByteView bytes = large;
  client.call({&bytes, 1}, 1s, std::chrono::steady_clock::now(),
              [&](const auto& reply) { results.push_back(tl::unexpected{reply.error()}); });
  driver_.work();
  EXPECT_THAT(results, ElementsAre(Sum{tl::unexpected{CallFault::not_written}}));
}

// What rmw_fastrtps does, by hand: the request names the reader of its reply.
TEST_F(Service, AnswersWhomARequestNames) {
  driver_.adder(there_);
  Writer writer = here_.create_writer(ros_request_topic("/add"), request_type, {});
  Inbox<std::pair<SampleId, std::string>> replies;
  const Reader reader =
      here_.create_reader(ros_reply_topic("/add"), reply_type, {}, [&](const Sample& sample) {
        replies.put({sample.related(), to_hex(sample.cdr())});
      });
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1 && reader.matched() == 1; }));
  const auto request = numbers({40, 2});
  const ByteView bytes = request;
  const auto first = writer.write_related({&bytes, 1}, {reader.guid(), 0});
  const auto second = writer.write_related({&bytes, 1}, {reader.guid(), 0});
  EXPECT_EQ(first, 1U);
  EXPECT_EQ(second, 2U);
  ASSERT_TRUE(driver_.until([&] { return replies.size() == 2; }));
  // What waits until DDS has told of a client's reader may be overtaken.
  const std::string sum = "000100002a00000000000000";
  EXPECT_THAT(replies.take(), testing::UnorderedElementsAre(std::pair(SampleId{reader.guid(), 1}, sum),
                                                            std::pair(SampleId{reader.guid(), 2}, sum)));
}

// And before that was invented, or a client of another kind.
TEST_F(Service, AnswersTheWriterOfARequestThatNamesNobody) {
  driver_.adder(there_);
  Writer writer = here_.create_writer(ros_request_topic("/add"), request_type, {});
  Inbox<SampleId> replies;
  const Reader reader = here_.create_reader(ros_reply_topic("/add"), reply_type, {},
                                            [&](const Sample& sample) { replies.put(sample.related()); });
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1 && reader.matched() == 1; }));
  ASSERT_TRUE(writer.write(numbers({40, 2})));
  ASSERT_TRUE(driver_.until([&] { return replies.size() == 1; }));
  EXPECT_EQ(replies.take()[0], (SampleId{writer.guid(), 1}));
}

TEST_F(Service, HoldsBackAReplyUntilItsReaderIsThere) {
  ServiceServer& server = driver_.adder(there_);
  Writer writer = here_.create_writer(ros_request_topic("/add"), request_type, {});
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1; }));
  ASSERT_TRUE(writer.write(numbers({40, 2})));
  ASSERT_TRUE(driver_.until([&] { return server.deadline().has_value(); }));
  EXPECT_EQ(server.counters().replies, 0U);
  Inbox<std::string> replies;
  const Reader reader = here_.create_reader(ros_reply_topic("/add"), reply_type, {},
                                            [&](const Sample& sample) { replies.put(to_hex(sample.cdr())); });
  ASSERT_TRUE(driver_.until([&] { return replies.size() == 1; }));
  EXPECT_EQ(server.counters().replies, 1U);
  EXPECT_EQ(server.deadline(), std::nullopt);
}

TEST_F(Service, GivesUpAReplyWhoseReaderNeverComes) {
  ServiceServer& server = driver_.adder(there_);
  Writer writer = here_.create_writer(ros_request_topic("/add"), request_type, {});
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1; }));
  ASSERT_TRUE(writer.write(numbers({40, 2})));
  ASSERT_TRUE(driver_.until([&] { return server.deadline().has_value(); }));
  server.work(*server.deadline());
  EXPECT_EQ(server.counters().unmatched, 1U);
  EXPECT_EQ(server.counters().replies, 0U);
}

TEST_F(Service, DropsTheReplyToAClientThatHasLeft) {
  std::vector<RequestId> ids;
  ServiceServer& server = driver_.server(
      there_, add_service(), [&](const RequestId& id, const ServiceMessage&) { ids.push_back(id); });
  {
    Writer writer = here_.create_writer(ros_request_topic("/add"), request_type, {});
    ASSERT_TRUE(eventually([&] { return writer.matched() == 1; }));
    // Who asked before DDS told the server of its writer is waited for. So ask until that has happened.
    do {
      const std::size_t before = ids.size();
      ASSERT_TRUE(writer.write(numbers({40, 2})));
      ASSERT_TRUE(driver_.until([&] { return ids.size() > before; }));
    } while (ids.back().early);
  }
  const auto sum = numbers({42});
  const ByteView bytes = sum;
  ASSERT_TRUE(driver_.until([&] {
    server.reply(ids.back(), {&bytes, 1}, std::chrono::steady_clock::now());
    return server.counters().client_gone > 0;
  }));
  EXPECT_EQ(server.counters().replies, 0U);
}

TEST_F(Service, CountsRequestsThatAreTooShortForTheirForm) {
  ServiceServer& server = driver_.adder(there_, in_form(RosForm::cyclonedds));
  Writer writer = here_.create_writer(ros_request_topic("/add"), request_type, {});
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1; }));
  ASSERT_TRUE(writer.write(hex("00010000 0102030405060708 01020304")));
  ASSERT_TRUE(driver_.until([&] { return server.counters().malformed == 1; }));
  EXPECT_EQ(server.counters().requests, 0U);
}

TEST_F(Service, CountsRepliesThatAreTooShortForTheirForm) {
  const Reader requests =
      there_.create_reader(ros_request_topic("/add"), request_type, {}, [](const Sample&) {});
  Writer replies = there_.create_writer(ros_reply_topic("/add"), reply_type, {});
  ServiceClient& client = driver_.client(here_, in_form(RosForm::cyclonedds));
  std::vector<Sum> results;
  ServiceDriver::add(client, 1, 2, results);
  ASSERT_TRUE(driver_.until([&] { return client.ready() && replies.matched() == 1; }));
  ASSERT_TRUE(replies.write(hex("00010000 01020304")));
  ASSERT_TRUE(driver_.until([&] { return client.counters().malformed == 1; }));
  EXPECT_TRUE(results.empty());
}

TEST_F(Service, DropsRequestsThatComeFasterThanTheyAreTaken) {
  ServiceConfig small = add_service();
  small.max_calls = 2;
  ServiceServer& server = driver_.adder(there_, small);
  Writer writer = here_.create_writer(ros_request_topic("/add"), request_type, {});
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1; }));
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(writer.write(numbers({1, 2})));
  }
  ASSERT_TRUE(eventually([&] { return server.counters().dropped == 3; }));
  driver_.work();
  EXPECT_EQ(server.counters().requests, 2U);
}

TEST_F(Service, SharesThePlacesOfRequestsAmongParticipants) {
  ServiceConfig small = add_service();
  small.max_calls = 4;
  std::map<Guid, int> came;
  ServiceServer& server = driver_.server(
      there_, small, [&](const RequestId& id, const ServiceMessage&) { ++came[id.request.writer]; });
  Participant third{config()};
  const auto writer_of = [](Participant& participant) {
    return participant.create_writer(ros_request_topic("/add"), request_type, {.depth = 20});
  };
  Writer greedy = writer_of(here_);
  Writer its_other = writer_of(here_);
  Writer modest = writer_of(third);
  ASSERT_TRUE(
      eventually([&] { return greedy.matched() == 1 && its_other.matched() == 1 && modest.matched() == 1; }));
  const auto dropped = [&](std::uint64_t count) {
    return eventually([&] { return server.counters().dropped == count; });
  };
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(greedy.write(numbers({1, 2})));
  }
  ASSERT_TRUE(dropped(6));
  ASSERT_TRUE(modest.write(numbers({1, 2})));
  ASSERT_TRUE(dropped(7)) << "one of the other, in its place";
  ASSERT_TRUE(its_other.write(numbers({1, 2})));
  ASSERT_TRUE(dropped(8)) << "a process has no more for having more clients";
  driver_.work();
  EXPECT_EQ(came[greedy.guid()], 3);
  EXPECT_EQ(came[its_other.guid()], 0);
  EXPECT_EQ(came[modest.guid()], 1);
}

TEST_F(Service, SharesThePlacesOfRepliesThatWaitAmongParticipants) {
  ServiceConfig small = add_service();
  small.max_calls = 4;
  ServiceServer& server = driver_.adder(there_, small);
  Participant third{config()};
  // No reader for the replies is there yet.
  Writer greedy = here_.create_writer(ros_request_topic("/add"), request_type, {});
  Writer modest = third.create_writer(ros_request_topic("/add"), request_type, {});
  ASSERT_TRUE(eventually([&] { return greedy.matched() == 1 && modest.matched() == 1; }));
  for (std::uint64_t i = 1; i <= 4; ++i) {
    ASSERT_TRUE(greedy.write(numbers({1, 2})));
    ASSERT_TRUE(driver_.until([&] { return server.counters().requests == i; }));
  }
  ASSERT_TRUE(modest.write(numbers({40, 2})));
  ASSERT_TRUE(driver_.until([&] { return server.counters().too_many == 1; })) << "of the other";
  Inbox<std::string> replies;
  const Reader reader = third.create_reader(ros_reply_topic("/add"), reply_type, {},
                                            [&](const Sample& sample) { replies.put(to_hex(sample.cdr())); });
  ASSERT_TRUE(driver_.until([&] { return replies.size() == 1; }));
  EXPECT_EQ(replies.take()[0], "000100002a00000000000000");
  EXPECT_EQ(server.counters().replies, 1U);
}

TEST_F(Service, NeedsNoWorkButWhenItWakesItsOwner) {
  enum class Who : std::uint8_t { server, client };
  Inbox<Who> woken;
  std::unique_ptr<ServiceServer> server;
  server = std::make_unique<ServiceServer>(
      there_, add_service(), [&] { woken.put(Who::server); },
      [&](const RequestId& id, const ServiceMessage& request) {
        const ByteView whole = request.cdr();
        server->reply(id, {&whole, 1}, std::chrono::steady_clock::now());
      });
  ServiceClient client{here_, add_service(), [&] { woken.put(Who::client); }};
  std::vector<Sum> results;
  bool called = false;
  while (results.empty()) {
    ASSERT_TRUE(woken.wait_for_count(1));
    for (const Who who : woken.take()) {
      if (who == Who::server) {
        server->work(std::chrono::steady_clock::now());
      } else {
        client.work(std::chrono::steady_clock::now());
      }
    }
    if (client.ready() && !std::exchange(called, true)) {
      ServiceDriver::add(client, 40, 2, results);
    }
  }
  EXPECT_EQ(results[0], 40);
}

TEST_F(Service, KeepsARequestOnLoanAfterTheServerHasEnded) {
  std::vector<ServiceMessage> kept;
  driver_.server(there_, add_service(),
                 [&](const RequestId&, ServiceMessage request) { kept.push_back(std::move(request)); });
  ServiceClient& client = driver_.client(here_);
  std::vector<Sum> results;
  ServiceDriver::add(client, 40, 2, results);
  ASSERT_TRUE(driver_.until([&] { return !kept.empty(); }));
  driver_.end_servers();
  EXPECT_EQ(to_hex(kept[0].cdr()), to_hex(numbers({40, 2})));
}

}  // namespace
}  // namespace trestle::dds::service_test
