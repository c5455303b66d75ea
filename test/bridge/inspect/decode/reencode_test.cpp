// Every well-formed message of the recordings is written again byte for byte from what was decoded.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "pcaps/capture_file.hpp"
#include "pcaps/traffic.hpp"
#include "sd/wire/message.hpp"
#include "someip/wire/tp.hpp"
#include "test/bytes.hpp"
#include "test/source_dir.hpp"

namespace trestle::pcaps::reencode_test {
namespace {
namespace fs = std::filesystem;
using test::to_hex;

std::vector<std::string> captures() {
  const char* given = std::getenv("TRESTLE_SHARED_PCAPS");
  const fs::path shared =
      given != nullptr ? fs::path{given} : fs::path{test::source_dir() + "/../shared/pcaps/public"};
  std::vector<std::string> found;
  for (const fs::path& folder : {fs::path{test::source_dir() + "/pcaps"}, shared}) {
    if (!fs::is_directory(folder)) {
      continue;
    }
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator{folder}) {
      if (entry.path().extension() == ".pcap" || entry.path().extension() == ".pcapng") {
        found.push_back(entry.path().string());
      }
    }
  }
  std::ranges::sort(found);
  return found;
}

class Reencode : public TrafficSink {
 public:
  void on_datagram(const Origin& origin, ByteView payload, std::size_t) override {
    someip::MessageCursor cursor{payload};
    for (std::size_t begin = 0; const auto message = cursor.next(); begin = cursor.offset()) {
      check(origin.frame, payload.subspan(begin, message->size()), *message);
    }
  }
  void on_stream(const Origin& origin, const StreamBytes& stream) override {
    std::vector<std::byte>& unread = streams_[{origin.from, origin.to}];
    unread.insert(unread.end(), stream.bytes.begin(), stream.bytes.end());
    while (const auto message = someip::decode(unread)) {
      check(origin.frame, ByteView{unread}.first(message->size()), *message);
      unread.erase(unread.begin(), unread.begin() + static_cast<std::ptrdiff_t>(message->size()));
    }
  }
  void on_stream_closed(const Origin&) override {}
  void on_broken_frame(const Origin& origin, const FrameError& error) override {
    ADD_FAILURE() << "frame " << origin.frame << ": " << to_string(error.fault);
  }

  std::size_t messages = 0;
  std::size_t sd_messages = 0;
  std::size_t segments = 0;

 private:
  void check(std::uint64_t frame, ByteView bytes, const someip::Message& message) {
    SCOPED_TRACE("frame " + std::to_string(frame));
    std::vector<std::byte> room(bytes.size());
    const auto again = someip::encode(message.header, message.payload, room);
    ASSERT_TRUE(again);
    ASSERT_EQ(to_hex(*again), to_hex(bytes));
    ++messages;
    check_sd(bytes, message);
    check_segment(bytes, message);
  }
  void check_sd(ByteView bytes, const someip::Message& message) {
    const auto sd_message = sd::decode(message);
    if (!sd_message || sd::find_fault(*sd_message)) {
      return;
    }
    std::vector<std::byte> room(message.payload.size());
    const auto payload = sd::encode(*sd_message, room);
    ASSERT_TRUE(payload);
    EXPECT_EQ(to_hex(*payload), to_hex(bytes.subspan(someip::header_bytes)));
    ++sd_messages;
  }
  void check_segment(ByteView bytes, const someip::Message& message) {
    const auto segment = someip::decode_tp(message);
    if (!segment) {
      return;
    }
    std::vector<std::byte> room(someip::header_bytes + someip::tp_header_bytes);
    const auto head = someip::encode_tp_header(message.header, segment->header, segment->slice.size(), room);
    ASSERT_TRUE(head);
    EXPECT_EQ(to_hex(*head), to_hex(bytes.first(room.size())));
    ++segments;
  }

  std::map<std::pair<Endpoint, Endpoint>, std::vector<std::byte>> streams_;
};

class Captures : public testing::TestWithParam<std::string> {};

TEST_P(Captures, AreWrittenAgainByteForByte) {
  CaptureFile file{GetParam()};
  Reencode reencode;
  Traffic traffic{reencode};
  while (const auto frame = file.next()) {
    traffic.on_frame(*frame);
  }
  traffic.finish();
  EXPECT_EQ(file.error(), "");
  EXPECT_GT(reencode.messages, 0U);
}

INSTANTIATE_TEST_SUITE_P(All, Captures, testing::ValuesIn(captures()),
                         [](const testing::TestParamInfo<std::string>& capture) {
                           std::string name = fs::path{capture.param}.stem().string();
                           std::ranges::replace_if(
                               name, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
                           return name;
                         });

TEST(Captures, OfTheProjectHoldAsMuchAsTheirReadmeSays) {
  const auto count = [](const char* name) {
    CaptureFile file{test::source_dir() + "/pcaps/vsomeip/" + name};
    Reencode reencode;
    Traffic traffic{reencode};
    while (const auto frame = file.next()) {
      traffic.on_frame(*frame);
    }
    return std::array{reencode.messages, reencode.sd_messages, reencode.segments};
  };
  EXPECT_EQ(count("rr_tcp.pcap"), (std::array<std::size_t, 3>{42, 10, 0}));
  EXPECT_EQ(count("sd_many_services_many_entries.pcap"), (std::array<std::size_t, 3>{114, 114, 0}));
  EXPECT_EQ(count("tp_event_1mib_plus.pcap"), (std::array<std::size_t, 3>{1639, 22, 1617}));
}

}  // namespace
}  // namespace trestle::pcaps::reencode_test
