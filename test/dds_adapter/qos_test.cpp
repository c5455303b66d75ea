#include <gmock/gmock.h>

#include <algorithm>
#include <optional>
#include <tuple>

#include "test/dds_adapter/dds_test.hpp"

namespace trestle::test::qos_test {
namespace {

using namespace dds;
using testing::Each;
using Bytes = std::vector<std::byte>;

constexpr const char* topic = "rt/points";
constexpr const char* type = "sensor_msgs::msg::dds_::PointCloud2_";

class QualityOfService : public DdsTest {
 protected:
  [[nodiscard]] ParticipantConfig node(const std::string& name, Inbox<Happening>& events) const {
    ParticipantConfig result = config([&](const Happening& event) { events.put(event); });
    result.node = name;
    return result;
  }

  /// Waits for an event of this kind that is as wanted.
  template <typename Wanted>
  static std::optional<Happening> event(Inbox<Happening>& events, Happening::Kind kind,
                                        const Wanted& wanted) {
    std::optional<Happening> found;
    events.wait([&](const auto& all) {
      const auto at =
          std::ranges::find_if(all, [&](const Happening& one) { return one.kind == kind && wanted(one); });
      if (at != all.end()) {
        found = *at;
      }
      return found.has_value();
    });
    return found;
  }
  static std::size_t count(Inbox<Happening>& events, Happening::Kind kind) {
    const auto all = events.take();
    return static_cast<std::size_t>(std::ranges::count(all, kind, &Happening::kind));
  }
};

struct Pair {
  const char* policies;
  Qos offered;
  Qos wanted;
};

Qos with(void (*change)(Qos&)) {
  Qos result;
  change(result);
  return result;
}

TEST_F(QualityOfService, ThatKeepsEndpointsApartIsNamedWithThePeersNode) {
  const std::vector<Pair> pairs{
      {"reliability", with([](Qos& qos) { qos.reliable = false; }), Qos{}},
      {"durability", with([](Qos& qos) { qos.reliable = false; }), with([](Qos& qos) {
         qos.reliable = false;
         qos.transient_local = true;
       })},
      {"deadline", with([](Qos& qos) { qos.deadline = 2s; }), with([](Qos& qos) { qos.deadline = 1s; })},
      {"deadline", Qos{}, with([](Qos& qos) { qos.deadline = 1s; })},
      {"liveliness", with([](Qos& qos) { qos.liveliness_lease = 2s; }),
       with([](Qos& qos) { qos.liveliness_lease = 1s; })},
      {"liveliness", Qos{}, with([](Qos& qos) { qos.manual_liveliness = true; })},
      {"deadline, liveliness", Qos{}, with([](Qos& qos) {
         qos.deadline = 1s;
         qos.liveliness_lease = 1s;
       })},
  };
  for (const Pair& pair : pairs) {
    SCOPED_TRACE(pair.policies);
    Inbox<Happening> at_writer;
    Inbox<Happening> at_reader;
    Participant from{node("/front/lidar", at_writer)};
    Participant to{node("/rviz", at_reader)};
    const Writer writer = from.create_writer(topic, type, pair.offered);
    const Reader reader = to.create_reader(topic, type, pair.wanted, [](const Sample&) {});
    const auto of_writer = event(at_writer, Happening::Kind::incompatible_qos,
                                 [](const Happening& one) { return one.node == "/rviz"; });
    ASSERT_TRUE(of_writer);
    EXPECT_EQ(of_writer->topic, topic);
    EXPECT_EQ(of_writer->peer.substr(0, 24), to.guid());
    EXPECT_EQ(of_writer->detail, pair.policies);
    const auto of_reader = event(at_reader, Happening::Kind::incompatible_qos,
                                 [](const Happening& one) { return one.node == "/front/lidar"; });
    ASSERT_TRUE(of_reader);
    EXPECT_EQ(of_reader->peer.substr(0, 24), from.guid());
    EXPECT_EQ(of_reader->detail, pair.policies);
    // The name may come, by another thread, before it is counted.
    EXPECT_TRUE(eventually([&] { return writer.counters().incompatible_qos == 1; }));
    EXPECT_TRUE(eventually([&] { return reader.counters().incompatible_qos == 1; }));
    EXPECT_EQ(writer.matched(), 0U);
  }
}

// Also where it matches, as Fast DDS makes us announce more than we keep.
TEST_F(QualityOfService, OfAVolatileWriterIsNamedToWhoWantsWhatWasBefore) {
  const Qos wants_history = with([](Qos& qos) { qos.transient_local = true; });
  const auto is_rviz = [](const Happening& one) { return one.node == "/rviz"; };
  Inbox<Happening> at_writer;
  Participant from{node("/front/lidar", at_writer)};
  Inbox<Happening> unused;
  Participant to{node("/rviz", unused)};
  const Writer early = from.create_writer(topic, type, Qos{});
  const Reader volatile_one = to.create_reader(topic, type, Qos{}, [](const Sample&) {});
  ASSERT_TRUE(eventually([&] { return early.matched() == 1; }));
  EXPECT_EQ(early.counters().incompatible_qos, 0U);

  const Reader reader = to.create_reader(topic, type, wants_history, [](const Sample&) {});
  const auto found = event(at_writer, Happening::Kind::incompatible_qos, is_rviz);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->topic, topic);
  EXPECT_EQ(found->peer.substr(0, 24), to.guid());
  EXPECT_EQ(found->detail, "durability");
  EXPECT_TRUE(eventually([&] { return early.counters().incompatible_qos == 1; }));

