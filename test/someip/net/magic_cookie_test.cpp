// Magic Cookies at the start of TCP segments, seen by a peer of bare sockets that counts the segments.
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <numeric>

#include "someip/net/address_text.hpp"
#include "someip/net/tcp_server.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/loopback.hpp"
#include "test/someip/net/tcp_segments.hpp"

namespace trestle::someip::magic_cookie_test {
namespace {

using boost::asio::ip::tcp;
using test::covers;
using namespace std::chrono_literals;

constexpr std::size_t cookie_bytes = 16;
constexpr int segment_room = 1000;  // what the peer says it takes

/// What stands between two cookies.
struct Group {
  std::size_t messages = 0;
  std::size_t bytes = cookie_bytes;
};

class MagicCookieTest : public ::testing::Test {
 protected:
  void SetUp() override {
    server.start({.message = [](const Message&, const Endpoint&) {},
                  .connected = [this](const Endpoint& from) { client = from; }});
    peer.open(tcp::v4());
    setsockopt(peer.native_handle(), IPPROTO_TCP, TCP_MAXSEG, &segment_room, sizeof segment_room);
    peer.connect({boost::asio::ip::make_address(to_string(server.local().address)), server.local().port});
    ASSERT_TRUE(run_until([&] { return client.port != 0; }));
  }
  template <typename Condition>
  [[nodiscard]] bool run_until(Condition condition) {
    const auto end = std::chrono::steady_clock::now() + 60s;
    while (!condition() && std::chrono::steady_clock::now() < end) {
      io.run_one_for(1ms);
    }
    return condition();
  }
  void send(std::size_t payload_bytes) {
    const std::vector<std::byte> payload(payload_bytes, std::byte{0xff});
    const ByteView slice{payload};
    ASSERT_TRUE(
        server.send(client, {.service = ServiceId{0x1234}, .type = MessageType::response}, {&slice, 1}));
    sent_bytes += header_bytes + payload_bytes;
    ++sent;
  }
  /// Reads until all has come, and splits it at the cookies. Each time all that there is room for: whenever
  /// some of it is read, the system may cut a segment to what there is room for again.
  std::vector<Group> received() {
    std::vector<std::byte> bytes;
    std::vector<std::byte> room(8 << 20);
    std::vector<Group> groups;
    peer.non_blocking(true);
    const bool all = run_until([&] {
      for (std::size_t there = 0; there < peer.available(); io.run_one_for(1ms)) {
        there = peer.available();
      }
      boost::system::error_code nothing_more;
      while (!nothing_more) {
        const std::size_t got = peer.read_some(boost::asio::buffer(room), nothing_more);
        bytes.insert(bytes.end(), room.begin(), room.begin() + static_cast<std::ptrdiff_t>(got));
      }
      return server.counters().streams.messages_sent == sent &&
             count(groups = split(bytes)) == sent - sent_before;
    });
    EXPECT_TRUE(all);
    EXPECT_EQ(bytes.size(), sent_bytes + groups.size() * cookie_bytes);
    sent_before = sent;
    sent_bytes = 0;
    return groups;
  }
  static std::vector<Group> split(ByteView bytes) {
    std::vector<Group> groups;
    MessageCursor cursor{bytes};
    while (const auto message = cursor.next()) {
      if (message->header.service == ServiceId{0xffff}) {
        EXPECT_EQ(message->header, magic_cookie_header(StreamEnd::server));
        groups.emplace_back();
      } else if (groups.empty()) {
        ADD_FAILURE() << "does not begin with a cookie";
        break;
      } else {
        ++groups.back().messages;
        groups.back().bytes += message->size();
      }
    }
    return groups;
  }
  static std::size_t count(const std::vector<Group>& groups) {
    return std::accumulate(groups.begin(), groups.end(), std::size_t{0},
                           [](std::size_t sum, const Group& one) { return sum + one.messages; });
  }
  /// Segments with data that have come to the peer.
  [[nodiscard]] std::size_t segments() { return test::data_segments_received(peer.native_handle()); }

  boost::asio::io_context io;
  TcpServer server{io, {.local = {test::own_address(1), 0}, .tcp = {.magic_cookies = true}}};
  tcp::socket peer{io};
  Endpoint client;
  std::size_t sent = 0;
  std::size_t sent_before = 0;  ///< received()
  std::size_t sent_bytes = 0;   ///< since then
};

TEST_F(MagicCookieTest, StartsEachSegment) {
  covers({"feat_req_someip_586", "feat_req_someip_591", "feat_req_someip_592"});
  for (int i = 0; i < 3; ++i) {
    send(100);
  }
  const std::vector<Group> groups = received();
  ASSERT_EQ(groups.size(), 3U) << "one each, as the system takes them at once";
  EXPECT_EQ(segments(), 3U);
}

TEST_F(MagicCookieTest, IsFollowedByAsManyMessagesAsFitIntoTheSegment) {
  covers({"feat_req_someip_591", "feat_req_someip_592"});
  // More than the system takes for a peer that does not read: the rest waits, and goes several at a time.
  constexpr std::size_t count = 60'000;
  // Without its mark the system would put segments together. It may still cut one to what the peer has room
  // for, or send what a peer without room has dropped once more: not each time many.
  bool few_more = false;
  for (int tries = 0; tries < 20 && !few_more; ++tries) {
    const std::size_t before = segments();
    for (std::size_t i = 0; i < count; ++i) {
      send(i % 7 * 30);
    }
    const std::vector<Group> groups = received();
    EXPECT_LT(groups.size(), count) << "nothing had to wait: the test shows nothing";
    std::size_t full = 0;
    for (const Group& group : groups) {
      EXPECT_GE(group.messages, 1U);
      EXPECT_LE(group.bytes, static_cast<std::size_t>(segment_room));
      full += group.messages > 1 ? 1 : 0;
    }
    EXPECT_GT(full, 0U);
    EXPECT_GE(segments() - before, groups.size());
    few_more = segments() - before <= groups.size() + groups.size() / 100;
  }
  EXPECT_TRUE(few_more);
}

TEST_F(MagicCookieTest, StandsOnlyBeforeAMessageThatIsLargerThanASegment) {
  covers({"feat_req_someip_591", "feat_req_someip_592"});
  send(100);
  send(5000);
  send(100);
  const std::vector<Group> groups = received();
  ASSERT_EQ(groups.size(), 3U);
  EXPECT_EQ(groups[1].messages, 1U);
  EXPECT_GE(segments(), 1U + 6U + 1U) << "the last message is not in the segment of the one before";
}

}  // namespace
}  // namespace trestle::someip::magic_cookie_test
