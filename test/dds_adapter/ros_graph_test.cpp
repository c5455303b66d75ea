#include <gmock/gmock.h>

#include <optional>

#include "dds_adapter/ros_graph_message.hpp"
#include "test/dds_adapter/dds_test.hpp"

namespace trestle::test::ros_graph_test {
namespace {

using namespace dds;
using dds::detail::decode_entities;
using dds::detail::DecodedEntities;
using dds::detail::encode;
using dds::detail::Gid;
using dds::detail::GidForm;
using dds::detail::ParticipantEntities;
using testing::HasSubstr;

constexpr const char* topic = "rt/points";
constexpr const char* type = "sensor_msgs::msg::dds_::PointCloud2_";
constexpr Qos latched{.reliable = true, .transient_local = true, .depth = 1};

std::string to_hex(const Gid& gid) {
  std::string text;
  for (const std::byte byte : gid) {
    constexpr const char* digits = "0123456789abcdef";
    text += digits[std::to_integer<unsigned>(byte) >> 4U];
    text += digits[std::to_integer<unsigned>(byte) & 15U];
  }
  return text;
}

/// Another participant, which hears what nodes tell of themselves, and may tell something itself.
class RosGraphOfParticipants : public DdsTest {
 protected:
  [[nodiscard]] ParticipantConfig node(const std::string& name, std::size_t gid_bytes = 0) const {
    ParticipantConfig result = config();
    result.node = name;
    result.gid_bytes = gid_bytes;
    return result;
  }

  Reader listen() {
    return other_.create_reader("ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_",
                                latched,
                                [this](const Sample& sample) { heard_.put(decode_entities(sample.cdr())); });
  }

  /// Waits for a snapshot that is as wanted; nothing when there was none.
  template <typename Wanted>
  std::optional<DecodedEntities> hear(const Wanted& wanted) {
    std::optional<DecodedEntities> found;
    heard_.wait([&](const auto& all) {
      for (const auto& one : all) {
        if (one && wanted(*one)) {
          found = one;
        }
      }
      return found.has_value();
    });
    return found;
  }

