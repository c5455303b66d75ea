#include "dds_adapter/participant.hpp"

#include <gmock/gmock.h>

#include <algorithm>

#include "test/dds_adapter/participants.hpp"

namespace trestle::dds::participant_bounds_test {
namespace {

using test::eventually;
using test::hex;
using test::Inbox;
using test::into;
using test::make_sample;
using test::matched;
using test::message_of;
using test::Participants;
using test::patience;
using test::Stuck;
using testing::ElementsAre;
using testing::HasSubstr;
using Bytes = std::vector<std::byte>;

constexpr const char* topic = test::points_topic;
constexpr const char* type = test::points_type;

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
    ASSERT_TRUE(
        eventually([&] { return writer.matched() == 2 && other.matched() == 1 && reader.matched() == 1; }));
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
      ASSERT_TRUE(
          eventually([&] { return writer.matched() == 2 && other.matched() == 1 && reader.matched() == 1; }));
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
}  // namespace trestle::dds::participant_bounds_test
