#include "pcaps/tcp_streams.hpp"

#include <gmock/gmock.h>

#include "test/bytes.hpp"

namespace trestle::pcaps::tcp_streams_test {
namespace {
using test::hex;
using test::to_hex;
using testing::ElementsAre;
using testing::IsEmpty;

const Endpoint client{IpAddress::v4(10, 0, 0, 2), 40000};
const Endpoint server{IpAddress::v4(10, 0, 0, 1), 30510};

/// What comes out, as "offset:bytes", "offset:bytes after N" for a gap, or "closed".
struct Connection {
  TcpStreams streams;
  std::vector<std::string> out;

  void deliver(const StreamBytes& bytes) {
    out.push_back(std::to_string(bytes.offset) + ":" + to_hex(bytes.bytes) +
                  (bytes.lost_before > 0 ? " after " + std::to_string(bytes.lost_before) : "") +
                  (bytes.from_start ? "" : " unsure"));
  }
  void send(std::uint32_t sequence, const std::string& digits, bool syn = false, Endpoint from = client) {
    const auto bytes = hex(digits);
    streams.add(
        from, server, {from.port, server.port, sequence, syn, false, false, bytes},
        [this](const Endpoint&, const Endpoint&, const StreamBytes& ready) { deliver(ready); },
        [this](const Endpoint&, const Endpoint&) { out.emplace_back("closed"); });
  }
  void finish() {
    streams.finish([this](const Endpoint&, const Endpoint&, const StreamBytes& ready) { deliver(ready); });
  }
};

TEST(TcpStreams, DeliversBytesInOrderAndOnce) {
  Connection connection{TcpStreams{{}}, {}};
  connection.send(100, "", true);
  connection.send(101, "aa");
  connection.send(101, "aa");    // repeated
  connection.send(103, "ccdd");  // too early
  connection.send(102, "bb");
  connection.send(103, "ccddee");  // repeated with more
  connection.send(100, "", true);  // the SYN itself repeated
  EXPECT_THAT(connection.out, ElementsAre("0:aa", "1:bb", "2:ccdd", "4:ee"));
}

TEST(TcpStreams, TakesTheFirstValueOfOverlappingBytes) {
  Connection connection{TcpStreams{{}}, {}};
  connection.send(100, "", true);
  connection.send(103, "c1c1c1");
  connection.send(104, "d2d2d2");
  connection.send(101, "aabb");
  EXPECT_THAT(connection.out, ElementsAre("0:aabb", "2:c1c1c1", "5:d2"));
}

TEST(TcpStreams, FollowsTheSequenceNumberAroundItsEnd) {
  Connection connection{TcpStreams{{}}, {}};
  connection.send(0xfffffffe, "", true);
  connection.send(0xffffffff, "aabb");
  connection.send(1, "cc");
  EXPECT_THAT(connection.out, ElementsAre("0:aabb", "2:cc"));
}

TEST(TcpStreams, BeginsInTheMiddleOfAConnection) {
  Connection connection{TcpStreams{{}}, {}};
  connection.send(5000, "");
  connection.send(5000, "aa");
  EXPECT_THAT(connection.out, ElementsAre("0:aa unsure"));
}

TEST(TcpStreams, GivesUpAGapWhenTooMuchIsWaiting) {
  Connection connection{TcpStreams{{.max_pending_segments = 2}}, {}};
  connection.send(100, "", true);
  connection.send(101, "aa");
  connection.send(110, "bb");
  connection.send(112, "cc");
  EXPECT_THAT(connection.out, ElementsAre("0:aa"));
  connection.send(114, "dd");
  EXPECT_THAT(connection.out, ElementsAre("0:aa", "9:bb after 8"));
  EXPECT_EQ(connection.streams.gaps(), 1U);
  EXPECT_EQ(connection.streams.lost_bytes(), 8U);
  connection.finish();
  EXPECT_THAT(connection.out, ElementsAre("0:aa", "9:bb after 8", "11:cc after 1", "13:dd after 1"));
}

TEST(TcpStreams, LimitsTheBytesThatWaitBehindAGap) {
  Connection connection{TcpStreams{{.max_pending_bytes = 4}}, {}};
  connection.send(100, "", true);
  connection.send(110, "aabbcc");
  EXPECT_THAT(connection.out, IsEmpty());
  connection.send(113, "ddee");
  EXPECT_THAT(connection.out, ElementsAre("9:aabbcc after 9", "12:ddee"));
}

TEST(TcpStreams, TellsANewConnectionFromAnOldOne) {
  Connection connection{TcpStreams{{}}, {}};
  connection.send(100, "", true);
  connection.send(101, "aa");
  connection.send(900000, "", true);
  connection.send(900001, "bb");
  connection.send(0x80000000, "cc");  // so far off that the opening must be missing in the capture
  EXPECT_THAT(connection.out, ElementsAre("0:aa", "closed", "0:bb", "closed", "0:cc unsure"));
}

TEST(TcpStreams, ForgetsTheLeastRecentlyUsedStream) {
  Connection connection{TcpStreams{{.max_streams = 2}}, {}};
  const Endpoint second{client.address, 40001};
  const Endpoint third{client.address, 40002};
  connection.send(100, "", true, client);
  connection.send(100, "", true, second);
  connection.send(101, "aa", false, client);
  connection.send(100, "", true, third);
  connection.send(102, "bb", false, client);
  EXPECT_THAT(connection.out, ElementsAre("0:aa", "closed", "1:bb"));
}

}  // namespace
}  // namespace trestle::pcaps::tcp_streams_test
