#include "bridge/guest/frame.hpp"

#include <gmock/gmock.h>

#include "test/bytes.hpp"

namespace trestle::guest {
namespace {

using test::hex;
using test::to_hex;

constexpr Endpoint at{IpAddress::v4(10, 0, 0, 1), 30490};

/// Without the length.
std::vector<std::byte> body_of(const Frame& frame) {
  const std::vector<std::byte> bytes = encode(frame);
  return {bytes.begin() + length_bytes, bytes.end()};
}

TEST(GuestFrame, IsTheLengthTheKindAndItsFieldsInNetworkOrder) {
  EXPECT_EQ(to_hex(encode(Find{someip::ServiceId{0x1234}, someip::InstanceId{1}})),
            "00000005"
            "05"
            "12340001");
  EXPECT_EQ(to_hex(encode(Hello{.process = 7, .at = at, .configuration = "a"})),
            "0000001b"
            "00"
            "00000007"
            "0a000001000000000000000000000000"
            "00"
            "771a"
            "0001"
            "61");
  EXPECT_EQ(to_hex(encode(Subscribe{.service = someip::ServiceId{0x1234},
                                    .instance = someip::InstanceId{1},
                                    .major = 2,
                                    .eventgroup = someip::EventgroupId{3},
                                    .events = {someip::MethodId{0x8001}}})),
            "0000000e"
            "07"
            "1234"
            "0001"
            "02"
            "0003"
            "01"
            "00"
            "0001"
            "8001");
}

TEST(GuestFrame, ComesAsItWentWhateverKindItIs) {
  const sd::RemoteService service{.service = someip::ServiceId{0x1234},
                                  .instance = someip::InstanceId{1},
                                  .major = 2,
                                  .minor = 3,
                                  .udp = std::nullopt,
                                  .tcp = Endpoint{IpAddress{{0xfe, 0x80}, true}, 40000},
                                  .peer = at};
  const std::vector<Frame> frames{Hello{.process = 7, .at = at, .configuration = "drive.yaml"},
                                  Found{service},
                                  Answer{.fault = "timed out"},
                                  Answer{.is_answer = true, .message = hex("1234")},
                                  Event{.from = at, .lost = 5, .message = hex("00")},
                                  Said{.is_end = true, .text = "no"},
                                  Find{someip::ServiceId{0x1234}, someip::InstanceId{1}},
                                  Call{.service = someip::ServiceId{1},
                                       .transport = Transport::tcp,
                                       .forget = true,
                                       .payload = hex("0102")},
                                  Subscribe{.service = someip::ServiceId{1}, .udp = false, .tcp = true}};
  for (const Frame& frame : frames) {
    const auto read = decode(body_of(frame));
    ASSERT_TRUE(read) << frame.index();
    EXPECT_EQ(*read, frame) << frame.index();
  }
}

TEST(GuestFrame, IsRefusedWhenItIsCutOffHasMoreOrSaysWhatCannotBe) {
  const std::vector<std::byte> whole = body_of(Find{someip::ServiceId{0x1234}, someip::InstanceId{1}});
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(decode(ByteView{whole}.first(size))) << size;
  }
  EXPECT_FALSE(decode(hex("05 1234 0001 00")));  // one byte more
  EXPECT_FALSE(decode(hex("08 1234 0001")));     // no such kind
  // A call by protocol 7, and a flag that is 2.
  EXPECT_TRUE(decode(hex("06 1234 0001 01 0001 00001388 11 00")));
  EXPECT_FALSE(decode(hex("06 1234 0001 01 0001 00001388 07 00")));
  EXPECT_FALSE(decode(hex("06 1234 0001 01 0001 00001388 11 02")));
  // More events than may be named.
  std::vector<std::byte> many = hex("07 1234 0001 01 0001 01 00 0101");
  many.resize(many.size() + std::size_t{2} * 0x101);
  EXPECT_FALSE(decode(many));
}

TEST(GuestFrame, OfAnEventIsWrittenAsItIsRead) {
  const std::vector<std::byte> payload = hex("0a0b");
  const someip::Message message{{.service = someip::ServiceId{0x1234},
                                 .method = someip::MethodId{0x8001},
                                 .session = someip::SessionId{1},
                                 .interface_version = 1,
                                 .type = someip::MessageType::notification},
                                payload};
  std::vector<std::byte> bytes;
  append_event(bytes, message, at, 9);
  const Event expected{
      .from = at, .lost = 9, .message = hex("1234 8001 0000000a 0000 0001 01 01 02 00 0a0b")};
  EXPECT_EQ(to_hex(bytes), to_hex(encode(expected)));
}

}  // namespace
}  // namespace trestle::guest
