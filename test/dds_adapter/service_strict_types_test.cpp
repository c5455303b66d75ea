// ROS services whose definitions differ, and a participant that is strict about it.
#include <gmock/gmock.h>

#include "dds_adapter/ros_names.hpp"
#include "test/dds_adapter/service_driver.hpp"

namespace trestle::dds::service_strict_types_test {
namespace {

using test::add_service;
using test::ServiceDriver;
using test::Sum;

ServiceConfig with_hashes(char request, char reply) {
  ServiceConfig result = add_service();
  result.request_user_data = ros_type_hash_entry("RIHS01_" + std::string(64, request));
  result.reply_user_data = ros_type_hash_entry("RIHS01_" + std::string(64, reply));
  return result;
}

class ServiceStrictTypes : public test::DdsTest {
 protected:
  Participant strict_{[this] {
    ParticipantConfig result = config();
    result.strict_types = true;
    return result;
  }()};
  Participant there_{config()};
  ServiceDriver driver_;
};

TEST_F(ServiceStrictTypes, ServersOfAnotherAreNone) {
  ServiceClient& client = driver_.client(strict_, with_hashes('a', 'b'));
  ServiceServer& wrong = driver_.adder(there_, with_hashes('x', 'b'));
  Participant elsewhere{config()};
  ServiceDriver driver;  // ends before the participants
  driver.adder(elsewhere, with_hashes('a', 'x'));
  ASSERT_TRUE(driver_.until([&] { return client.counters().writer.other_type == 1; }));
  ASSERT_TRUE(
      driver_.until([&] { return std::ranges::count_if(strict_.writers(), &FoundWriter::refused) == 1; }));
  EXPECT_FALSE(client.ready());
  ServiceServer& good = driver.adder(there_, with_hashes('a', 'b'));
  ASSERT_TRUE(driver_.until([&] { return client.ready(); }));
  std::vector<Sum> results;
  ServiceDriver::add(client, 40, 2, results);
  ASSERT_TRUE(driver_.until([&] {
    driver.work();
    return !results.empty();
  }));
  EXPECT_EQ(results[0], 42);
  EXPECT_TRUE(driver_.until([&] { return good.counters().requests == 1; }));
  EXPECT_EQ(wrong.counters().requests, 0U) << "though it shares a participant with the good one";
}

TEST_F(ServiceStrictTypes, ClientsOfAnotherAreNotAnswered) {
  ServiceServer& server = driver_.adder(strict_, with_hashes('a', 'b'));
  ServiceClient& wrong = driver_.client(there_, with_hashes('x', 'b'));
  ServiceClient& right = driver_.client(there_, with_hashes('a', 'b'));
  ASSERT_TRUE(driver_.until([&] { return wrong.ready() && right.ready(); }));
  std::vector<Sum> refused;
  std::vector<Sum> results;
  ServiceDriver::add(wrong, 40, 2, refused);
  ASSERT_TRUE(driver_.until([&] { return server.counters().reader.other_type == 1; }));
  ServiceDriver::add(right, 40, 2, results);
  ASSERT_TRUE(driver_.until([&] { return !results.empty(); }));
  EXPECT_EQ(results[0], 42);
  EXPECT_TRUE(refused.empty());
  EXPECT_EQ(server.counters().requests, 1U);
}

}  // namespace
}  // namespace trestle::dds::service_strict_types_test
