#include "pcaps/capture_file.hpp"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "test/bytes.hpp"
#include "test/source_dir.hpp"

namespace trestle::pcaps::capture_file_test {
namespace {
using test::hex;
using testing::HasSubstr;

const std::string captures = test::source_dir() + "/pcaps/vsomeip/";

struct TemporaryFile {
  explicit TemporaryFile(const std::vector<std::byte>& bytes)
      : path{testing::TempDir() + "capture_file_test_" +
             testing::UnitTest::GetInstance()->current_test_info()->name()} {
    std::ofstream file{path, std::ios::binary};
    for (const std::byte byte : bytes) {
      file.put(static_cast<char>(byte));
    }
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() { std::filesystem::remove(path); }
  std::string path;
};

std::string opening_error(const std::string& path) {
  try {
    CaptureFile file{path};
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(CaptureFile, ReadsAllFrames) {
  CaptureFile file{captures + "rr_udp.pcap"};
  std::uint64_t last = 0;
  while (const auto frame = file.next()) {
    EXPECT_EQ(frame->number, last + 1);
    EXPECT_EQ(frame->link, LinkType::ethernet);
    EXPECT_EQ(frame->wire_bytes, frame->bytes.size());
    last = frame->number;
  }
  EXPECT_EQ(last, 59U);  // capinfos
  EXPECT_EQ(file.error(), "");
}

TEST(CaptureFile, KeepsNanoseconds) {
  const TemporaryFile file{
      hex("4d3cb2a1 0200 0400 00000000 00000000 00000400 65000000"
          "01000000 2a000000 01000000 01000000 45")};
  CaptureFile capture{file.path};
  const auto frame = capture.next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->time.time_since_epoch(), std::chrono::seconds{1} + std::chrono::nanoseconds{42});
  EXPECT_EQ(frame->link, LinkType::raw_ip);
}

TEST(CaptureFile, SaysThatTheFileBreaksOff) {
  const TemporaryFile file{
      hex("4d3cb2a1 0200 0400 00000000 00000000 00000400 65000000"
          "01000000 2a000000 02000000 02000000 45")};
  CaptureFile capture{file.path};
  EXPECT_FALSE(capture.next());
  EXPECT_THAT(capture.error(), HasSubstr("truncated"));
}

TEST(CaptureFile, SaysWhyItCannotBeOpened) {
  EXPECT_EQ(opening_error("/nowhere/x.pcap"),
            "cannot read a capture from /nowhere/x.pcap: No such file or directory");
  EXPECT_THAT(opening_error(captures + "README.md"), HasSubstr("README.md: unknown file format"));
  const TemporaryFile radiotap{hex("4d3cb2a1 0200 0400 00000000 00000000 00000400 7f000000")};
  EXPECT_THAT(opening_error(radiotap.path), HasSubstr("link type IEEE802_11_RADIO is none of Ethernet"));
}

}  // namespace
}  // namespace trestle::pcaps::capture_file_test
