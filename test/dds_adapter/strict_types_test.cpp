// Types of one name with several hashes, and a participant that is strict about it.
#include <gmock/gmock.h>

#include "dds_adapter/ros_names.hpp"
#include "test/dds_adapter/participants.hpp"

namespace trestle::dds::strict_types_test {
namespace {

using test::eventually;
using test::Inbox;
using test::into;
using test::make_sample;
using testing::ElementsAre;
using testing::IsEmpty;
using Bytes = std::vector<std::byte>;

const std::string ours = ros_type_hash_entry("RIHS01_" + std::string(64, 'a'));
const std::string other = ros_type_hash_entry("RIHS01_" + std::string(64, 'b'));

class StrictTypes : public test::Participants {
 protected:
  [[nodiscard]] ParticipantConfig strict() {
    ParticipantConfig result = config([this](const Happening& event) {
      if (event.kind == Happening::Kind::other_type_hash) {
        told_.put(event);
      }
    });
    result.strict_types = true;
    result.node = "/strict";  // who is one hears the names of others
    return result;
  }
  static Writer write(Participant& at, const std::string& user_data, OnMatch on_match = {}) {
    return at.create_writer(test::points_topic, test::points_type, {}, default_max_sample_bytes,
                            {.on_match = std::move(on_match), .user_data = user_data});
  }
  static Reader read(Participant& at, Inbox<Bytes>& inbox, const std::string& user_data) {
    return at.create_reader(test::points_topic, test::points_type, {}, into(inbox), default_max_sample_bytes,
                            {.user_data = user_data});
  }

  Inbox<Happening> told_;
  Participant strict_{strict()};
  Participant peer_{[this] {
    ParticipantConfig result = config();
    result.node = "/peer";
    return result;
  }()};
  Participant third_{config()};
  Inbox<Bytes> wrong_inbox_;
  Inbox<Bytes> right_inbox_;
  Inbox<Bytes> silent_inbox_;
};

// Whoever is there first.
TEST_F(StrictTypes, SendNothingToReadersOfAnother) {
  std::ptrdiff_t rounds = 0;
  for (const bool readers_first : {false, true}) {
    SCOPED_TRACE(readers_first);
    std::optional<Writer> writer;
    if (!readers_first) {
      writer = write(strict_, ours);
    }
    const Reader wrong = read(peer_, wrong_inbox_, other);
    const Reader right = read(third_, right_inbox_, ours);
    const Reader silent = read(third_, silent_inbox_, "");
    if (readers_first) {
      usleep(300'000);  // so that discovery knows them
      writer = write(strict_, ours);
    }
    ASSERT_TRUE(eventually([&] {
      return wrong.matched() == 1 && right.matched() == 1 && silent.matched() == 1 &&
             writer->matched() == 2 && writer->counters().other_type == 1;
    }));
    const Bytes sample = make_sample(1000, 1);
    ASSERT_TRUE(writer->write(sample));
    ASSERT_TRUE(right_inbox_.wait_for_count(1));
    ASSERT_TRUE(silent_inbox_.wait_for_count(1)) << "who tells no hash is not refused";
    ASSERT_TRUE(writer->wait_until_received(test::patience));
    EXPECT_EQ(right_inbox_.take().size() + silent_inbox_.take().size(), 2U);
    EXPECT_EQ(wrong_inbox_.size(), 0U);
    ++rounds;  // and it is there: the name of a reader that has left is not asked for
    ASSERT_TRUE(told_.wait([&](const auto& events) {
      return std::ranges::count(events, "/peer", &Happening::node) == rounds;
    })) << "by name, as soon as it is known";
  }
  const auto told = told_.take();
  EXPECT_TRUE(std::ranges::all_of(told, [](const Happening& one) { return one.refused && !one.ours_reads; }));
  EXPECT_LE(told.size(), 4U);
}

TEST_F(StrictTypes, TakeNothingFromWritersOfAnother) {
  const Reader reader = read(strict_, right_inbox_, ours);
  Writer wrong = write(peer_, other);
  Writer right = write(third_, ours);
  // It matches, as it would wait for acknowledgements else; but it does not count.
  ASSERT_TRUE(eventually([&] {
    return wrong.matched() == 1 && right.matched() == 1 && reader.matched() == 1 &&
           std::ranges::count_if(strict_.writers(), &FoundWriter::refused) == 1;
  }));
  ASSERT_TRUE(wrong.write(make_sample(100, 1)));
  EXPECT_TRUE(wrong.wait_until_received(test::patience));
  const Bytes sample = make_sample(100, 2);
  ASSERT_TRUE(right.write(sample));
  ASSERT_TRUE(right_inbox_.wait_for_count(1));
  EXPECT_THAT(right_inbox_.take(), ElementsAre(sample));
  EXPECT_TRUE(eventually([&] { return reader.counters().other_type == 1; }));
}

TEST_F(StrictTypes, AreOfOneParticipant) {
  Writer writer = write(third_, ours);
  const Reader wrong = read(peer_, wrong_inbox_, other);
  ASSERT_TRUE(test::matched(writer, wrong));
  ASSERT_TRUE(writer.write(make_sample(100, 1)));
  EXPECT_TRUE(wrong_inbox_.wait_for_count(1));
  EXPECT_EQ(writer.counters().other_type, 0U);
}

}  // namespace
}  // namespace trestle::dds::strict_types_test
