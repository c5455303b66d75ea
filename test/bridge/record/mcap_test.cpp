#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <deque>
#include <filesystem>
#include <fstream>
#include <random>

#include "bridge/record/mcap_reader.hpp"
#include "bridge/record/mcap_writer.hpp"
#include "test/bridge/record/full_disk.hpp"

// What other readers and writers make of files is in mcap_peers_test.py.
namespace trestle::record {
namespace mcap_test {

namespace fs = std::filesystem;
using test::FullDisk;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::vector<std::byte> some_bytes(std::size_t size, unsigned seed) {
  std::mt19937 random{seed};
  std::vector<std::byte> bytes(size);
  for (std::byte& one : bytes) {
    one = static_cast<std::byte>(random());
  }
  return bytes;
}

class Mcap : public ::testing::Test {
 protected:
  Mcap() {
    std::string name = fs::temp_directory_path() / "trestle_mcap_XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  ~Mcap() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string path(const std::string& name) const { return folder_ / name; }

  /// A file with ten messages of 100 bytes in chunks of two.
  [[nodiscard]] std::string written(Compression compression, bool finished = true) const {
    const std::string file = path("written.mcap");
    McapWriter out{file, {.compression = compression, .chunk_bytes = 250}};
    out.add(Schema{.id = 7, .name = "std_msgs/msg/String", .encoding = "ros2msg", .data = "string data\n"});
    out.add(Channel{.id = 3, .schema = 7, .topic = "/text", .encoding = "cdr", .metadata = {{"a", "b"}}});
    out.add(Channel{.id = 4, .topic = "/raw", .encoding = "someip"});
    for (unsigned i = 0; i < 10; ++i) {
      EXPECT_FALSE(out.write(message(i)));
      sent_.push_back(some_bytes(100, i));
    }
    if (finished) {
      EXPECT_FALSE(out.finish());
    }
    return file;
  }

  [[nodiscard]] Entry message(unsigned i) const {
    bytes_.push_back(some_bytes(100, i));
    return {.channel = static_cast<std::uint16_t>(3 + i % 2),
            .sequence = i,
            .log_time = 1000 + i,
            .publish_time = 900 + i,
            .data = bytes_.back()};
  }

  static std::vector<char> read(const std::string& file) {
    std::ifstream in{file, std::ios::binary};
    return {std::istreambuf_iterator<char>{in}, {}};
  }
  std::string changed(const std::vector<char>& bytes) const {
    const std::string file = path("changed.mcap");
    std::ofstream{file, std::ios::binary}.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    return file;
  }

  /// All messages of a file, or what is wrong.
  static std::string all_of(const std::string& file, std::size_t& messages) {
    McapReader in{file};
    messages = 0;
    for (;;) {
      const auto one = in.next();
      if (!one) {
        const auto again = in.next();
        EXPECT_FALSE(again.has_value());
        return to_string(one.error());
      }
      if (!*one) {
        return {};
      }
      ++messages;
    }
  }

  fs::path folder_;
  mutable std::deque<std::vector<std::byte>> bytes_;
  mutable std::vector<std::vector<std::byte>> sent_;
};

TEST_F(Mcap, GivesBackWhatWasWritten) {
  for (const Compression compression : {Compression::none, Compression::lz4, Compression::zstd}) {
    sent_.clear();
    const std::string file = written(compression);
    McapReader in{file};
    for (unsigned i = 0; i < 10; ++i) {
      const auto one = in.next();
      ASSERT_TRUE(one && *one);
      const Entry expected = message(i);
      EXPECT_EQ((*one)->channel, expected.channel);
      EXPECT_EQ((*one)->sequence, expected.sequence);
      EXPECT_EQ((*one)->log_time, expected.log_time);
      EXPECT_EQ((*one)->publish_time, expected.publish_time);
      EXPECT_TRUE(std::ranges::equal((*one)->data, expected.data));
    }
    const auto end = in.next();
    ASSERT_TRUE(end);
    EXPECT_FALSE(*end);
    EXPECT_FALSE(in.cut_off());
    EXPECT_EQ(in.channels().at(3).metadata.at("a"), "b");
    EXPECT_EQ(in.schemas().at(7).data, "string data\n");
    fs::remove(file);
  }
}

TEST_F(Mcap, TellsOfAFileBeforeItIsRead) {
  const std::string file = written(Compression::lz4);
  const McapReader in{file};
  const auto overview = in.overview();
  ASSERT_TRUE(overview);
  EXPECT_TRUE(overview->has_summary);
  EXPECT_EQ(overview->channels.size(), 2U);
  EXPECT_EQ(overview->statistics.messages, 10U);
  EXPECT_EQ(overview->statistics.chunks, 5U);
  EXPECT_EQ(overview->statistics.start, 1000U);
  EXPECT_EQ(overview->statistics.end, 1009U);
  EXPECT_EQ(overview->statistics.by_channel.at(4), 5U);
}

TEST_F(Mcap, DoesNotWriteOverAFile) {
  const std::string file = written(Compression::none);
  EXPECT_THROW((McapWriter{file, {}}), std::system_error);
}

TEST_F(Mcap, ReadsWhatAKilledWriterLeft) {
  const std::string file = written(Compression::zstd, false);
  const std::vector<char> whole = read(file);
  McapReader in{file};
  const auto overview = in.overview();
  ASSERT_TRUE(overview);
  EXPECT_FALSE(overview->has_summary);
  EXPECT_EQ(overview->statistics.messages, 10U);
  // Wherever it breaks off, there is a front of what was written, and no complaint.
  std::size_t before = 0;
  for (std::size_t size = mcap_magic.size() + 40; size < whole.size(); ++size) {
    std::size_t messages = 0;
    EXPECT_EQ(all_of(changed({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)}), messages),
              "");
    EXPECT_GE(messages, before);
    EXPECT_EQ(messages % 2, 0U) << "a chunk has two";
    before = messages;
  }
  EXPECT_EQ(before, 10U);
}

TEST_F(Mcap, SaysWhereAFileBreaksOff) {
  const std::string file = written(Compression::none, false);
  McapReader in{file};
  while (*in.next()) {
  }
  EXPECT_EQ(in.cut_off(), fs::file_size(file));
}

TEST_F(Mcap, RefusesWhatIsNoMcapFile) {
  EXPECT_THROW(McapReader{path("none.mcap")}, std::runtime_error);
  EXPECT_THROW(McapReader{folder_}, std::runtime_error);
  EXPECT_THROW(McapReader{changed({'p', 'c', 'a', 'p'})}, std::runtime_error);
  EXPECT_THROW(McapReader{changed(std::vector<char>(100, 'x'))}, std::runtime_error);
}

// Each place of a small file with another value: it is read, or refused with a place in it.
TEST_F(Mcap, NamesThePlaceOfDamage) {
  const std::vector<char> whole = read(written(Compression::none));
  std::size_t refused = 0;
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::vector<char> bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0xff);
    const std::string file = changed(bytes);
    if (at < mcap_magic.size()) {
      EXPECT_THROW(McapReader{file}, std::runtime_error);
      continue;
    }
    std::size_t messages = 0;
    const std::string wrong = all_of(file, messages);
    EXPECT_LE(messages, 10U);
    EXPECT_THAT(wrong, ::testing::AnyOf("", StartsWith("at byte "))) << at;
    refused += wrong.empty() ? 0 : 1;
    const auto overview = McapReader{file}.overview();
    EXPECT_TRUE(overview || overview.error().offset <= whole.size() + record_head_bytes);
  }
  // Of the chunks every byte but the times and the indexes behind them.
  EXPECT_GT(refused, 1000U);
}

