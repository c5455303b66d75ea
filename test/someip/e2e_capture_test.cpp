// What vsomeip 3.7.4 with its E2E plugin sent, recorded in
// pcaps/vsomeip/e2e_events_p01_p04_p05_p07_crc32.pcap: events 0x8031 to 0x8036 of service 0x1234, instance 1.
// Its configuration is not part of the recording; the Data IDs here are what the bytes themselves tell
// (profiles 4 and 7 send them; for profiles 1 and 5 a search over all values found a single one that fits
// every message).
//
// Where vsomeip departs from AUTOSAR, seen here or read in its source:
// - profile 1 covers the payload alone, without the second half of the SOME/IP header;
// - profile 4 puts the instance id into the highest byte of the Data ID, and exceeds AUTOSAR's 4096 bytes;
// - profile 5 sends the CRC's high byte first;
// - profile 7 cuts the length it sends to 16 bits, so that larger messages fail a check;
// - "CRC32" is a profile of its own: a CRC-32 in front of the payload, of what follows it, and nothing else;
// - its checkers take a step across the counter's end for one less than it is.
#include <gmock/gmock.h>

#include <array>
#include <map>
#include <vector>

#include "pcaps/capture_file.hpp"
#include "pcaps/traffic.hpp"
#include "someip/core/e2e/checker.hpp"
#include "someip/core/e2e/crc.hpp"
#include "someip/core/e2e/protector.hpp"
#include "someip/wire/bytes.hpp"
#include "someip/wire/header.hpp"
#include "someip/wire/tp.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/source_dir.hpp"

namespace trestle::someip::e2e {
namespace {

using test::covers;
using test::to_hex;
using Bytes = std::vector<std::byte>;

/// An event as it was before TP cut it.
struct Event {
  Header header;
  Bytes payload;

  /// The second half of the header, which AUTOSAR counts to the Data.
  [[nodiscard]] Bytes front() const {
    std::array<std::byte, header_bytes> room{};
    static_cast<void>(encode_header(header, payload.size(), room));
    return {room.begin() + 8, room.end()};
  }
};

/// All notifications of a capture, by event id, in order.
class Events final : public pcaps::TrafficSink {
 public:
  explicit Events(const char* file) {
    pcaps::CaptureFile capture{test::source_dir() + "/pcaps/vsomeip/" + file};
    pcaps::Traffic traffic{*this};
    while (const auto frame = capture.next()) {
      traffic.on_frame(*frame);
    }
    traffic.finish();
  }
  const std::vector<Event>& of(std::uint16_t event) { return events_[event]; }

  void on_datagram(const pcaps::Origin& /*origin*/, ByteView payload, std::size_t /*missing*/) override {
    for (MessageCursor messages{payload}; const auto message = messages.next();) {
      add(*message);
    }
  }
  void on_stream(const pcaps::Origin& /*origin*/, const pcaps::StreamBytes& /*stream*/) override {}
  void on_stream_closed(const pcaps::Origin& /*origin*/) override {}
  void on_broken_frame(const pcaps::Origin& /*origin*/, const pcaps::FrameError& /*error*/) override {}

 private:
  void add(const Message& message) {
    auto& events = events_[value(message.header.method)];
    const auto segment = decode_tp(message);
    if (!segment) {
      events.push_back({message.header, {message.payload.begin(), message.payload.end()}});
      return;
    }
    if (segment->header.offset == 0) {
      events.push_back({message.header, {}});
      events.back().header.type = MessageType::notification;
    }
    ASSERT_EQ(segment->header.offset, events.back().payload.size());  // recorded in order
    events.back().payload.insert(events.back().payload.end(), segment->slice.begin(), segment->slice.end());
  }

  std::map<std::uint16_t, std::vector<Event>> events_;
};

struct Recording {
  const char* name;
  std::uint16_t event;
  std::size_t count;
  std::size_t payload_bytes;
  Config config;
  bool header_covered = true;
};

std::vector<Recording> recordings() {
  return {
      {"P01NibbleOverThePayloadAlone", 0x8031, 4, 8,
       Profile1{.data_id = 0xa73,
                .data_id_mode = DataIdMode::nibble,
                .data_bits = 64,
                .crc_offset_bits = 0,
                .counter_offset_bits = 8,
                .data_id_nibble_offset_bits = 12},
       false},
      {"P04", 0x8033, 4, 40, Profile4{.data_id = 0x0100002d}},
      {"P05HighByteFirst", 0x8035, 4, 32,
       Profile5{.data_id = 0x012f, .data_bits = 320, .crc_order = std::endian::big}},
      {"P07", 0x8034, 4, 40, Profile7{.data_id = 0x2e}},
      {"P04OverTp", 0x8036, 2, 6000, Profile4{.data_id = 0x01000031, .max_data_bits = 65535 * 8}},
  };
}

class E2eRecording : public testing::TestWithParam<Recording> {
 protected:
  Events capture{"e2e_events_p01_p04_p05_p07_crc32.pcap"};
  const std::vector<Event>& events = capture.of(GetParam().event);

