// Lengths that are wrong, each where it stands: an array that does not fit its message is ignored with the
// message, a Subscribe whose option is broken is refused, what follows a message is no part of it.
#include <gmock/gmock.h>

#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/server_fixture.hpp"

namespace trestle::sd::malformed_lengths_test {
namespace {
using namespace test;
using testing::IsEmpty;

struct WrongLength {
  std::string name;
  std::string answer;  ///< empty: none
  std::uint64_t malformed;
  std::string bytes;
};

void PrintTo(const WrongLength& wrong, std::ostream* out) {
  *out << wrong.name;
}

class WrongLengths : public Server, public testing::WithParamInterface<WrongLength> {};

TEST_P(WrongLengths, AreIgnoredOrRefused) {
  covers({"feat_req_someipsd_44", "feat_req_someipsd_102", "feat_req_someipsd_1163", "feat_req_someipsd_1164",
          "feat_req_someipsd_1220"});
  offer(udp_service);
  machine.receive(hex(GetParam().bytes), client_sd, false);
  const auto sent = machine.sent();
  if (GetParam().answer.empty()) {
    EXPECT_THAT(sent, IsEmpty());
  } else {
    ASSERT_THAT(sent, testing::SizeIs(1));
    EXPECT_THAT(sent.front(), testing::HasSubstr(": " + GetParam().answer + " 1234.5678 v1 group 0001"));
  }
  EXPECT_EQ(machine.events().size(), GetParam().answer == "ack" ? 1U : 0U);
  EXPECT_EQ(machine.discovery.counters().dropped_malformed, GetParam().malformed);
}

// The SOME/IP header and SD's flags | entries | options. Rightly the Length is 0x30, that of the entries
// 0x10, that of the options 0x0c, and that of the option 9.
INSTANTIATE_TEST_SUITE_P(
    OfTheMessage, WrongLengths,
    testing::Values(WrongLength{"None", "ack", 0,
                                "ffff8100 00000030 00000000 01010200 c0000000"
                                "00000010 06000010 12345678 01000003 00000001"
                                "0000000c 0009 04000a00000200119c40"},
                    WrongLength{"Below8", "", 1,
                                "ffff8100 00000007 00000000 01010200 c0000000"
                                "00000010 06000010 12345678 01000003 00000001"
                                "0000000c 0009 04000a00000200119c40"},
                    // The options array ends beyond the message, and what is left over is no message.
                    WrongLength{"TooShort", "", 2,
                                "ffff8100 0000002c 00000000 01010200 c0000000"
                                "00000010 06000010 12345678 01000003 00000001"
                                "0000000c 0009 04000a00000200119c40"},
                    WrongLength{"TooLong", "", 1,
                                "ffff8100 00000031 00000000 01010200 c0000000"
                                "00000010 06000010 12345678 01000003 00000001"
                                "0000000c 0009 04000a00000200119c40"},
                    WrongLength{"MoreBehindTheOptions", "ack", 0,
                                "ffff8100 00000034 00000000 01010200 c0000000"
                                "00000010 06000010 12345678 01000003 00000001"
                                "0000000c 0009 04000a00000200119c40 deadbeef"},
                    WrongLength{"MoreBehindTheMessage", "ack", 1,
                                "ffff8100 00000030 00000000 01010200 c0000000"
                                "00000010 06000010 12345678 01000003 00000001"
                                "0000000c 0009 04000a00000200119c40 deadbeef"}),
    [](const auto& one) { return one.param.name; });

INSTANTIATE_TEST_SUITE_P(OfTheEntries, WrongLengths,
                         testing::Values(WrongLength{"Nothing", "", 1,
                                                     "ffff8100 00000030 00000000 01010200 c0000000"
                                                     "00000000 06000010 12345678 01000003 00000001"
                                                     "0000000c 0009 04000a00000200119c40"},
                                         WrongLength{"LessThanOne", "", 1,
                                                     "ffff8100 00000030 00000000 01010200 c0000000"
                                                     "0000000f 06000010 12345678 01000003 00000001"
                                                     "0000000c 0009 04000a00000200119c40"},
                                         WrongLength{"NoMultiple", "", 1,
                                                     "ffff8100 00000030 00000000 01010200 c0000000"
                                                     "00000011 06000010 12345678 01000003 00000001"
                                                     "0000000c 0009 04000a00000200119c40"},
                                         WrongLength{"IntoTheOptions", "", 1,
                                                     "ffff8100 00000030 00000000 01010200 c0000000"
                                                     "00000020 06000010 12345678 01000003 00000001"
                                                     "0000000c 0009 04000a00000200119c40"},
                                         WrongLength{"BeyondTheMessage", "", 1,
                                                     "ffff8100 00000030 00000000 01010200 c0000000"
                                                     "00000040 06000010 12345678 01000003 00000001"
                                                     "0000000c 0009 04000a00000200119c40"},
                                         WrongLength{"OneOfTwo", "", 1,
                                                     "ffff8100 00000040 00000000 01010200 c0000000"
                                                     "00000010 06000010 12345678 01000003 00000001"
                                                     "         06000010 12345678 01000003 00000001"
                                                     "0000000c 0009 04000a00000200119c40"}),
                         [](const auto& one) { return one.param.name; });

INSTANTIATE_TEST_SUITE_P(OfTheOptions, WrongLengths,
                         testing::Values(WrongLength{"Nothing", "nack", 0,
                                                     "ffff8100 00000030 00000000 01010200 c0000000"
                                                     "00000010 06000010 12345678 01000003 00000001"
                                                     "00000000 0009 04000a00000200119c40"},
                                         WrongLength{"TooShort", "nack", 0,
                                                     "ffff8100 00000030 00000000 01010200 c0000000"
                                                     "00000010 06000010 12345678 01000003 00000001"
                                                     "0000000b 0009 04000a00000200119c40"},
                                         WrongLength{"TooShortAsIsTheMessage", "nack", 0,
                                                     "ffff8100 0000002c 00000000 01010200 c0000000"
                                                     "00000010 06000010 12345678 01000003 00000001"
                                                     "00000008 0009 04000a000002"},
                                         WrongLength{"BeyondTheMessage", "", 1,
                                                     "ffff8100 00000030 00000000 01010200 c0000000"
                                                     "00000010 06000010 12345678 01000003 00000001"
                                                     "0000000d 0009 04000a00000200119c40"},
                                         WrongLength{"FarBeyond", "", 1,
                                                     "ffff8100 00000030 00000000 01010200 c0000000"
                                                     "00000010 06000010 12345678 01000003 00000001"
                                                     "ffffffff 0009 04000a00000200119c40"}),
                         [](const auto& one) { return one.param.name; });

INSTANTIATE_TEST_SUITE_P(
    OfAnOption, WrongLengths,
    testing::Values(WrongLength{"Nothing", "nack", 0,
                                "ffff8100 00000030 00000000 01010200 c0000000"
                                "00000010 06000010 12345678 01000003 00000001"
                                "0000000c 0000 04000a00000200119c40"},
                    WrongLength{"Of4", "nack", 0,
                                "ffff8100 00000030 00000000 01010200 c0000000"
                                "00000010 06000010 12345678 01000003 00000001"
                                "0000000c 0004 04000a00000200119c40"},
                    WrongLength{"BeyondTheArray", "nack", 0,
                                "ffff8100 00000030 00000000 01010200 c0000000"
                                "00000010 06000010 12345678 01000003 00000001"
                                "0000000c 000a 04000a00000200119c40"},
                    WrongLength{"FarBeyond", "nack", 0,
                                "ffff8100 00000030 00000000 01010200 c0000000"
                                "00000010 06000010 12345678 01000003 00000001"
                                "0000000c 00ff 04000a00000200119c40"},
                    // The entry is about the second option, which its predecessor's length has shifted.
                    WrongLength{"IntoTheNext", "nack", 0,
                                "ffff8100 0000003c 00000000 01010200 c0000000"
                                "00000010 06010010 12345678 01000003 00000001"
                                "00000018 000a 04000a00000200119c40 0009 04000a00000200119c40"}),
    [](const auto& one) { return one.param.name; });

}  // namespace
}  // namespace trestle::sd::malformed_lengths_test
