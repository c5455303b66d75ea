#include "dds_adapter/participant.hpp"

#include <gmock/gmock.h>

#include <algorithm>

#include <array>
#include <atomic>
#include <thread>

#include "test/bytes.hpp"
#include "test/dds_adapter/dds_test.hpp"

namespace trestle::dds::participant_test {
namespace {

using test::copy;
using test::eventually;
using test::hex;
using test::Inbox;
using test::make_sample;
using test::patience;
using test::Stuck;
using test::TestDomain;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using Bytes = std::vector<std::byte>;
using Participants = test::DdsTest;

const char* const topic = "rt/points";
const char* const type = "sensor_msgs::msg::dds_::PointCloud2_";
const Qos kept{.reliable = true, .transient_local = true, .depth = 3};

/// A callback that copies what comes.
OnSample into(Inbox<Bytes>& inbox) {
  return [&inbox](const Sample& sample) { inbox.put(copy(sample.cdr())); };
}

bool matched(const Writer& writer, const Reader& reader) {
  return eventually([&] { return writer.matched() == 1 && reader.matched() == 1; });
}

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const DdsError& error) {
    return error.what();
  }
  return "no error";
}

TEST_F(Participants, CarrySamplesOfAllSizesUnchanged) {
  Participant from{config()};
  Participant to{config()};
  Inbox<Bytes> inbox;
  Writer writer = from.create_writer(topic, type, {});
  const Reader reader = to.create_reader(topic, type, {}, into(inbox));
  ASSERT_TRUE(matched(writer, reader));
  std::uint64_t count = 0;
  std::uint64_t bytes = 0;
  for (const std::size_t size : {4U, 8U, 64U, 1024U, 65'000U, 70'000U, 1'000'000U, 4'000'000U, 16'777'216U}) {
    const Bytes sample = make_sample(size, static_cast<std::uint32_t>(size));
    ASSERT_TRUE(writer.write(sample));
    ASSERT_TRUE(inbox.wait_for_count(1)) << size;
    EXPECT_TRUE(inbox.take()[0] == sample) << size;
    ++count;
    bytes += size;
  }
  EXPECT_EQ(reader.counters().received, count);
  EXPECT_EQ(reader.counters().received_bytes, bytes);
  EXPECT_EQ(writer.counters().sent, count);
  EXPECT_EQ(writer.counters().sent_bytes, bytes);
}

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
    EXPECT_GE(changes, 3);
  }
  // With their participant they go, too.
  ASSERT_TRUE(
      eventually([&] { return of_topic(watcher, topic).empty() && of_topic(watcher, "rt/other").empty(); }));
  EXPECT_EQ(watcher.not_remembered(), 0U);
  EXPECT_TRUE(eventually([&] { return changes >= 6; }));
}

TEST_F(Participants, CarryABurstOfLargeSamplesInOrder) {
  Participant from{config()};
  Participant to{config()};
  Inbox<Bytes> inbox;
  const Qos deep{.reliable = true, .transient_local = false, .depth = 20};
  Writer writer = from.create_writer(topic, type, deep);
  const Reader reader = to.create_reader(topic, type, deep, into(inbox));
  ASSERT_TRUE(matched(writer, reader));
  std::vector<Bytes> sent;
  for (std::uint32_t i = 0; i < 20; ++i) {
    sent.push_back(make_sample(4'000'000, i));
    ASSERT_TRUE(writer.write(sent.back()));
  }
  ASSERT_TRUE(inbox.wait_for_count(20)) << inbox.size();
  EXPECT_TRUE(inbox.take() == sent);
  EXPECT_TRUE(writer.wait_until_received(test::patience));
}