  Inbox<std::optional<DecodedEntities>> heard_;
  Participant other_{config()};
};

TEST_F(RosGraphOfParticipants, NamesTheNodeAndAllItsReadersAndWriters) {
  const Reader listener = listen();
  Participant participant{node("/front/left/trestle")};
  const auto bare = hear([](const DecodedEntities& heard) { return heard.entities.nodes.size() == 1; });
  ASSERT_TRUE(bare);
  EXPECT_EQ(bare->form, GidForm::iron);
  EXPECT_EQ(bare->entities.nodes[0].name_space, "/front/left");
  EXPECT_EQ(bare->entities.nodes[0].name, "trestle");
  EXPECT_EQ(to_hex(bare->entities.participant), participant.guid() + "000001c1");

  Inbox<Happening> matches;
  ParticipantConfig watching = config([&](const Happening& event) { matches.put(event); });
  const Participant watcher{watching};
  const Writer writer = participant.create_writer(topic, type, {});
  {
    const Reader reader = participant.create_reader(topic, type, {}, [](const Sample&) {});
    const auto both = hear([](const DecodedEntities& heard) {
      return heard.entities.nodes[0].readers.size() == 1 && heard.entities.nodes[0].writers.size() == 1;
    });
    ASSERT_TRUE(both);
    EXPECT_EQ(to_hex(both->entities.nodes[0].readers[0]).substr(0, 24), participant.guid());
    EXPECT_NE(both->entities.nodes[0].readers[0], both->entities.nodes[0].writers[0]);
    EXPECT_EQ(heard_.take().back()->entities, both->entities);  // forget what was said before
  }
  EXPECT_TRUE(hear([](const DecodedEntities& heard) {
    return heard.entities.nodes[0].readers.empty() && heard.entities.nodes[0].writers.size() == 1;
  }));
}

TEST_F(RosGraphOfParticipants, TellsLateListenersTheLastSnapshotOnly) {
  Participant participant{node("/trestle")};
  const Writer first = participant.create_writer(topic, type, {});
  const Writer second = participant.create_writer("rt/other", type, {});
  const Reader listener = listen();
  ASSERT_TRUE(heard_.wait_for_count(1));
  const auto all = heard_.take();
  ASSERT_EQ(all.size(), 1U);
  ASSERT_TRUE(all[0]);
  EXPECT_EQ(all[0]->entities.nodes[0].name_space, "/");
  EXPECT_EQ(all[0]->entities.nodes[0].writers.size(), 2U);
}

TEST_F(RosGraphOfParticipants, IsSilentWithoutANode) {
  const Reader listener = listen();
  Participant silent{config()};
  const Writer writer = silent.create_writer(topic, type, {});
  Participant loud{node("/loud")};
  ASSERT_TRUE(heard_.wait_for_count(1));
  for (const auto& heard : heard_.take()) {
    EXPECT_EQ(to_hex(heard->entities.participant), loud.guid() + "000001c1");
  }
}

TEST_F(RosGraphOfParticipants, HasTheFormThatIsAskedFor) {
  const Reader listener = listen();
  const Participant participant{node("/trestle", 24)};
  const auto heard = hear([](const DecodedEntities&) { return true; });
  ASSERT_TRUE(heard);
  EXPECT_EQ(heard->form, GidForm::humble);
}

class RosGraphForms : public RosGraphOfParticipants {
 protected:
  /// A node of the other participant tells of itself.
  void tell(Writer& writer, GidForm form) const {
    const ParticipantEntities entities{
        .participant = {std::byte{1}},
        .nodes = {{.name_space = "/", .name = "lidar", .readers = {}, .writers = {}}}};
    ASSERT_TRUE(writer.write(encode(entities, form)));
  }
  Writer teller() {
    return other_.create_writer("ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_",
                                latched);
  }
};

TEST_F(RosGraphForms, FollowAPeerOfHumble) {
  const Reader listener = listen();
  Participant participant{node("/trestle")};
  ASSERT_TRUE(hear([](const DecodedEntities& heard) { return heard.form == GidForm::iron; }));
  Writer writer = teller();
  tell(writer, GidForm::humble);
  const auto again = hear([](const DecodedEntities& heard) { return heard.form == GidForm::humble; });
  ASSERT_TRUE(again);
  EXPECT_EQ(again->entities.nodes[0].name, "trestle");
}

TEST_F(RosGraphForms, DoNotGoBack) {
  // Two participants that followed what they heard last would follow each other for ever.
  const Reader listener = listen();
  Participant participant{node("/trestle")};
  Writer writer = teller();
  tell(writer, GidForm::humble);
  ASSERT_TRUE(hear([](const DecodedEntities& heard) { return heard.form == GidForm::humble; }));
  tell(writer, GidForm::iron);
  ASSERT_TRUE(writer.wait_until_received(patience));
  std::ignore = heard_.take();
  const Writer another = participant.create_writer(topic, type, {});
  const auto last =
      hear([](const DecodedEntities& heard) { return heard.entities.nodes[0].writers.size() == 1; });
  ASSERT_TRUE(last);
  EXPECT_EQ(last->form, GidForm::humble);
}

TEST_F(RosGraphForms, StayAsTheyWereAskedFor) {
  const Reader listener = listen();
  Participant participant{node("/trestle", 16)};
  Writer writer = teller();
  tell(writer, GidForm::humble);
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1; }));
  ASSERT_TRUE(writer.wait_until_received(patience));
  const Writer another = participant.create_writer(topic, type, {});
  const auto last =
      hear([](const DecodedEntities& heard) { return heard.entities.nodes[0].writers.size() == 1; });
  ASSERT_TRUE(last);
  EXPECT_EQ(last->form, GidForm::iron);
}

TEST_F(RosGraphOfParticipants, RefusesNamesThatNoNodeCanHave) {
  for (const char* name : {"trestle", "/", "/a/", "//a", "/1", "/a-b", "/\xc3\xa4"}) {
    try {
      const Participant participant{node(name)};
      ADD_FAILURE() << name;
    } catch (const DdsError& error) {
      EXPECT_THAT(error.what(), HasSubstr("is no name of a ROS 2 node"));
    }
  }
  EXPECT_THROW(Participant(node("/trestle", 17)), DdsError);
}

}  // namespace
}  // namespace trestle::test::ros_graph_test
