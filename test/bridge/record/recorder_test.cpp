#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include "bridge/record/mcap_reader.hpp"
#include "bridge/record/recorder.hpp"
#include "pcaps/capture_file.hpp"
#include "test/bridge/record/full_disk.hpp"

namespace trestle::record {
namespace recorder_test {

using namespace std::chrono_literals;
namespace fs = std::filesystem;
using test::FullDisk;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr auto patience = 100s;

class TheRecorder : public ::testing::Test {
 protected:
  TheRecorder() {
    std::string name = fs::temp_directory_path() / "trestle_recorder_XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  ~TheRecorder() override { fs::remove_all(folder_); }

  [[nodiscard]] RecorderSettings settings(const std::string& to) const {
    return {
        .to = folder_ / to, .mcap = {.compression = Compression::none, .chunk_bytes = 1000}, .waits = true};
  }
  static std::uint16_t channel(Recorder& recorder, const std::string& topic = "/a") {
    return recorder
        .add_channel(
            {.topic = topic, .type = "a/msg/B", .schema_encoding = {}, .schema = {}, .encoding = "cdr"})
        .value();
  }
  static void add(Recorder& recorder, std::uint16_t channel, LogTime time, std::size_t bytes = 100) {
    recorder.add(channel, time, time, 0, std::vector<std::byte>(bytes));
  }
  /// Log times of a file's messages.
  static std::vector<LogTime> times(const std::string& file) {
    McapReader in{file};
    std::vector<LogTime> found;
    for (auto one = in.next(); one && *one; one = in.next()) {
      found.push_back((*one)->log_time);
    }
    return found;
  }
  [[nodiscard]] std::string text(const std::string& name) const {
    std::ifstream in{folder_ / name};
    return {std::istreambuf_iterator<char>{in}, {}};
  }
  template <typename Condition>
  static bool comes_true(const Condition& condition) {
    const auto end = std::chrono::steady_clock::now() + patience;
    while (!condition()) {
      if (std::chrono::steady_clock::now() > end) {
        return false;
      }
      std::this_thread::sleep_for(1ms);
    }
    return true;
  }

  fs::path folder_;
};

TEST_F(TheRecorder, WritesAFile) {
  Recorder recorder{settings("one.mcap")};
  const std::uint16_t a = channel(recorder);
  add(recorder, a, 5);
  add(recorder, a, 6);
  recorder.finish();
  EXPECT_THAT(times(folder_ / "one.mcap"), ElementsAre(5, 6));
  EXPECT_FALSE(fs::exists(folder_ / "metadata.yaml"));
  EXPECT_EQ(recorder.counters().messages, 2U);
  EXPECT_FALSE(recorder.counters().lost_any());
}

TEST_F(TheRecorder, BeginsAnotherFileAfterSoManyBytes) {
  RecorderSettings all = settings("bag");
  all.max_file_bytes = 1000;
  Recorder recorder{all};
  const std::uint16_t a = channel(recorder);
  for (LogTime time = 1; time <= 12; ++time) {
    add(recorder, a, time, 200);
  }
  recorder.finish();
  const std::vector<std::string> files = recorder.files();
  ASSERT_GT(files.size(), 2U);
  EXPECT_EQ(files[0], folder_ / "bag/bag_0.mcap");
  EXPECT_EQ(files[1], folder_ / "bag/bag_1.mcap");
  std::vector<LogTime> found;
  for (const std::string& file : files) {
    const std::vector<LogTime> some = times(file);
    EXPECT_LE(some.size(), 4U);
    found.insert(found.end(), some.begin(), some.end());
    EXPECT_THAT(text("bag/metadata.yaml"), HasSubstr(fs::path{file}.filename().string()));
  }
  EXPECT_THAT(found, ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12));
  EXPECT_EQ(recorder.counters().messages, 12U);
  EXPECT_THAT(text("bag/metadata.yaml"), HasSubstr("message_count: 12"));
}

TEST_F(TheRecorder, BeginsAnotherFileAfterSomeTime) {
  RecorderSettings all = settings("some.mcap");
  all.max_file_duration = 10ns;
  Recorder recorder{all};
  const std::uint16_t a = channel(recorder);
  for (const LogTime time : {100U, 109U, 110U, 119U, 125U}) {
    add(recorder, a, time);
  }
  recorder.finish();
  EXPECT_THAT(times(folder_ / "some.mcap"), ElementsAre(100, 109));
  EXPECT_THAT(times(folder_ / "some_1.mcap"), ElementsAre(110, 119));
  EXPECT_THAT(times(folder_ / "some_2.mcap"), ElementsAre(125));
}

// What a program that is killed leaves: all but what came in the last moment.
TEST_F(TheRecorder, WritesAChunkThatIsNotFullAfterAMoment) {
  RecorderSettings all = settings("one.mcap");
  all.flush_after = 1ms;
  Recorder recorder{all};
  add(recorder, channel(recorder), 5);
  EXPECT_TRUE(comes_true([&] { return times(folder_ / "one.mcap").size() == 1; }));
}

TEST_F(TheRecorder, DropsWhatComesTooFastAndCountsIt) {
  RecorderSettings all = settings("one.mcap");
  all.waits = false;
  all.queue_bytes = 1;  // one at a time
  Recorder recorder{all};
  const std::uint16_t a = channel(recorder);
  std::uint64_t added = 0;
  ASSERT_TRUE(comes_true([&] {
    for (int i = 0; i < 1000; ++i) {
      add(recorder, a, ++added);
    }
    return recorder.counters().queue_full > 0;
  }));
  recorder.note_losses({{"dds_lost", "7"}});
  recorder.finish();
  const RecorderCounters counters = recorder.counters();
  EXPECT_TRUE(counters.lost_any());
  EXPECT_EQ(counters.messages + counters.queue_full, added);
  EXPECT_EQ(times(folder_ / "one.mcap").size(), counters.messages);
  // It stands in the file, too.
  const std::string file = text("one.mcap");
  const std::string count = std::to_string(counters.queue_full);
  const auto at = file.find("dropped_queue_full");
  ASSERT_NE(at, std::string::npos);
  EXPECT_EQ(file.substr(at + 18 + 4, count.size()), count);
  EXPECT_THAT(file, HasSubstr("dds_lost"));
}

TEST_F(TheRecorder, GoesOnAfterTheDiskWasFull) {
  RecorderSettings all = settings("one.mcap");
  all.mcap.chunk_bytes = 1;
  Recorder recorder{all};
  const std::uint16_t a = channel(recorder);
  {
    const FullDisk disk{2000};
    LogTime time = 0;
    ASSERT_TRUE(comes_true([&] {
      add(recorder, a, ++time);
      return recorder.counters().write_failed > 0;
    }));
  }
  EXPECT_EQ(recorder.error(), "File too large");
  ASSERT_TRUE(comes_true([&, before = recorder.counters().messages] {
    add(recorder, a, 1'000'000);
    return recorder.counters().messages > before;
  }));
  recorder.finish();
  const std::vector<LogTime> found = times(folder_ / "one.mcap");
  EXPECT_EQ(found.size(), recorder.counters().messages);
  EXPECT_EQ(found.front(), 1U);
  EXPECT_EQ(found.back(), 1'000'000U);
}

TEST_F(TheRecorder, DoesNotWriteOverWhatIsThere) {
  fs::create_directory(folder_ / "bag");
  EXPECT_THROW(Recorder{settings("bag")}, std::system_error);
  std::ofstream{folder_ / "one.mcap"} << "precious";
  EXPECT_THROW(Recorder{settings("one.mcap")}, std::system_error);
  EXPECT_EQ(text("one.mcap"), "precious");
}

TEST_F(TheRecorder, HasNoNumberForMoreChannelsThanAFileCanHave) {
  Recorder recorder{settings("one.mcap")};
  for (int i = 1; i <= 0xffff; ++i) {
    ASSERT_EQ(channel(recorder), i);
  }
  EXPECT_FALSE(recorder.add_channel(
      {.topic = "/z", .type = "a/msg/B", .schema_encoding = {}, .schema = {}, .encoding = {}}));
  recorder.drop_without_channel();
  EXPECT_EQ(recorder.counters().too_many_channels, 1U);
}

// As libpcap reads them, which is what Wireshark uses.
TEST_F(TheRecorder, WritesFramesBesideMessages) {
  RecorderSettings all = settings("one.mcap");
  all.pcapng = folder_ / "one.pcapng";
  Recorder recorder{all};
  const std::vector<std::byte> bytes(61, std::byte{0x42});
  const pcaps::Timestamp time{1'700'000'000'123'456'789ns};
  recorder.add({.time = time, .link = pcaps::LinkType::linux_sll2, .bytes = bytes, .wire_bytes = 100});
  recorder.add({.time = time + 1ns,
                .link = pcaps::LinkType::linux_sll2,
                .bytes = ByteView{bytes}.first(20),
                .wire_bytes = 20});
  recorder.finish();
  EXPECT_EQ(recorder.counters().frames, 2U);
  pcaps::CaptureFile in{folder_ / "one.pcapng"};
  const auto first = in.next();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->time, time);
  EXPECT_EQ(first->link, pcaps::LinkType::linux_sll2);
  EXPECT_EQ(first->wire_bytes, 100U);
  EXPECT_TRUE(std::ranges::equal(first->bytes, bytes));
  const auto second = in.next();
  ASSERT_TRUE(second);
  EXPECT_EQ(second->time, time + 1ns);
  EXPECT_EQ(second->bytes.size(), 20U);
  EXPECT_FALSE(in.next());
  EXPECT_EQ(in.error(), "");
}

}  // namespace recorder_test
}  // namespace trestle::record