TEST_F(Participants, CarryLargeAndSmallSamplesInOrder) {
  Participant from{config()};
  Participant to{config()};
  Inbox<Bytes> inbox;
  const Qos deep{.reliable = true, .transient_local = false, .depth = 60};
  Writer writer = from.create_writer(topic, type, deep);
  const Reader reader = to.create_reader(topic, type, deep, into(inbox));
  ASSERT_TRUE(matched(writer, reader));
  std::vector<Bytes> sent;
  for (std::uint32_t i = 0; i < 60; ++i) {
    constexpr std::array sizes{100U, 3'000'000U, 100U, 70'000U, 300'000U};
    sent.push_back(make_sample(sizes[i % sizes.size()], i));
    ASSERT_TRUE(writer.write(sent.back()));
  }
  ASSERT_TRUE(inbox.wait_for_count(60)) << inbox.size();
  EXPECT_TRUE(inbox.take() == sent);
  EXPECT_EQ(writer.counters().sent, 60U);
  EXPECT_EQ(writer.counters().overwritten, 0U);
}

// Whoever writes returns though the reader does not take anything, and another one gets what there is.
TEST_F(Participants, KeepNobodyWhoWritesForAReaderThatIsStuck) {
  for (const bool reliable : {true, false}) {
    SCOPED_TRACE(reliable);
    const Qos few{.reliable = reliable, .transient_local = false, .depth = 3};
    Participant from{config()};
    Participant to{config()};
    Participant good{config()};
    Stuck stuck;
    Inbox<Bytes> inbox;
    Writer writer = from.create_writer(topic, type, few);
    const Reader other = good.create_reader(topic, type, few, into(inbox));
    const Reader reader = to.create_reader(topic, type, few, [&](const Sample&) { stuck.wait_once(); });
    ASSERT_TRUE(eventually([&] { return writer.matched() == 2; }));
    ASSERT_TRUE(eventually([&] {
      return writer.write(make_sample(100, 0)) && stuck.wait_until_stuck(std::chrono::milliseconds{1});
    }));
    const std::uint64_t before = writer.counters().sent;
    for (std::uint32_t i = 1; i <= 30; ++i) {
      ASSERT_TRUE(writer.write(make_sample(i % 3 == 0 ? 100 : 2'000'000, i)));
    }
    ASSERT_TRUE(writer.write(make_sample(100, 31)));
    EXPECT_EQ(writer.counters().sent, before + 31);
    EXPECT_EQ(writer.counters().refused, 0U);
    if (reliable) {
      EXPECT_TRUE(inbox.wait([last = make_sample(100, 31)](const auto& samples) {
        return std::ranges::find(samples, last) != samples.end();
      }));
      EXPECT_GT(writer.counters().overwritten, 0U);
    }
    stuck.free();
  }
}

TEST_F(Participants, CarrySamplesThroughSharedMemoryToo) {
  ParticipantConfig shared = config();
  shared.shared_memory = true;
  Participant from{shared};
  Participant to{shared};
  Inbox<Bytes> inbox;
  Writer writer = from.create_writer(topic, type, {});
  const Reader reader = to.create_reader(topic, type, {}, into(inbox));
  ASSERT_TRUE(matched(writer, reader));
  for (std::uint32_t i = 0; i < 3; ++i) {
    const Bytes sample = make_sample(16'777'216, i);
    ASSERT_TRUE(writer.write(sample));
    ASSERT_TRUE(inbox.wait_for_count(1));
    EXPECT_TRUE(inbox.take()[0] == sample);
  }
}

TEST_F(Participants, CarrySamplesWithBestEffort) {
  Participant from{config()};
  Participant to{config()};
  Inbox<Bytes> inbox;
  const Qos qos{.reliable = false, .transient_local = false, .depth = 1};
  Writer writer = from.create_writer(topic, type, qos);
  const Reader reader = to.create_reader(topic, type, qos, into(inbox));
  ASSERT_TRUE(matched(writer, reader));
  const Bytes sample = make_sample(1000, 1);
  // One may be lost, not all.
  ASSERT_TRUE(eventually([&] { return !writer.write(sample) || inbox.size() > 0; }));
  EXPECT_EQ(inbox.take()[0], sample);
}