TEST_F(Mcap, SaysWhichFieldIsDamaged) {
  const std::vector<char> whole = read(written(Compression::none));
  const auto chunk =
      static_cast<std::size_t>(std::ranges::find(whole.begin() + 17, whole.end(), '\x06') - whole.begin());
  const auto with = [&](std::size_t at, char value) {
    std::vector<char> bytes = whole;
    bytes[at] = value;
    std::size_t messages = 0;
    return all_of(changed(bytes), messages);
  };
  EXPECT_THAT(with(chunk + 9 + 24, '\x55'),
              StartsWith("at byte " + std::to_string(chunk + 33) + ", chunk.uncompressed_crc: "));
  EXPECT_THAT(with(chunk + 9 + 16, '\x55'), HasSubstr("chunk.records: they should decompress to "));
  EXPECT_THAT(with(chunk + 9 + 16 + 5, '\x55'), HasSubstr("chunk.uncompressed_size: "));
  EXPECT_THAT(with(chunk + 9 + 28, '\x09'), HasSubstr("chunk.compression: "));
  EXPECT_THAT(with(chunk + 9 + 32 + 7, '\x09'), HasSubstr("chunk.records: "));
  EXPECT_THAT(with(chunk + 8, '\x09'), HasSubstr("chunk.length: "));
  // The summary, the last of which is its checksum.
  const McapReader in{changed([&] {
    std::vector<char> bytes = whole;
    bytes[bytes.size() - 9] ^= 1;
    return bytes;
  }())};
  const auto overview = in.overview();
  ASSERT_FALSE(overview);
  EXPECT_EQ(overview.error().field, "footer.summary_crc");
  EXPECT_EQ(overview.error().offset, whole.size() - 12);
}

