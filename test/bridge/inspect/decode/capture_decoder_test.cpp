#include "bridge/inspect/decode/capture_decoder.hpp"

#include <gmock/gmock.h>

#include "test/bridge/inspect/decode/printed.hpp"
#include "test/covers.hpp"
#include "test/pcaps/frames.hpp"

namespace trestle::inspect::capture_decoder_test {
namespace {
using test::covers;
using test::ethernet_frame;
using test::hex;
using test::Printed;
using test::syn;
using test::tcp_frame;
using test::udp_frame;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

// Messages of service 1234: a request, and ones that are broken in one way each.
const std::string request = "1234 0421 0000000a 0001 0001 01 01 00 00 cafe";
const std::string event = "1234 8001 0000000a 0000 0001 01 01 02 00 beef";
const std::string too_long = "1234 0421 0000000b 0001 0001 01 01 00 00 cafe";
const std::string version_2 = "1234 0421 0000000a 0001 0001 02 01 00 00 cafe";
const std::string cut_header = "1234 0421 0000000a 0001";
// An offer at 10.0.0.1, UDP 30509 and TCP 30510.
const std::string offer =
    "ffff8100 0000003c 00000001 01010200 c0000000 00000010 01 00 00 20 1234 5678 01 000003 00000002"
    "00000018 0009 04 00 0a000001 00 11 772d 0009 04 00 0a000001 00 06 772e";

struct Capture {
  explicit Capture(const CaptureDecoder::Options& options = {})
      : decoder{options, printed.hooks().print}, traffic{decoder} {}

  void udp(const std::string& payload, std::uint16_t from_port, std::uint16_t to_port) {
    add(udp_frame(payload, from_port, to_port));
  }
  void tcp(const std::string& payload, std::uint16_t to_port, std::uint32_t sequence, int flags = test::ack) {
    add(tcp_frame(payload, 40000, to_port, sequence, flags));
  }
  void add(const std::vector<std::byte>& bytes) { traffic.on_frame(ethernet_frame(bytes, ++frames)); }
  std::vector<std::string> finish() {
    traffic.finish();
    decoder.finish();
    return printed.summary();
  }

