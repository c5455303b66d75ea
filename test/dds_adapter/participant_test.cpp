#include "dds_adapter/participant.hpp"

#include <gmock/gmock.h>

#include <array>
#include <atomic>
#include <thread>

#include "test/dds_adapter/participants.hpp"

namespace trestle::dds::participant_test {
namespace {

using test::copy;
using test::eventually;
using test::Inbox;
using test::into;
using test::make_sample;
using test::matched;
using test::Participants;
using test::patience;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;
using Bytes = std::vector<std::byte>;

constexpr const char* topic = test::points_topic;
constexpr const char* type = test::points_type;
const Qos kept{.reliable = true, .transient_local = true, .depth = 3};

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

}  // namespace
}  // namespace trestle::dds::participant_test
