#include "dds_adapter/participant.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "test/dds_adapter/participants.hpp"

namespace trestle::dds::participant_discovery_test {
namespace {

using test::eventually;
using test::Inbox;
using test::into;
using test::make_sample;
using test::matched;
using test::message_of;
using test::Participants;
using test::TestDomain;
using testing::ElementsAre;
using testing::IsEmpty;
using Bytes = std::vector<std::byte>;

constexpr const char* topic = test::points_topic;
constexpr const char* type = test::points_type;
const Qos kept{.reliable = true, .transient_local = true, .depth = 3};

TEST_F(Participants, TellWhichWritersOfOthersThereAre) {
  std::atomic<int> changes = 0;
  ParticipantConfig watching = config();
  watching.on_writers = [&] { ++changes; };
  const Participant watcher{watching};
  Participant own{config()};
  EXPECT_THAT(own.writers(), IsEmpty());
  const auto of_topic = [](const Participant& participant, const std::string& name) {
    std::vector<FoundWriter> found = participant.writers();
    std::erase_if(found, [&](const FoundWriter& writer) { return writer.topic != name; });
    return found;
  };
  {
    Participant other{config()};
    const Writer one = other.create_writer(topic, type, {.reliable = false});
    const Writer two = other.create_writer(topic, type, kept);
    const Writer third = other.create_writer("rt/other", "x", {});
    const Reader reader = other.create_reader("rt/read", "x", {}, [](const Sample&) {});
    ASSERT_TRUE(eventually([&] { return of_topic(watcher, topic).size() == 2; }));
    std::vector<FoundWriter> found = of_topic(watcher, topic);
    std::ranges::sort(found, {}, [](const FoundWriter& writer) { return writer.qos.reliable; });
    EXPECT_EQ(found[0].type, type);
    EXPECT_FALSE(found[0].qos.reliable);
    EXPECT_FALSE(found[0].qos.transient_local);
    EXPECT_TRUE(found[1].qos.reliable);
    EXPECT_TRUE(found[1].qos.transient_local);
    ASSERT_TRUE(eventually([&] { return of_topic(watcher, "rt/other").size() == 1; }));
    EXPECT_THAT(of_topic(watcher, "rt/read"), IsEmpty());
    EXPECT_THAT(of_topic(other, topic), IsEmpty()) << "they are its own";
    EXPECT_TRUE(eventually([&] { return changes >= 3; })) << "it is told when it is known";
  }
  // With their participant they go, too.
  ASSERT_TRUE(
      eventually([&] { return of_topic(watcher, topic).empty() && of_topic(watcher, "rt/other").empty(); }));
  EXPECT_EQ(watcher.not_remembered(), 0U);
  EXPECT_TRUE(eventually([&] { return changes >= 6; }));
}

TEST_F(Participants, DoNotHearThemselves) {
  Participant bridge{config()};
  Participant other{config()};
  Inbox<Bytes> at_bridge;
  Inbox<Bytes> at_other;
  Writer writer = bridge.create_writer(topic, type, kept);
  const Reader reader = bridge.create_reader(topic, type, kept, into(at_bridge));
  // Own endpoints do match in DDS, but they don't count.
  ASSERT_TRUE(writer.write(make_sample(100, 1)));
  ASSERT_TRUE(eventually([&] { return reader.counters().own == 1; }));
  EXPECT_EQ(writer.matched(), 0U);
  EXPECT_EQ(reader.matched(), 0U);

  Writer other_writer = other.create_writer(topic, type, kept);
  const Reader other_reader = other.create_reader(topic, type, kept, into(at_other));
  ASSERT_TRUE(matched(writer, reader));
  ASSERT_TRUE(at_other.wait_for_count(1));
  ASSERT_TRUE(other_writer.write(make_sample(100, 2)));
  ASSERT_TRUE(at_bridge.wait_for_count(1));
  EXPECT_THAT(at_other.take(), ElementsAre(make_sample(100, 1)));
  EXPECT_THAT(at_bridge.take(), ElementsAre(make_sample(100, 2)));
  EXPECT_EQ(reader.counters().own, 1U);
  EXPECT_EQ(reader.counters().received, 1U);
}

TEST_F(Participants, CountOnlyTheMatchesOfOthersWhateverComesAndGoes) {
  constexpr Qos volatile_one{.reliable = true, .transient_local = false, .depth = 1};
  constexpr Qos of_best_effort{.reliable = false, .transient_local = false, .depth = 1};
  constexpr const char* other_topic = "rt/other";
  const auto ignore = [](const Sample&) {};
  Inbox<Happening> events;
  Participant bridge{config([&](const Happening& event) {
    if (event.kind == Happening::Kind::matched || event.kind == Happening::Kind::unmatched) {
      events.put(event);
    }
  })};
  Participant other{config()};
  const auto foreign_when_told = [&] {
    EXPECT_TRUE(events.wait_for_count(1));
    const auto all = events.take();
    return all.empty() ? 99 : all.back().matched;
  };
  const Writer writer = bridge.create_writer(topic, type, volatile_one);
  const Writer unreliable = bridge.create_writer(topic, type, of_best_effort);
  const Writer elsewhere = bridge.create_writer(other_topic, type, volatile_one);
  const auto expect = [&](std::size_t of_writer) {
    EXPECT_TRUE(eventually([&] { return writer.matched() == of_writer; })) << writer.matched();
    EXPECT_EQ(unreliable.matched(), 0U);  // offers less than all of these readers want
    EXPECT_EQ(elsewhere.matched(), 0U);
  };

  std::optional<Reader> first = other.create_reader(topic, type, volatile_one, ignore);
  EXPECT_EQ(foreign_when_told(), 1U);
  expect(1);
  std::optional<Reader> own = bridge.create_reader(topic, type, volatile_one, ignore);
  expect(1);
  std::optional<Reader> second = other.create_reader(topic, type, volatile_one, ignore);
  EXPECT_EQ(foreign_when_told(), 2U);
  expect(2);
  // One that comes when there are others of both sides already.
  {
    const Writer late = bridge.create_writer(topic, type, volatile_one);
    EXPECT_TRUE(events.wait_for_count(2));
    const auto all = events.take();
    EXPECT_EQ(all.back().matched, 2U);
    EXPECT_EQ(late.matched(), 2U);
    EXPECT_EQ(own->matched(), 0U);
  }
  first.reset();
  EXPECT_EQ(foreign_when_told(), 1U);
  expect(1);
  own.reset();
  expect(1);
  second.reset();
  EXPECT_EQ(foreign_when_told(), 0U);
  expect(0);
  // And all again, when they have been gone.
  own = bridge.create_reader(topic, type, volatile_one, ignore);
  expect(0);
  first = other.create_reader(topic, type, volatile_one, ignore);
  EXPECT_EQ(foreign_when_told(), 1U);
  expect(1);
  own.reset();
  expect(1);
}

TEST_F(Participants, OfDifferentDomainsDoNotMeet) {
  const TestDomain elsewhere;
  ParticipantConfig other_config = config();
  other_config.domain = elsewhere.id();
  Participant from{config()};
  Participant other{other_config};
  Participant to{config()};
  Inbox<Bytes> here;
  Inbox<Bytes> there;
  Writer writer = from.create_writer(topic, type, kept);
  const Reader other_reader = other.create_reader(topic, type, kept, into(there));
  const Reader reader = to.create_reader(topic, type, kept, into(here));
  ASSERT_TRUE(matched(writer, reader));
  ASSERT_TRUE(writer.write(make_sample(100, 1)));
  ASSERT_TRUE(here.wait_for_count(1));
  EXPECT_EQ(other_reader.matched(), 0U);
  EXPECT_EQ(there.size(), 0U);
}

TEST_F(Participants, NameThePoliciesThatKeepEndpointsApart) {
  Inbox<Happening> at_writer;
  Inbox<Happening> at_reader;
  Participant from{config([&](const Happening& event) { at_writer.put(event); })};
  Participant to{config([&](const Happening& event) { at_reader.put(event); })};
  const Writer writer =
      from.create_writer(topic, type, {.reliable = false, .transient_local = false, .depth = 1});
  const Reader reader = to.create_reader(
      topic, type, {.reliable = true, .transient_local = false, .depth = 1}, [](const Sample&) {});
  for (Inbox<Happening>* events : {&at_writer, &at_reader}) {
    ASSERT_TRUE(events->wait([](const auto& all) {
      return std::ranges::any_of(
          all, [](const Happening& event) { return event.kind == Happening::Kind::incompatible_qos; });
    }));
    const Happening last = events->take().back();
    EXPECT_EQ(last.kind, Happening::Kind::incompatible_qos);
    EXPECT_EQ(last.topic, topic);
    EXPECT_EQ(last.type, type);
    EXPECT_EQ(last.detail, "reliability");
  }
  // It may be told, by another thread, before it is counted.
  EXPECT_TRUE(eventually([&] { return writer.counters().incompatible_qos == 1; }));
  EXPECT_TRUE(eventually([&] { return reader.counters().incompatible_qos == 1; }));
  EXPECT_EQ(writer.matched(), 0U);
}

TEST_F(Participants, ReportATopicThatHasAnotherTypeElsewhere) {
  Inbox<Happening> at_first;
  Inbox<Happening> at_second;
  const auto has_mismatch = [](const auto& all) {
    return std::ranges::any_of(
        all, [](const Happening& event) { return event.kind == Happening::Kind::incompatible_type; });
  };
  Participant first{config([&](const Happening& event) { at_first.put(event); })};
  Participant second{config([&](const Happening& event) { at_second.put(event); })};
  const Reader reader = first.create_reader(topic, type, {}, [](const Sample&) {});
  // The second makes its writer when it has long known of the reader, the first learns of the writer later.
  ASSERT_TRUE(at_second.wait_for_count(1));
  const Writer writer = second.create_writer(topic, "std_msgs::msg::dds_::String_", {});
  ASSERT_TRUE(at_first.wait(has_mismatch));
  const Happening seen_by_first = at_first.take().back();
  EXPECT_EQ(seen_by_first.topic, topic);
  EXPECT_EQ(seen_by_first.type, type);
  EXPECT_EQ(seen_by_first.detail, "std_msgs::msg::dds_::String_");
  ASSERT_TRUE(at_second.wait(has_mismatch));
  EXPECT_EQ(at_second.take().back().detail, type);
  EXPECT_EQ(reader.matched(), 0U);
}

TEST_F(Participants, ReportEachOthersComingAndGoing) {
  Inbox<Happening> events;
  Participant stays{config([&](const Happening& event) { events.put(event); })};
  const Reader reader = stays.create_reader(topic, type, {}, [](const Sample&) {});
  std::string guid;
  {
    ParticipantConfig named = config();
    named.name = "lidar";
    Participant goes{named};
    guid = goes.guid();
    const Writer writer = goes.create_writer(topic, type, {});
    ASSERT_TRUE(events.wait_for_count(2));
  }
  ASSERT_TRUE(events.wait_for_count(4));
  const auto all = events.take();
  EXPECT_EQ(all[0].kind, Happening::Kind::peer_found);
  EXPECT_EQ(all[0].peer, guid);
  EXPECT_EQ(all[0].detail, "lidar");
  EXPECT_EQ(all[1].kind, Happening::Kind::matched);
  EXPECT_EQ(all[1].topic, topic);
  EXPECT_THAT(all[1].peer, testing::StartsWith(guid));
  EXPECT_EQ(all[1].matched, 1U);
  EXPECT_EQ(all[2].kind, Happening::Kind::unmatched);
  EXPECT_EQ(all[2].matched, 0U);
  EXPECT_EQ(all[3].kind, Happening::Kind::peer_lost);
  EXPECT_EQ(all[3].peer, guid);
}

TEST_F(Participants, TellAMatchFromItsEndWhoeverAsksMeanwhile) {
  constexpr std::size_t lives = 1000;
  Inbox<bool> matches;
  Participant stays{config([&](const Happening& event) {
    if (event.kind == Happening::Kind::matched || event.kind == Happening::Kind::unmatched) {
      matches.put(event.kind == Happening::Kind::matched);
    }
  })};
  const Reader reader = stays.create_reader(topic, type, {}, [](const Sample&) {});
  Participant other{config()};
  std::jthread asking{[&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      EXPECT_LE(reader.matched(), 1U);
    }
  }};
  std::vector<bool> expected;
  for (std::size_t life = 0; life < lives; ++life) {
    std::optional<Writer> writer = other.create_writer(topic, type, {});
    ASSERT_TRUE(matches.wait_for_count(2 * life + 1));
    writer.reset();
    ASSERT_TRUE(matches.wait_for_count(2 * life + 2));
    expected.insert(expected.end(), {true, false});
  }
  EXPECT_EQ(matches.take(), expected);
}

TEST_F(Participants, ShareATopicAmongReadersAndWriters) {
  Participant from{config()};
  Participant to{config()};
  Inbox<Bytes> first;
  Inbox<Bytes> second;
  Writer writer = from.create_writer(topic, type, {});
  const Reader one = to.create_reader(topic, type, {}, into(first));
  std::optional<Reader> two = to.create_reader(topic, type, {}, into(second));
  ASSERT_TRUE(eventually([&] { return writer.matched() == 2 && one.matched() == 1 && two->matched() == 1; }));
  ASSERT_TRUE(writer.write(make_sample(100, 1)));
  ASSERT_TRUE(first.wait_for_count(1));
  ASSERT_TRUE(second.wait_for_count(1));
  two.reset();
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1; }));
  ASSERT_TRUE(writer.write(make_sample(100, 2)));
  ASSERT_TRUE(first.wait_for_count(2));
  EXPECT_EQ(second.size(), 1U);
}

TEST_F(Participants, LetATopicHaveAnotherTypeWhenItsLastUserIsGone) {
  Participant participant{config()};
  {
    const Writer writer = participant.create_writer(topic, type, {});
    EXPECT_EQ(
        message_of([&] { (void)participant.create_reader(topic, "other::Type", {}, [](const Sample&) {}); }),
        "topic 'rt/points' is already in use with type 'sensor_msgs::msg::dds_::PointCloud2_', so it can't "
        "have "
        "type 'other::Type'");
  }
  const Writer writer = participant.create_writer(topic, "other::Type", {});
}

}  // namespace
}  // namespace trestle::dds::participant_discovery_test