TEST_F(Participants, CarryTheTimeWriterAndNumberOfASample) {
  Participant from{config()};
  Participant to{config()};
  Inbox<Sample> inbox;
  Writer writer = from.create_writer(topic, type, {});
  const Reader reader =
      to.create_reader(topic, type, {}, [&](Sample sample) { inbox.put(std::move(sample)); });
  ASSERT_TRUE(matched(writer, reader));
  const auto before = std::chrono::system_clock::now().time_since_epoch();
  ASSERT_TRUE(writer.write(make_sample(100, 1)));
  ASSERT_TRUE(writer.write(make_sample(100, 2)));
  const auto after = std::chrono::system_clock::now().time_since_epoch();
  ASSERT_TRUE(inbox.wait_for_count(2));
  const std::vector<Sample> samples = inbox.take();
  // The wire has the time in 1/2^32 s, so a nanosecond may be lost.
  EXPECT_GE(samples[0].source_time(), before - std::chrono::nanoseconds{2});
  EXPECT_LE(samples[1].source_time(), after);
  EXPECT_EQ(samples[0].sequence(), 1U);
  EXPECT_EQ(samples[1].sequence(), 2U);
  EXPECT_THAT(samples[0].writer(), testing::StartsWith(from.guid()));
  EXPECT_THAT(samples[0].writer(), SizeIs(32));
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

TEST_F(Participants, GiveLateReadersTheLastSamplesOfATransientLocalWriter) {
  Participant from{config()};
  Participant to{config()};
  Writer writer = from.create_writer(topic, type, kept);
  for (std::uint32_t i = 1; i <= 5; ++i) {
    ASSERT_TRUE(writer.write(make_sample(200'000, i)));
  }
  Inbox<Bytes> inbox;
  const Reader reader = to.create_reader(topic, type, kept, into(inbox));
  ASSERT_TRUE(inbox.wait_for_count(3));
  EXPECT_EQ(inbox.take(),
            (std::vector{make_sample(200'000, 3), make_sample(200'000, 4), make_sample(200'000, 5)}));
}

TEST_F(Participants, GiveLateReadersNothingOfAVolatileWriter) {
  Participant from{config()};
  Participant to{config()};
  Writer writer = from.create_writer(topic, type, {});
  ASSERT_TRUE(writer.write(make_sample(100, 1)));
  Inbox<Bytes> inbox;
  const Reader reader = to.create_reader(topic, type, {}, into(inbox));
  ASSERT_TRUE(matched(writer, reader));
  ASSERT_TRUE(writer.write(make_sample(100, 2)));
  ASSERT_TRUE(inbox.wait_for_count(1));
  EXPECT_THAT(inbox.take(), ElementsAre(make_sample(100, 2)));
}

TEST_F(Participants, NameThePoliciesThatKeepEndpointsApart) {
  Inbox<Event> at_writer;
  Inbox<Event> at_reader;
  Participant from{config([&](const Event& event) { at_writer.put(event); })};
  Participant to{config([&](const Event& event) { at_reader.put(event); })};
  const Writer writer =
      from.create_writer(topic, type, {.reliable = false, .transient_local = false, .depth = 1});
  const Reader reader = to.create_reader(
      topic, type, {.reliable = true, .transient_local = false, .depth = 1}, [](const Sample&) {});
  for (Inbox<Event>* events : {&at_writer, &at_reader}) {
    ASSERT_TRUE(events->wait([](const auto& all) {
      return std::ranges::any_of(
          all, [](const Event& event) { return event.kind == Event::Kind::incompatible_qos; });
    }));
    const Event last = events->take().back();
    EXPECT_EQ(last.kind, Event::Kind::incompatible_qos);
    EXPECT_EQ(last.topic, topic);
    EXPECT_EQ(last.type, type);
    EXPECT_EQ(last.detail, "reliability");
  }
  EXPECT_EQ(writer.counters().incompatible_qos, 1U);
  EXPECT_EQ(reader.counters().incompatible_qos, 1U);
  EXPECT_EQ(writer.matched(), 0U);
}

TEST_F(Participants, ReportATopicThatHasAnotherTypeElsewhere) {
  Inbox<Event> at_first;
  Inbox<Event> at_second;
  const auto has_mismatch = [](const auto& all) {
    return std::ranges::any_of(
        all, [](const Event& event) { return event.kind == Event::Kind::incompatible_type; });
  };
  Participant first{config([&](const Event& event) { at_first.put(event); })};
  Participant second{config([&](const Event& event) { at_second.put(event); })};
  const Reader reader = first.create_reader(topic, type, {}, [](const Sample&) {});
  // The second makes its writer when it has long known of the reader, the first learns of the writer later.
  ASSERT_TRUE(at_second.wait_for_count(1));
  const Writer writer = second.create_writer(topic, "std_msgs::msg::dds_::String_", {});
  ASSERT_TRUE(at_first.wait(has_mismatch));
  const Event seen_by_first = at_first.take().back();
  EXPECT_EQ(seen_by_first.topic, topic);
  EXPECT_EQ(seen_by_first.type, type);
  EXPECT_EQ(seen_by_first.detail, "std_msgs::msg::dds_::String_");
  ASSERT_TRUE(at_second.wait(has_mismatch));
  EXPECT_EQ(at_second.take().back().detail, type);
  EXPECT_EQ(reader.matched(), 0U);
}

TEST_F(Participants, ReportEachOthersComingAndGoing) {
  Inbox<Event> events;
  Participant stays{config([&](const Event& event) { events.put(event); })};
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
  EXPECT_EQ(all[0].kind, Event::Kind::peer_found);
  EXPECT_EQ(all[0].peer, guid);
  EXPECT_EQ(all[0].detail, "lidar");
  EXPECT_EQ(all[1].kind, Event::Kind::matched);
  EXPECT_EQ(all[1].topic, topic);
  EXPECT_THAT(all[1].peer, testing::StartsWith(guid));
  EXPECT_EQ(all[1].matched, 1U);
  EXPECT_EQ(all[2].kind, Event::Kind::unmatched);
  EXPECT_EQ(all[2].matched, 0U);
  EXPECT_EQ(all[3].kind, Event::Kind::peer_lost);
  EXPECT_EQ(all[3].peer, guid);
}

TEST_F(Participants, RefuseToSendWhatIsNoPlainCdr) {
  Participant participant{config()};
  Writer writer = participant.create_writer(topic, type, {}, 1000);
  EXPECT_EQ(writer.write(Bytes{}).error(), WriteError::bad_encapsulation);
  EXPECT_EQ(writer.write(hex("000100")).error(), WriteError::bad_encapsulation);
  EXPECT_EQ(writer.write(hex("00020000 00000000")).error(), WriteError::bad_encapsulation);  // PL_CDR_BE
  EXPECT_EQ(writer.write(hex("00070000 00000000")).error(), WriteError::bad_encapsulation);  // XCDR2
  EXPECT_EQ(writer.write(hex("01010000 00000000")).error(), WriteError::bad_encapsulation);
  EXPECT_EQ(writer.write(make_sample(1001, 1)).error(), WriteError::oversize);
  EXPECT_TRUE(writer.write(make_sample(1000, 1)));
  const WriterCounters counters = writer.counters();
  EXPECT_EQ(counters.bad_encapsulation, 5U);
  EXPECT_EQ(counters.oversize, 1U);
  EXPECT_EQ(counters.sent, 1U);
  EXPECT_EQ(counters.sent_bytes, 1000U);
}

TEST_F(Participants, DropAndCountSamplesAboveTheReadersLimit) {
  Participant from{config()};
  Participant to{config()};
  Inbox<Bytes> inbox;
  Writer writer = from.create_writer(topic, type, {});
  const Reader reader = to.create_reader(topic, type, {}, into(inbox), 1000);
  ASSERT_TRUE(matched(writer, reader));
  ASSERT_TRUE(writer.write(make_sample(1004, 1)));
  ASSERT_TRUE(writer.write(make_sample(200'000, 2)));
  ASSERT_TRUE(writer.write(make_sample(1000, 3)));
  ASSERT_TRUE(inbox.wait_for_count(1));
  EXPECT_THAT(inbox.take(), ElementsAre(make_sample(1000, 3)));
  EXPECT_EQ(reader.counters().oversize, 2U);
  EXPECT_EQ(reader.counters().received, 1U);
}

TEST_F(Participants, LendSamplesThatStayWhileOthersCome) {
  Participant from{config()};
  Participant to{config()};
  Inbox<Sample> held;
  const Qos shallow{.reliable = true, .transient_local = false, .depth = 1};
  Writer writer = from.create_writer(topic, type, {.reliable = true, .transient_local = false, .depth = 40});
  const Reader reader =
      to.create_reader(topic, type, shallow, [&](Sample sample) { held.put(std::move(sample)); });
  ASSERT_TRUE(matched(writer, reader));
  // Far more than the history holds are kept at once, small and large ones.
  for (std::uint32_t i = 0; i < 40; ++i) {
    ASSERT_TRUE(writer.write(make_sample(i % 2 == 0 ? 1000 : 300'000, i)));
    ASSERT_TRUE(held.wait_for_count(i + 1));
  }
  const std::vector<Sample> samples = held.take();
  for (std::uint32_t i = 0; i < 40; ++i) {
    EXPECT_TRUE(copy(samples[i].cdr()) == make_sample(i % 2 == 0 ? 1000 : 300'000, i)) << i;
  }
}

TEST_F(Participants, LendSamplesToOtherThreads) {
  constexpr std::uint32_t count = 400;
  Participant from{config()};
  Participant to{config()};
  std::array<Inbox<Sample>, 2> queues;
  std::atomic<std::uint32_t> arrived = 0;
  std::atomic<std::uint32_t> intact = 0;
  Writer writer = from.create_writer(topic, type, {.reliable = true, .transient_local = false, .depth = 64});
  const Reader reader = to.create_reader(
      topic, type, {.reliable = true, .transient_local = false, .depth = 64}, [&](Sample sample) {
        const std::uint32_t index = arrived++;
        queues[index % 2].put(std::move(sample));
      });
  ASSERT_TRUE(matched(writer, reader));
  std::vector<std::thread> workers;
  workers.reserve(queues.size());
  for (Inbox<Sample>& queue : queues) {
    workers.emplace_back([&] {
      for (std::uint32_t done = 0; done < count / 2;) {
        if (!queue.wait_for_count(1)) {
          return;
        }
        for (Sample& sample : queue.take()) {
          const std::size_t size = sample.cdr().size();
          const auto seed = static_cast<std::uint32_t>(sample.sequence() - 1);
          intact += copy(sample.cdr()) == make_sample(size, seed) ? 1 : 0;
          sample.release();
          EXPECT_THAT(sample.cdr(), IsEmpty());
          ++done;
        }
      }
    });
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    ASSERT_TRUE(writer.write(make_sample(4 * (1 + i * 100), i)));
    if (i % 32 == 31) {
      ASSERT_TRUE(writer.wait_until_received(test::patience));
    }
  }
  for (std::thread& worker : workers) {
    worker.join();
  }
  EXPECT_EQ(intact, count);
}

TEST_F(Participants, LendSamplesThatOutliveReaderAndParticipant) {
  std::vector<Sample> samples;
  {
    Participant from{config()};
    Participant to{config()};
    Inbox<Sample> held;
    Writer writer = from.create_writer(topic, type, {});
    const Reader reader =
        to.create_reader(topic, type, {}, [&](Sample sample) { held.put(std::move(sample)); });
    ASSERT_TRUE(matched(writer, reader));
    ASSERT_TRUE(writer.write(make_sample(100, 1)));
    ASSERT_TRUE(writer.write(make_sample(1'000'000, 2)));
    ASSERT_TRUE(held.wait_for_count(2));
    samples = held.take();
  }
  EXPECT_EQ(copy(samples[0].cdr()), make_sample(100, 1));
  EXPECT_TRUE(copy(samples[1].cdr()) == make_sample(1'000'000, 2));
  samples[0] = std::move(samples[1]);
  EXPECT_THAT(samples[1].cdr(), IsEmpty());
  EXPECT_TRUE(copy(samples[0].cdr()) == make_sample(1'000'000, 2));
}

TEST_F(Participants, StopCallingWhenAReaderIsDestroyed) {
  Participant from{config()};
  Participant to{config()};
  Writer writer = from.create_writer(topic, type, {});
  for (int round = 0; round < 10; ++round) {
    auto inbox = std::make_unique<Inbox<Bytes>>();
    auto reader = std::make_unique<Reader>(to.create_reader(topic, type, {}, into(*inbox)));
    ASSERT_TRUE(matched(writer, *reader));
    std::thread busy{[&] {
      for (std::uint32_t i = 0; i < 20; ++i) {
        EXPECT_TRUE(writer.write(make_sample(100'000, i)));
      }
    }};
    EXPECT_TRUE(inbox->wait_for_count(1));
    reader.reset();
    inbox.reset();  // a late callback would now be a use after free
    busy.join();
    ASSERT_TRUE(eventually([&] { return writer.matched() == 0; }));
  }
}

TEST_F(Participants, CountTheSamplesThatAReaderMayLackBecauseTheyWereOverwritten) {
  for (const bool transient_local : {false, true}) {
    for (const std::size_t size : {100U, 200'000U}) {
      SCOPED_TRACE(size);
      const Qos three{.reliable = true, .transient_local = transient_local, .depth = 3};
      Participant from{config()};
      Participant to{config()};
      Participant good{config()};
      Stuck stuck;
      Inbox<Bytes> inbox;
      Writer writer = from.create_writer(topic, type, three);
      const Reader other = good.create_reader(topic, type, three, into(inbox));
      const Reader reader = to.create_reader(topic, type, three, [&](const Sample&) { stuck.wait_once(); });
      ASSERT_TRUE(eventually([&] { return writer.matched() == 2; }));
      ASSERT_TRUE(writer.write(make_sample(size, 1)));
      ASSERT_TRUE(stuck.wait_until_stuck());
      // The history holds three: 1, 2, 3.
      ASSERT_TRUE(writer.write(make_sample(size, 2)));
      ASSERT_TRUE(writer.write(make_sample(size, 3)));
      EXPECT_EQ(writer.counters().overwritten, 0U);
      for (std::uint32_t i = 4; i <= 9; ++i) {
        ASSERT_TRUE(inbox.wait_for_count(i - 1));  // all have left: what is stuck is the reader alone
        ASSERT_TRUE(writer.write(make_sample(size, i)));
        EXPECT_TRUE(eventually([&] { return writer.counters().overwritten == i - 3; }));
      }
      stuck.free();
      EXPECT_TRUE(writer.wait_until_received(patience));
      // Now that all have been acknowledged, nothing is overwritten that is missing anywhere.
      for (std::uint32_t i = 10; i <= 20; ++i) {
        ASSERT_TRUE(writer.write(make_sample(size, i)));
        ASSERT_TRUE(writer.wait_until_received(patience));
      }
      EXPECT_EQ(writer.counters().overwritten, 6U);
      EXPECT_EQ(writer.counters().sent, 20U);
    }
  }
}

TEST_F(Participants, CountNothingAsOverwrittenThatNobodyWaitsFor) {
  for (const bool reliable : {true, false}) {
    Participant from{config()};
    Participant to{config()};
    Writer writer =
        from.create_writer(topic, type, {.reliable = reliable, .transient_local = false, .depth = 1});
    for (std::uint32_t i = 0; i < 5; ++i) {
      ASSERT_TRUE(writer.write(make_sample(100, i)));  // no reader is there
    }
    EXPECT_EQ(writer.counters().overwritten, 0U);
    Stuck stuck;
    const Reader reader =
        to.create_reader(topic, type, {.reliable = false, .transient_local = false, .depth = 1},
                         [&](const Sample&) { stuck.wait_once(); });
    ASSERT_TRUE(matched(writer, reader));
    ASSERT_TRUE(writer.write(make_sample(100, 5)));
    ASSERT_TRUE(stuck.wait_until_stuck());
    for (std::uint32_t i = 0; i < 5; ++i) {
      ASSERT_TRUE(writer.write(make_sample(100, i)));  // its reader takes what comes, and says nothing
    }
    EXPECT_EQ(writer.counters().overwritten, 0U);
    stuck.free();
  }
}

TEST_F(Participants, ShareATopicAmongReadersAndWriters) {
  Participant from{config()};
  Participant to{config()};
  Inbox<Bytes> first;
  Inbox<Bytes> second;
  Writer writer = from.create_writer(topic, type, {});
  const Reader one = to.create_reader(topic, type, {}, into(first));
  std::optional<Reader> two = to.create_reader(topic, type, {}, into(second));
  ASSERT_TRUE(eventually([&] { return writer.matched() == 2; }));
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

TEST_F(Participants, SayWhyTheyCannotBeMade) {
  ParticipantConfig bad = config();
  bad.domain = 233;
  EXPECT_EQ(message_of([&] { Participant{bad}; }), "DDS domain 233 is out of range: 0 to 232");
  bad = config();
  bad.interfaces = {"lo"};
  EXPECT_EQ(message_of([&] { Participant{bad}; }), "DDS interface 'lo' is not an IPv4 address");
  bad.interfaces = {"127.0.0.1", "192.0.2.77"};
  EXPECT_THAT(
      message_of([&] { Participant{bad}; }),
      HasSubstr("no interface of this host has the address 192.0.2.77, which DDS is to use; there are: "));
  EXPECT_THAT(message_of([&] { Participant{bad}; }), HasSubstr("127.0.0.1"));
}

TEST_F(Participants, RefuseALeaseThatNobodyCanKeep) {
  for (const std::chrono::nanoseconds lease : {std::chrono::nanoseconds{std::chrono::milliseconds{99}},
                                               std::chrono::nanoseconds{std::chrono::hours{25}}}) {
    ParticipantConfig settings = config();
    settings.lease = lease;
    EXPECT_THAT(message_of([&] { Participant participant{settings}; }), HasSubstr("100 ms to 24 h"));
  }
}

TEST_F(Participants, RefuseEndpointsThatMakeNoSense) {
  Participant participant{config()};
  EXPECT_THAT(message_of([&] { (void)participant.create_writer("", type, {}); }),
              HasSubstr("1 to 255 characters"));
  EXPECT_THAT(message_of([&] { (void)participant.create_writer(topic, "", {}); }),
              HasSubstr("1 to 255 characters"));
  EXPECT_THAT(message_of([&] { (void)participant.create_writer(std::string(256, 't'), type, {}); }),
              HasSubstr("1 to 255 characters"));
  EXPECT_THAT(message_of([&] { (void)participant.create_writer(topic, type, {.depth = 0}); }),
              HasSubstr("history depth 0 is out of range"));
}

}  // namespace
}  // namespace trestle::dds::participant_test