  [[nodiscard]] static Bytes front_of(const Event& event) {
    return GetParam().header_covered ? event.front() : Bytes{};
  }
};

INSTANTIATE_TEST_SUITE_P(Vsomeip, E2eRecording, testing::ValuesIn(recordings()),
                         [](const auto& recording) { return recording.param.name; });

TEST_P(E2eRecording, ChecksAsGood) {
  covers({"feat_req_someip_102", "feat_req_someip_103"});
  ASSERT_EQ(events.size(), GetParam().count);
  auto checker = Checker::create(GetParam().config);
  ASSERT_TRUE(checker);
  std::uint32_t counter = 0;
  for (const Event& event : events) {
    ASSERT_EQ(event.payload.size(), GetParam().payload_bytes);
    const CheckResult result = checker->check(front_of(event), event.payload);
    EXPECT_EQ(result.fault, Fault::none) << to_string(result.fault);
    EXPECT_EQ(result.counter, counter);
    // Profile 1 takes any first counter, and says so.
    const bool first_of_profile1 = counter == 0 && std::holds_alternative<Profile1>(GetParam().config);
    EXPECT_EQ(result.status, first_of_profile1 ? CheckStatus::wrong_sequence : CheckStatus::ok);
    ++counter;
  }
}

TEST_P(E2eRecording, IsMadeAgainBitByBit) {
  covers({"feat_req_someip_102", "feat_req_someip_103"});
  auto protector = Protector::create(GetParam().config);
  auto layout = make_layout(GetParam().config);
  ASSERT_TRUE(protector && layout);
  ASSERT_EQ(events.size(), GetParam().count);
  for (const Event& event : events) {
    const Bytes front = front_of(event);
    Bytes payload = event.payload;
    for (const HeaderField& field :
         {layout->crc, layout->counter, layout->length, layout->data_id, layout->data_id_nibble}) {
      write_field(field, payload, front.size(), ~std::uint64_t{0});  // nothing of the header is left
    }
    ASSERT_NE(to_hex(payload), to_hex(event.payload));
    ASSERT_TRUE(protector->protect(front, payload));
    EXPECT_EQ(to_hex(payload), to_hex(event.payload));
  }
}

TEST_P(E2eRecording, IsAnErrorWithAnyBitFlipped) {
  auto checker = Checker::create(GetParam().config);
  ASSERT_TRUE(checker);
  for (const Event& event : events) {
    Bytes front = front_of(event);
    Bytes payload = event.payload;
    for (Bytes* part : {&front, &payload}) {
      // Of the large message, all bits of the beginning and a sample of the rest.
      for (std::size_t bit = 0; bit < part->size() * 8; bit += bit < 512 ? 1 : 61) {
        const std::byte mask = std::byte{1} << (bit % 8);
        (*part)[bit / 8] ^= mask;
        ASSERT_EQ(checker->check(front, payload).status, CheckStatus::error) << "bit " << bit;
        (*part)[bit / 8] ^= mask;
      }
    }
    EXPECT_EQ(checker->check(front, payload).fault, Fault::none);
  }
}

TEST_P(E2eRecording, IsAnErrorUnderAnotherDataId) {
  Config other = GetParam().config;
  std::visit(
      [](auto& profile) {
        if constexpr (requires { profile.data_id; }) {
          profile.data_id ^= 1U;
        }
      },
      other);
  auto checker = Checker::create(other);
  ASSERT_TRUE(checker);
  for (const Event& event : events) {
    EXPECT_EQ(checker->check(front_of(event), event.payload).status, CheckStatus::error);
  }
}

TEST(E2eVsomeip, HasACrc32ProtectionOfItsOwn) {
  Events capture{"e2e_events_p01_p04_p05_p07_crc32.pcap"};
  ASSERT_EQ(capture.of(0x8032).size(), 4U);
  for (const Event& event : capture.of(0x8032)) {
    ASSERT_EQ(event.payload.size(), 20U);
    EXPECT_EQ(load<std::uint32_t>(event.payload.data()), crc32(ByteView{event.payload}.subspan(4)));
  }
}

TEST(E2eVsomeip, DoesNotSendTheCrcOfProfile5InTheOrderOfAutosar) {
  Events capture{"e2e_events_p01_p04_p05_p07_crc32.pcap"};
  auto autosar = Checker::create(Profile5{.data_id = 0x012f, .data_bits = 320});
  ASSERT_TRUE(autosar);
  ASSERT_EQ(capture.of(0x8035).size(), 4U);
  for (const Event& event : capture.of(0x8035)) {
    EXPECT_EQ(autosar->check(event.front(), event.payload).fault, Fault::crc);
  }
}

}  // namespace
}  // namespace trestle::someip::e2e
