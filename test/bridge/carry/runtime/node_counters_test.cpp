#include "bridge/carry/runtime/node_counters.hpp"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <set>
#include <string>
#include <utility>

namespace trestle::carry::node_counters_test {
namespace {

constexpr std::size_t fields = sizeof(NodeCounts) / sizeof(std::uint64_t);

/// The counters that a bridge shows with 1 if this field alone is 1, and all others 0.
std::vector<std::pair<std::string, std::string>> shown(std::size_t field) {
  std::array<std::uint64_t, fields> numbers{};
  numbers.at(field) = 1;
  std::vector<CounterGroup> groups;
  append_counters(groups, std::bit_cast<NodeCounts>(numbers));
  std::vector<std::pair<std::string, std::string>> names;
  for (const CounterGroup& group : groups) {
    for (const Counter& counter : group.counters) {
      if (counter.count == 1) {
        names.emplace_back(group.name, counter.name);
      }
    }
  }
  return names;
}

// A new field in one of the structs also has to be in the struct's for_each_counter().
TEST(NodeCounters, AreAllShownUnderANameOfTheirOwn) {
  std::set<std::pair<std::string, std::string>> names;
  for (std::size_t field = 0; field < fields; ++field) {
    const auto found = shown(field);
    ASSERT_EQ(found.size(), 1U) << "field " << field << " of NodeCounts";
    names.insert(found.front());
  }
  // Only what the streams of servers and of clients counted is one number.
  EXPECT_EQ(names.size(), fields - sizeof(someip::TcpStreamCounters) / sizeof(std::uint64_t));
}

TEST(NodeCounters, AreAllShownOnce) {
  std::vector<CounterGroup> groups;
  append_counters(groups, {});
  for (const CounterGroup& group : groups) {
    std::set<std::string> names;
    for (const Counter& counter : group.counters) {
      EXPECT_TRUE(names.insert(counter.name).second) << group.name << ": " << counter.name;
    }
  }
}

TEST(NodeCounters, SayWhichLimitWasReached) {
  NodeCounts counts;
  counts.discovery.limits_reached[static_cast<std::size_t>(sd::Limit::remote_services)] = 2;
  counts.discovery.nacks_by_reason[static_cast<std::size_t>(sd::NackReason::no_room)] = 3;
  counts.tcp_server.streams.held_back = 4;
  counts.tcp_client.streams.held_back = 5;
  std::vector<CounterGroup> groups;
  append_counters(groups, counts);
  ASSERT_EQ(groups.size(), 4U);
  EXPECT_NE(to_string(groups[1]).find("held_back 9"), std::string::npos) << to_string(groups[1]);
  EXPECT_NE(to_string(groups[3]).find("lost: max_remote_services 2, nacks_no_room 3"), std::string::npos)
      << to_string(groups[3]);
}

}  // namespace
}  // namespace trestle::carry::node_counters_test