  std::ignore = at_writer.take();
  const Writer late = from.create_writer(topic, type, Qos{});
  ASSERT_TRUE(event(at_writer, Happening::Kind::incompatible_qos, is_rviz));
  EXPECT_TRUE(eventually([&] { return late.counters().incompatible_qos == 1; }));
  const Writer keeps = from.create_writer(topic, type, wants_history);
  ASSERT_TRUE(eventually([&] { return keeps.matched() == 2; }));
  EXPECT_EQ(keeps.counters().incompatible_qos, 0U);
  EXPECT_EQ(early.counters().incompatible_qos, 1U);
}

// As `ros2 topic echo` does, which asks for the durability that it sees, and comes and goes.
TEST_F(QualityOfService, OfAVolatileWriterIsNoReasonToGiveWhatIsOld) {
  const Qos wants_history = with([](Qos& qos) { qos.transient_local = true; });
  Participant from{config()};
  Participant to{config()};
  Writer writer = from.create_writer(topic, type, Qos{});
  Inbox<Bytes> inbox;
  const auto read = [&](const Qos& qos) {
    return to.create_reader(topic, type, qos, [&](const Sample& sample) { inbox.put(copy(sample.cdr())); });
  };
  {
    const Reader early = read(Qos{});
    ASSERT_TRUE(eventually([&] { return writer.matched() == 1 && early.matched() == 1; }));
    ASSERT_TRUE(writer.write(make_sample(100, 1)));
    ASSERT_TRUE(inbox.wait_for_count(1));
  }
  ASSERT_TRUE(eventually([&] { return writer.matched() == 0; }));
  writer.forget_written();
  const Reader asks_more = read(wants_history);  // served, or not, by the version of Fast DDS
  const Reader late = read(Qos{});
  ASSERT_TRUE(eventually([&] { return writer.matched() > 0 && late.matched() == 1; }));
  // Again and again, as it may be late, too.
  ASSERT_TRUE(eventually([&] { return !writer.write(make_sample(100, 2)) || inbox.size() > 2; }));
  std::vector<Bytes> got = inbox.take();
  ASSERT_FALSE(got.empty());
  EXPECT_EQ(got.front(), make_sample(100, 1));
  got.erase(got.begin());
  EXPECT_THAT(got, Each(make_sample(100, 2)));
}

TEST_F(QualityOfService, MatchesWhereMoreIsOfferedThanWanted) {
  const auto more = [](Qos& qos) {
    qos.transient_local = true;
    qos.deadline = 10s;
    qos.manual_liveliness = true;
    qos.liveliness_lease = 10s;
  };
  Participant from{config()};
  Participant to{config()};
  const Writer writer = from.create_writer(topic, type, with(more));
  const Reader asks_nothing = to.create_reader(topic, type, Qos{}, [](const Sample&) {});
  const Reader asks_less = to.create_reader(topic, type, with([](Qos& qos) {
                                              qos.deadline = 20s;
                                              qos.liveliness_lease = 20s;
                                            }),
                                            [](const Sample&) {});
  EXPECT_TRUE(eventually([&] { return writer.matched() == 2; }));
  EXPECT_EQ(writer.counters().incompatible_qos, 0U);
}

TEST_F(QualityOfService, CountsMissedDeadlinesAndTellsTheFirstOfARow) {
  Inbox<Happening> at_writer;
  Inbox<Happening> at_reader;
  Participant from{config([&](const Happening& one) { at_writer.put(one); })};
  Participant to{config([&](const Happening& one) { at_reader.put(one); })};
  const Qos often = with([](Qos& qos) { qos.deadline = 30ms; });
  Inbox<Bytes> inbox;
  Writer writer = from.create_writer(topic, type, often);
  const Reader reader =
      to.create_reader(topic, type, often, [&](const Sample& sample) { inbox.put(copy(sample.cdr())); });
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1 && reader.matched() == 1; }));
  for (const std::uint32_t round : {1U, 2U}) {
    ASSERT_TRUE(writer.write(make_sample(100, round)));
    ASSERT_TRUE(inbox.wait_for_count(round));
    const std::uint64_t writer_before = writer.counters().deadlines_missed;
    const std::uint64_t reader_before = reader.counters().deadlines_missed;
    ASSERT_TRUE(eventually([&] {
      return writer.counters().deadlines_missed >= writer_before + 3 &&
             reader.counters().deadlines_missed >= reader_before + 3;
    }));
  }
  // One for each time that it stopped after a sample (or, before the first one, after the match).
  EXPECT_THAT(count(at_writer, Happening::Kind::deadline_missed),
              testing::AllOf(testing::Ge(2U), testing::Le(3U)));
  EXPECT_THAT(count(at_reader, Happening::Kind::deadline_missed),
              testing::AllOf(testing::Ge(2U), testing::Le(3U)));
}

