// How the readers and writers of bridges recognise each other.
#include <gmock/gmock.h>

#include <atomic>
#include <optional>

#include "test/dds_adapter/participants.hpp"

namespace trestle::dds::bridge_ends_test {
namespace {

using test::copy;
using test::eventually;
using test::Inbox;
using test::into;
using test::make_sample;
using test::message_of;
using testing::ElementsAre;
using testing::IsEmpty;
using Bytes = std::vector<std::byte>;

class BridgeEnds : public test::Participants {
 protected:
  Writer write(Participant& at, const std::string& bridge, OnMatch on_match = {}) {
    return at.create_writer(test::points_topic, test::points_type, {}, default_max_sample_bytes,
                            {.on_match = std::move(on_match), .bridge = bridge});
  }
  Reader read(Participant& at, Inbox<Bytes>& inbox, const std::string& bridge) {
    return at.create_reader(test::points_topic, test::points_type, {}, into(inbox), default_max_sample_bytes,
                            {.bridge = bridge, .on_bridged = [this](ByteView cdr, const Guid& writer) {
                               bridged_.put({copy(cdr), writer});
                             }});
  }
  Participant a_{config()};
  Participant b_{config()};
  Participant c_{config()};
  Inbox<std::pair<Bytes, Guid>> bridged_;
};

TEST_F(BridgeEnds, TakeFromOthersOnly) {
  Inbox<Bytes> inbox;
  Inbox<Bytes> plain_inbox;
  const Reader reader = read(a_, inbox, "out");
  const Reader plain = read(b_, plain_inbox, "");
  Writer bridge = write(c_, "in");
  Participant other{config()};
  Writer node = write(other, "");
  ASSERT_TRUE(eventually([&] {
    return node.matched() == 2 && bridge.matched() == 1 && plain.matched() == 2 && reader.matched() == 1 &&
           a_.bridge_ends(test::points_topic).size() == 1;
  }));
  const Bytes first = make_sample(100, 1);
  ASSERT_TRUE(eventually([&] {
    EXPECT_TRUE(bridge.write(first));
    usleep(10'000);
    return bridged_.size() > 0;  // they match a little later than they know each other
  }));
  EXPECT_EQ(bridged_.take()[0], std::pair(first, bridge.guid()));
  EXPECT_TRUE(plain_inbox.wait_for_count(1));
  const Bytes second = make_sample(100, 2);
  ASSERT_TRUE(node.write(second));
  ASSERT_TRUE(inbox.wait_for_count(1));
  EXPECT_THAT(inbox.take(), ElementsAre(second));
  EXPECT_GE(reader.counters().from_bridge, 1U);
  EXPECT_EQ(reader.counters().received, 1U);
  EXPECT_EQ(plain.counters().from_bridge, 0U);
}

/// Who matches without being one.
class Counterparts : public BridgeEnds {};

TEST_F(Counterparts, AreThoseWhoMatchAndAreNoBridges) {
  Inbox<Bytes> inbox;
  std::atomic<int> matches = 0;
  Writer writer = write(a_, "in", [&](const Guid&, bool matched) { matches += matched ? 1 : -1; });
  const Reader own = a_.create_reader(test::points_topic, test::points_type, {}, into(inbox));
  EXPECT_THAT(a_.counterparts(test::points_topic, false), IsEmpty()) << "our own is none";
  const Reader bridge = read(b_, inbox, "out");
  const Reader hasty = c_.create_reader(test::points_topic, test::points_type,
                                        {.deadline = std::chrono::milliseconds{10}}, into(inbox));
  auto reader = std::make_optional(c_.create_reader(test::points_topic, test::points_type, {}, into(inbox)));
  const auto found = [&] { return a_.counterparts(test::points_topic, false); };
  ASSERT_TRUE(eventually([&] { return matches == 1 && found().size() == 1; }));
  EXPECT_EQ(found()[0].guid, reader->guid()) << "and not the one that it does not match";
  EXPECT_EQ(found()[0].participant, ParticipantConfig{}.name);
  EXPECT_THAT(found()[0].addresses, ElementsAre("127.0.0.1"));
  EXPECT_THAT(a_.counterparts(test::points_topic, true), IsEmpty()) << "nobody writes";
  EXPECT_THAT(a_.counterparts("rt/other", false), IsEmpty());
  EXPECT_THAT(b_.counterparts(test::points_topic, true), IsEmpty()) << "that writer is the end of a bridge";
  reader.reset();
  EXPECT_TRUE(eventually([&] { return matches == 0 && found().empty(); }));
}

TEST_F(BridgeEnds, TakeThoseThatTheyWant) {
  const auto takes = [](std::string_view wanted) {
    return [wanted](std::string_view other) { return other == wanted; };
  };
  Inbox<Sample> inbox;
  Reader reader = a_.create_reader(test::points_topic, test::points_type, {},
                                   [&](Sample sample) { inbox.put(std::move(sample)); },
                                   default_max_sample_bytes, {.bridge = "out", .takes_bridge = takes("in1")});
  const auto from = [&](Participant& at, const std::string& name) {
    return at.create_writer(test::points_topic, test::points_type, {}, default_max_sample_bytes,
                            {.bridge = name, .takes_bridge = takes("out")});
  };
  Writer wanted = from(b_, "in1");
  Writer other = from(c_, "in2");
  ASSERT_TRUE(eventually([&] {
    return wanted.matched() == 1 && other.matched() == 1 && reader.matched() == 1 &&
           a_.bridge_ends(test::points_topic).size() == 2;
  }));
  ASSERT_TRUE(other.write(make_sample(100, 1)));
  ASSERT_TRUE(wanted.write(make_sample(100, 2)));
  ASSERT_TRUE(inbox.wait_for_count(1));
  ASSERT_TRUE(eventually([&] { return reader.counters().from_bridge == 1; }));
  const auto samples = inbox.take();
  ASSERT_EQ(samples.size(), 1U);
  EXPECT_TRUE(samples[0].from_bridge());
  EXPECT_EQ(samples[0].id().writer, wanted.guid());
}

TEST_F(BridgeEnds, TellOfThemselvesAndGo) {
  const std::uint64_t before = a_.bridge_changes();
  {
    const Writer writer = write(b_, "in,10.0.0.2");
    ASSERT_TRUE(eventually([&] { return a_.bridge_ends(test::points_topic).size() == 1; }));
    const BridgeEnd end = a_.bridge_ends(test::points_topic)[0];
    EXPECT_EQ(end.text, "in,10.0.0.2");
    EXPECT_TRUE(end.writer);
    EXPECT_EQ(end.guid, writer.guid());
    EXPECT_NE(a_.bridge_changes(), before);
    EXPECT_THAT(b_.bridge_ends(test::points_topic), IsEmpty()) << "its own";
    EXPECT_THAT(a_.bridge_ends("rt/else"), IsEmpty());
    ASSERT_TRUE(eventually([&] { return a_.writers().size() == 1; }));
    EXPECT_TRUE(a_.writers()[0].bridge);
  }
  EXPECT_TRUE(eventually([&] { return a_.bridge_ends(test::points_topic).empty(); }));
}

TEST_F(BridgeEnds, RefuseWhatOthersCouldNotRead) {
  for (const std::string& text :
       {std::string{"a;b"}, std::string{"a b"}, std::string(max_bridge_text + 1, 'x')}) {
    EXPECT_THAT(message_of([&] { static_cast<void>(write(a_, text)); }), testing::HasSubstr("user data"))
        << text;
  }
}

}  // namespace
}  // namespace trestle::dds::bridge_ends_test
