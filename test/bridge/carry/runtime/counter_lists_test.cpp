#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "bridge/guest/host.hpp"
#include "bridge/record/recorder.hpp"
#include "dds_adapter/service.hpp"

namespace trestle::carry::counter_lists_test {
namespace {

/// The names of for_each_counter() that have 1 if this field alone is 1, and all others 0.
template <typename Counters>
std::vector<std::string> names_of(std::size_t field) {
  std::array<std::uint64_t, sizeof(Counters) / sizeof(std::uint64_t)> numbers{};
  numbers.at(field) = 1;
  std::vector<std::string> names;
  std::bit_cast<Counters>(numbers).for_each_counter(
      [&](const char* name, std::uint64_t count, someip::CounterKind /*kind*/) {
        if (count == 1) {
          names.emplace_back(name);
        }
      });
  return names;
}

/// Each field is shown once, by for_each_counter().
/// @param others  offsets of those that are not.
/// @return how many names there are.
template <typename Counters>
std::size_t expect_all_shown(const std::set<std::size_t>& others = {}) {
  std::set<std::string> names;
  for (std::size_t at = 0; at < sizeof(Counters); at += sizeof(std::uint64_t)) {
    const auto found = names_of<Counters>(at / sizeof(std::uint64_t));
    EXPECT_EQ(found.size(), others.contains(at) ? 0U : 1U) << "at offset " << at;
    names.insert(found.begin(), found.end());
  }
  std::size_t shown = 0;
  Counters{}.for_each_counter([&](const char* name, std::uint64_t /*count*/, someip::CounterKind /*kind*/) {
    ++shown;
    EXPECT_TRUE(names.contains(name)) << name;
  });
  EXPECT_EQ(shown, names.size());
  return shown;
}

template <typename Counters>
constexpr std::size_t fields = sizeof(Counters) / sizeof(std::uint64_t);

// A new field in one of the structs also has to be in the struct's for_each_counter().
TEST(CounterLists, HaveEachFieldUnderANameOfItsOwn) {
  EXPECT_EQ(expect_all_shown<dds::ReaderCounters>(), fields<dds::ReaderCounters>);
  EXPECT_EQ(expect_all_shown<dds::WriterCounters>(), fields<dds::WriterCounters>);
  EXPECT_EQ(expect_all_shown<guest::HostCounters>(), fields<guest::HostCounters>);
  EXPECT_EQ(expect_all_shown<record::RecorderCounters>(), fields<record::RecorderCounters>);
}

/// What the ends of a service count and it does not show.
template <typename Counters>
std::set<std::size_t> not_shown() {
  return {
      // Requests and replies have counters of their own.
      offsetof(Counters, reader.received),
      offsetof(Counters, reader.received_bytes),
      offsetof(Counters, writer.sent),
      offsetof(Counters, writer.sent_bytes),
      // All ends of a service get what others of the bridge sent, and none is lost by that.
      offsetof(Counters, reader.own),
      // In `not_written`.
      offsetof(Counters, writer.bad_encapsulation),
      offsetof(Counters, writer.oversize),
      offsetof(Counters, writer.refused),
      // Services have neither.
      offsetof(Counters, reader.deadlines_missed),
      offsetof(Counters, reader.liveliness_lost),
      offsetof(Counters, writer.deadlines_missed),
      offsetof(Counters, writer.liveliness_lost),
  };
}

TEST(CounterLists, OfServicesHaveEachFieldOnceThatIsNotCountedElsewhere) {
  std::set<std::size_t> of_client = not_shown<dds::ServiceClientCounters>();
  of_client.insert(
      offsetof(dds::ServiceClientCounters, reader.from_bridge));  // replies to others, as `foreign`
  expect_all_shown<dds::ServiceClientCounters>(of_client);
  std::set<std::size_t> of_server = not_shown<dds::ServiceServerCounters>();
  of_server.insert(offsetof(dds::ServiceServerCounters, requests));  // `received` of the route
  expect_all_shown<dds::ServiceServerCounters>(of_server);
}

TEST(CounterLists, TellWhetherARecorderLostSomething) {
  using record::RecorderCounters;
  EXPECT_FALSE((RecorderCounters{.messages = 1, .bytes = 1, .frames = 1, .files = 1}.lost_any()));
  EXPECT_TRUE((RecorderCounters{.queue_full = 1}.lost_any()));
  EXPECT_TRUE((RecorderCounters{.frames_write_failed = 1}.lost_any()));
}

}  // namespace
}  // namespace trestle::carry::counter_lists_test