TEST_F(QualityOfService, NoticesAWriterThatDoesNotShowItself) {
  Inbox<Happening> at_reader;
  Participant from{config()};
  Participant to{config([&](const Happening& one) { at_reader.put(one); })};
  const Qos shows = with([](Qos& qos) {
    qos.manual_liveliness = true;
    qos.liveliness_lease = 50ms;
  });
  Inbox<Bytes> inbox;
  Writer writer = from.create_writer(topic, type, shows);
  const Reader reader =
      to.create_reader(topic, type, shows, [&](const Sample& sample) { inbox.put(copy(sample.cdr())); });
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1 && reader.matched() == 1; }));
  ASSERT_TRUE(writer.write(make_sample(100, 1)));
  ASSERT_TRUE(inbox.wait_for_count(1));
  ASSERT_TRUE(event(at_reader, Happening::Kind::liveliness_lost,
                    [&](const Happening& one) { return one.peer.starts_with(from.guid()); }));
  EXPECT_TRUE(eventually([&] { return reader.counters().liveliness_lost > 0; }));
  EXPECT_TRUE(eventually([&] { return writer.counters().liveliness_lost > 0; }));
}

TEST_F(QualityOfService, DoesNotGiveLateReadersWhatHasExpired) {
  Participant from{config()};
  Participant to{config()};
  const Qos short_lived = with([](Qos& qos) {
    qos.transient_local = true;
    qos.lifespan = 50ms;
  });
  Writer writer = from.create_writer(topic, type, short_lived);
  ASSERT_TRUE(writer.write(make_sample(100, 1)));
  usleep(200'000);  // the time itself is what is tested
  Inbox<Bytes> inbox;
  const Reader reader = to.create_reader(topic, type, with([](Qos& qos) { qos.transient_local = true; }),
                                         [&](const Sample& sample) { inbox.put(copy(sample.cdr())); });
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1 && reader.matched() == 1; }));
  // Again and again, as it may be late, too.
  ASSERT_TRUE(eventually([&] { return !writer.write(make_sample(100, 2)) || inbox.size() > 0; }));
  EXPECT_THAT(inbox.take(), Each(make_sample(100, 2)));
}

TEST_F(QualityOfService, RefusesTheNewestWhenEverySampleIsToBeKept) {
  Participant from{config()};
  Participant to{config()};
  const Qos all = with([](Qos& qos) {
    qos.depth = 3;
    qos.keep_all = true;
  });
  Stuck stuck;
  Inbox<std::uint64_t> numbers;
  Writer writer = from.create_writer(topic, type, all);
  const Reader reader = to.create_reader(topic, type, all, [&](const Sample& sample) {
    stuck.wait_once();
    numbers.put(sample.sequence());
  });
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1 && reader.matched() == 1; }));
  ASSERT_TRUE(writer.write(make_sample(100, 1)));
  ASSERT_TRUE(stuck.wait_until_stuck());
  std::size_t sent = 1;
  tl::expected<void, WriteError> result;
  while (sent < 10 && (result = writer.write(make_sample(100, 2)))) {
    ++sent;
  }
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error(), WriteError::timeout);
  EXPECT_LE(sent, 4U);  // the history, and perhaps one that had been acknowledged
  EXPECT_EQ(writer.counters().refused, 1U);
  EXPECT_EQ(writer.counters().overwritten, 0U);
  stuck.free();
  ASSERT_TRUE(numbers.wait_for_count(sent));
}

TEST_F(QualityOfService, RefusesTimesThatMakeNoSense) {
  Participant participant{config()};
  EXPECT_THROW(
      std::ignore = participant.create_writer(topic, type, with([](Qos& qos) { qos.deadline = -1ns; })),
      DdsError);
  EXPECT_THROW(
      std::ignore = participant.create_writer(topic, type, with([](Qos& qos) { qos.lifespan = 24h * 400; })),
      DdsError);
}

}  // namespace
}  // namespace trestle::test::qos_test