  Printed printed;
  CaptureDecoder decoder;
  pcaps::Traffic traffic;
  std::uint64_t frames = 0;
};

TEST(CaptureDecoder, SaysWhereAMessageComesFrom) {
  Capture capture;
  const auto bytes = udp_frame(request, 40000, 30509);
  capture.traffic.on_frame({7,
                            pcaps::Timestamp{std::chrono::seconds{1795225157} + std::chrono::nanoseconds{42}},
                            pcaps::LinkType::ethernet, bytes, bytes.size()});
  ASSERT_THAT(capture.printed.objects, SizeIs(1));
  const Json& object = capture.printed.objects[0];
  EXPECT_EQ(object["frame"], 7);
  EXPECT_EQ(object["time"], "2026-11-21T01:39:17.000000042Z");  // date -u -d @1795225157
  EXPECT_EQ(object["src"], "10.0.0.1:40000");
  EXPECT_EQ(object["dst"], "10.0.0.2:30509");
  EXPECT_EQ(object["transport"], "udp");
  EXPECT_EQ(object["offset"], 0);
}

TEST(CaptureDecoder, TakesWhatLooksLikeSomeIpOnAnyPort) {
  Capture capture;
  capture.udp(request, 40000, 12345);
  capture.udp(too_long, 40001, 12346);
  capture.udp(version_2, 40002, 12347);
  capture.udp(cut_header, 40003, 12348);
  capture.udp("", 40004, 12349);
  EXPECT_THAT(capture.finish(), ElementsAre("1234.0421@0", "!truncated@4"));
  EXPECT_EQ(capture.decoder.foreign_datagrams(), 3U);
}

TEST(CaptureDecoder, TakesEverythingOnTheSdPortAndOnGivenPorts) {
  for (const std::uint16_t port : {std::uint16_t{30490}, std::uint16_t{555}}) {
    Capture capture{{.reassemble = false, .ports = {555}}};
    capture.udp(version_2, 40000, port);
    capture.udp(cut_header, port, 40000);
    EXPECT_THAT(capture.finish(), ElementsAre("1234.0421@0", "!truncated@10")) << port;
    EXPECT_EQ(capture.decoder.foreign_datagrams(), 0U);
  }
}

TEST(CaptureDecoder, TakesEverythingOnPortsThatSdAnnounced) {
  Capture capture;
  capture.udp(cut_header, 30509, 40000);  // from 10.0.0.1
  capture.udp(offer, 30490, 30490);
  capture.udp(cut_header, 30509, 40000);
  capture.udp(cut_header, 40000, 30509);  // to 10.0.0.2, which has not been announced
  capture.udp(cut_header, 30510, 40000);  // announced for TCP only
  EXPECT_THAT(capture.finish(), ElementsAre("ffff.8100@0", "!truncated@10"));
}

TEST(CaptureDecoder, TakesEverythingOnPortsThatCarriedSomeIpBefore) {
  Capture capture;
  capture.udp(cut_header, 40000, 12345);
  capture.udp(request, 40000, 12345);
  capture.udp(cut_header, 40000, 12345);
  EXPECT_THAT(capture.finish(), ElementsAre("1234.0421@0", "!truncated@10"));
}

TEST(CaptureDecoder, DoesNotGuessOnTheNameServicesPorts) {
  Capture capture;
  // A reverse look-up of an IPv6 address by mDNS: 1.0.0...
  capture.udp("0000 8400 0000 0001 0000 0000 01 31 01 30 01 30", 5353, 5353);
  EXPECT_THAT(capture.finish(), IsEmpty());
  EXPECT_EQ(capture.decoder.foreign_datagrams(), 1U);
}

TEST(CaptureDecoder, ReadsMessagesThatTcpTearsAndJoins) {
  covers({"feat_req_someip_585", "feat_req_someip_702"});
  Capture capture;
  capture.tcp("", 12345, 99, syn);
  const std::string stream = test::to_hex(hex(request + event + request));
  capture.tcp(stream.substr(0, 2 * 5), 12345, 100);
  capture.tcp(stream.substr(2 * 5, 2 * 14), 12345, 105);
  capture.tcp(stream.substr(2 * 19), 12345, 119);
  EXPECT_THAT(capture.finish(), ElementsAre("1234.0421@0", "1234.8001@18", "1234.0421@36"));
  EXPECT_EQ(capture.printed.objects[0]["frame"], 3);
  EXPECT_EQ(capture.printed.objects[1]["frame"], 4);
  EXPECT_EQ(capture.printed.objects[0]["transport"], "tcp");
}

TEST(CaptureDecoder, LeavesOtherTcpConnectionsAlone) {
  Capture capture;
  capture.tcp("", 80, 99, syn);
  capture.tcp("474554202f20485454502f312e310d0a0d0a", 80, 100);  // GET / HTTP/1.1
  capture.tcp(request, 80, 118);
  EXPECT_THAT(capture.finish(), IsEmpty());
  EXPECT_EQ(capture.decoder.foreign_streams(), 1U);
}

TEST(CaptureDecoder, FindsTheNextMessageAfterAGap) {
  Capture capture;
  capture.tcp("", 12345, 99, syn);
  capture.tcp(request + "1234 0421", 12345, 100);
  capture.tcp("00 cafe" + event, 12345, 130);
  EXPECT_THAT(capture.finish(),
              ElementsAre("1234.0421@0", "!stream_gap@22", "!out_of_step@30", "1234.8001@33"));
  EXPECT_EQ(capture.printed.objects[1]["bytes"], "12340421");
}

TEST(CaptureDecoder, WaitsForWhatConfirmsAHeaderAfterAGapButNotForever) {
  // A message of 100,000 bytes right after a gap, and as much of it as is sent.
  const auto after_gap = [](std::size_t sent_bytes, const std::string& then) {
    std::string stream = test::to_hex(hex("1234 8001 00018698 0000 0001 01 01 02 00"));
    stream += std::string(2 * (100'000 - 16), 'a');
    stream.resize(2 * sent_bytes);
    stream += test::to_hex(hex(then));
    Capture capture{{.reassemble = false, .ports = {12345}}};
    capture.tcp("", 12345, 99, syn);
    for (std::size_t at = 0; 2 * at < stream.size(); at += 1000) {
      capture.tcp(stream.substr(2 * at, 2000), 12345, static_cast<std::uint32_t>(200 + at));
    }
    return capture.finish();
  };
  EXPECT_THAT(after_gap(100'000, event), ElementsAre("1234.8001@100", "1234.8001@100100"));
  EXPECT_THAT(after_gap(50'000, ""), ElementsAre("!out_of_step@100"));  // nothing confirms the header
  EXPECT_THAT(after_gap(80'000, ""), ElementsAre("!truncated@104"));    // believed without
}

TEST(CaptureDecoder, FindsTheNextMessageAfterALengthThatCannotBe) {
  covers({"feat_req_someip_586", "feat_req_someip_798"});
  Capture capture;
  capture.tcp("", 12345, 99, syn);
  capture.tcp(request + "1234 0421 00000007 0001 0001 01 01 00 00" + event, 12345, 100);
  capture.tcp("1234 0421 ffffffff 0001 0001 01 01 00 00" + event, 12345, 152);
  EXPECT_THAT(capture.finish(),
              ElementsAre("1234.0421@0", "!bad_length@22", "!out_of_step@26", "1234.8001@34",
                          "!bad_length@56", "!out_of_step@60", "1234.8001@68"));
}

TEST(CaptureDecoder, BeginsInTheMiddleOfAKnownConnection) {
  Capture capture{{.reassemble = false, .ports = {12345}}};
  capture.tcp("0001 01 01 00 00 cafe" + event, 12345, 5000);
  EXPECT_THAT(capture.finish(), ElementsAre("!out_of_step@0", "1234.8001@8"));
}

TEST(CaptureDecoder, ReportsAMessageThatTheCaptureBreaksOff) {
  Capture capture;
  capture.tcp("", 12345, 99, syn);
  capture.tcp("1234 0421 0000000b 0001 0001 01 01 00 00 cafe", 12345, 100);
  EXPECT_THAT(capture.printed.summary(), IsEmpty());
  EXPECT_THAT(capture.finish(), ElementsAre("!truncated@4"));
}

TEST(CaptureDecoder, ReportsAMessageThatANewConnectionBreaksOff) {
  Capture capture;
  capture.tcp("", 12345, 99, syn);
  capture.tcp("1234 0421 0000000b 0001 0001 01 01 00 00 cafe", 12345, 100);
  capture.tcp("", 12345, 777777, syn);
  capture.tcp(request, 12345, 777778);
  EXPECT_THAT(capture.finish(), ElementsAre("!truncated@4", "1234.0421@0"));
}

TEST(CaptureDecoder, ReportsDamagedFrames) {
  Capture capture;
  capture.add(hex("020000000002 020000000001 0800 44000020"));
  ASSERT_THAT(capture.printed.objects, SizeIs(1));
  EXPECT_EQ(capture.printed.objects[0]["frame"], 1);
  EXPECT_EQ(capture.printed.objects[0]["error"]["name"], "ip_header");
  EXPECT_EQ(capture.printed.objects[0]["error"]["offset"], 14);
}

TEST(CaptureDecoder, KeepsTheSegmentsOfDifferentFlowsApart) {
  // One server sends the same event with the same session to two clients, a segment to each in turn.
  const std::string first =
      "1234 8001 0000001c 0000 0001 01 01 22 00 00000001 000102030405060708090a0b0c0d0e0f";
  const std::string last = "1234 8001 0000000e 0000 0001 01 01 22 00 00000010 cafe";
  Capture capture{{.reassemble = true, .ports = {}}};
  capture.udp(first, 30509, 40000);
  capture.udp(first, 30509, 40001);
  capture.udp(last, 30509, 40000);
  capture.udp(last, 30509, 40001);
  capture.finish();
  ASSERT_THAT(capture.printed.objects, SizeIs(6));
  for (const std::size_t whole : {3U, 5U}) {
    EXPECT_EQ(capture.printed.objects[whole]["reassembled"], true);
    EXPECT_EQ(capture.printed.objects[whole]["payload"], "000102030405060708090a0b0c0d0e0fcafe");
  }
}

TEST(CaptureDecoder, PutsIpFragmentsTogether) {
  Capture capture;
  // A datagram of 8 + 18 bytes in fragments of 16 and 10; the last one comes first.
  const std::string datagram = test::to_hex(hex("9c40 3039 001a 0000" + request));
  capture.add(hex(test::ipv4_hex(10, 17, 77, 2) + datagram.substr(32)));
  capture.add(hex(test::ipv4_hex(16, 17, 77, 0x2000) + datagram.substr(0, 32)));
  EXPECT_THAT(capture.finish(), ElementsAre("1234.0421@0"));
  EXPECT_EQ(capture.printed.objects[0]["frame"], 2);
}

}  // namespace
}  // namespace trestle::inspect::capture_decoder_test