TEST_F(Mcap, LeavesAWholeFileOnAFullDisk) {
  const std::string file = path("full.mcap");
  McapWriter out{file, {.compression = Compression::none, .chunk_bytes = 250}};
  out.add(Channel{.id = 3, .topic = "/a", .encoding = "someip"});
  out.add(Channel{.id = 4, .topic = "/b", .encoding = "someip"});
  std::error_code error;
  {
    const FullDisk disk{1100};
    for (unsigned i = 0; i < 10; ++i) {
      const std::error_code one = out.write(message(i));
      error = one ? one : error;
    }
  }
  EXPECT_TRUE(error);
  const std::uint64_t kept = out.written().messages;
  EXPECT_GT(kept, 0U);
  EXPECT_EQ(kept + out.lost(), 10U);
  std::size_t messages = 0;
  EXPECT_EQ(all_of(file, messages), "");
  EXPECT_EQ(messages, kept);
  // There is room again.
  EXPECT_FALSE(out.write(message(10)));
  EXPECT_FALSE(out.finish());
  EXPECT_EQ(all_of(file, messages), "");
  EXPECT_EQ(messages, kept + 1);
}

// A channel whose first chunk could not be written is told of again with the next one.
TEST_F(Mcap, WritesAChannelAgainThatGotLost) {
  const std::string file = path("again.mcap");
  McapWriter out{file, {.compression = Compression::none, .chunk_bytes = 1}};
  out.add(Schema{.id = 1, .name = "a/msg/B"});
  out.add(Channel{.id = 3, .schema = 1, .topic = "/a", .encoding = "cdr"});
  {
    const FullDisk disk{60};
    EXPECT_TRUE(out.write(message(0)));
  }
  EXPECT_FALSE(out.write(message(2)));
  EXPECT_FALSE(out.finish());
  std::size_t messages = 0;
  EXPECT_EQ(all_of(file, messages), "");
  EXPECT_EQ(messages, 1U);
}

// 4 GB of zeros would fit a few KB; what they claim is looked at first.
TEST_F(Mcap, DoesNotDecompressWithoutEnd) {
  std::vector<char> whole = read(written(Compression::zstd));
  const auto chunk =
      static_cast<std::size_t>(std::ranges::find(whole.begin() + 17, whole.end(), '\x06') - whole.begin());
  whole[chunk + 9 + 16 + 4] = 1;  // 4 GiB more
  std::size_t messages = 0;
  EXPECT_THAT(all_of(changed(whole), messages), HasSubstr("chunk.uncompressed_size"));
}

}  // namespace mcap_test
}  // namespace trestle::record
