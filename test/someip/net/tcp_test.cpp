#include <gmock/gmock.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <deque>
#include <string>
#include <vector>

#include "someip/net/address_text.hpp"
#include "someip/net/tcp_client.hpp"
#include "someip/net/tcp_server.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/loopback.hpp"

namespace trestle::someip::tcp_test {
namespace {

using boost::asio::ip::tcp;
using test::covers;
using test::hex;
using test::to_hex;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using namespace std::chrono_literals;

const IpAddress server_address = test::own_address(1);
const IpAddress client_address = test::own_address(2);

Header request(std::uint16_t session) {
  return {.service = ServiceId{0x1234},
          .method = MethodId{0x0421},
          .client = ClientId{1},
          .session = SessionId{session},
          .interface_version = 1};
}
Header response(std::uint16_t session) {
  Header header = request(session);
  header.type = MessageType::response;
  return header;
}

std::vector<std::byte> numbers(std::size_t bytes, std::size_t seed = 0) {
  std::vector<std::byte> result(bytes);
  for (std::size_t i = 0; i < bytes; ++i) {
    result[i] = static_cast<std::byte>((i + seed) * 131 >> 3U);
  }
  return result;
}

struct Received {
  Header header;
  std::vector<std::byte> payload;
  Endpoint from;
};

class TcpTest : public ::testing::Test {
 protected:
  template <typename Condition>
  [[nodiscard]] bool run_until(Condition condition, std::chrono::milliseconds limit = 60s) {
    const auto end = std::chrono::steady_clock::now() + limit;
    while (!condition() && std::chrono::steady_clock::now() < end) {
      io.run_one_for(20ms);
    }
    return condition();
  }

  void start(TcpServer& server) {
    server.start(
        {.message =
             [this](const Message& message, const Endpoint& from) {
               at_server.push_back({message.header, {message.payload.begin(), message.payload.end()}, from});
             },
         .connected = [this](const Endpoint& from) { clients.push_back(from); },
         .closed = [this](const Endpoint&, const std::string& why) { gone.push_back(why); }});
  }
  TcpClient::Handlers handlers() {
    return {.message =
                [this](const Message& message) {
                  at_client.push_back({message.header, {message.payload.begin(), message.payload.end()}, {}});
                },
            .connected = [this](const Endpoint& local) { connected_from.push_back(local); },
            .disconnected = [this](const std::string& why) { lost.push_back(why); }};
  }
  TcpClientOptions to(const TcpServer& server) const {
    return {.local = client_address,
            .remote = server.local(),
            .tcp = tcp_options,
            .retry_min = 20ms,
            .retry_max = 100ms};
  }
  /// A peer of bare sockets.
  tcp::socket bare(const TcpServer& server) {
    tcp::socket socket{io};
    socket.connect({boost::asio::ip::make_address(to_string(server.local().address)), server.local().port});
    return socket;
  }
  static void write(tcp::socket& socket, const std::string& digits) {
    boost::asio::write(socket, boost::asio::buffer(hex(digits)));
  }

  boost::asio::io_context io;
  TcpOptions tcp_options{.max_message_bytes = 8 << 20, .max_queued_bytes = 32 << 20};
  std::vector<Received> at_server;
  std::vector<Received> at_client;
  std::vector<Endpoint> clients;
  std::vector<Endpoint> connected_from;
  std::vector<std::string> gone;
  std::vector<std::string> lost;
};

const std::string event = "1234 8001 0000000b 0000 0007 01 01 02 00 010203";
const std::string cookie = "ffff 0000 00000008 dead beef 01 01 01 00";

// A client that reads nothing for a while: what it has begun to take comes whole, and then the newest.
TEST_F(TcpTest, DropsForASlowClientWhatNewerMessagesOvertake) {
  TcpServerOptions options{.local = {server_address, 0}, .tcp = tcp_options};
  options.tcp.send_buffer_bytes = 16 << 10;
  TcpServer server{io, options};
  start(server);
  tcp::socket client{io, tcp::v4()};
  client.set_option(boost::asio::socket_base::receive_buffer_size{16 << 10});
  client.connect({boost::asio::ip::make_address(to_string(server.local().address)), server.local().port});
  ASSERT_TRUE(run_until([&] { return !clients.empty(); }));
  const auto payload = numbers(1'000'000);
  const ByteView slice{payload};
  const WaitRule rule{.most = 2};
  std::vector<std::uint16_t> alive;
  std::size_t dropped = 0;
  constexpr std::uint16_t last = 10;
  for (std::uint16_t i = 1; i <= last; ++i) {
    const Room room = server.make_room(clients.front(), response(i), rule);
    EXPECT_TRUE(room.granted);
    dropped += room.dropped;
    alive.push_back(i);
    const std::shared_ptr<const void> owner{&alive, [&alive, i](const void*) { std::erase(alive, i); }};
    EXPECT_TRUE(server.send(clients.front(), response(i), {&slice, 1}, owner));
  }
  EXPECT_THAT(alive, ElementsAre(1, last - 1, last));
  EXPECT_EQ(dropped, last - 3U);
  EXPECT_EQ(server.counters().streams.overtaken, last - 3U);
  EXPECT_TRUE(server.make_room(clients.front(), {.method = MethodId{1}}, rule).granted) << "another kind";
  const Room none = server.make_room(clients.front(), response(0), {.most = 2, .keep_oldest = true});
  EXPECT_FALSE(none.granted);
  EXPECT_EQ(none.dropped, 1U);

  std::vector<std::byte> stream(3 * (16 + payload.size()));
  bool whole = false;
  boost::asio::async_read(client, boost::asio::buffer(stream), [&](auto error, auto) { whole = !error; });
  ASSERT_TRUE(run_until([&] { return whole; }));
  MessageCursor cursor{stream};
  for (const std::uint16_t session : {std::uint16_t{1}, std::uint16_t{last - 1}, last}) {
    const auto message = cursor.next();
    ASSERT_TRUE(message);
    EXPECT_EQ(value(message->header.session), session);
    EXPECT_TRUE(std::ranges::equal(message->payload, payload));
  }
  EXPECT_THAT(alive, IsEmpty());
}

TEST_F(TcpTest, CarriesMessagesBothWays) {
  covers({"feat_req_someip_585", "feat_req_someip_49"});
  TcpServer server{io, {.local = {server_address, 0}, .tcp = tcp_options}};
  start(server);
  TcpClient client{io, to(server), handlers()};
  const auto little = numbers(5);
  const ByteView slice{little};
  EXPECT_FALSE(client.local());
  EXPECT_TRUE(client.send(request(1), {&slice, 1})) << "waits for the connection";
  ASSERT_TRUE(run_until([&] { return at_server.size() == 1; }));
  EXPECT_EQ(at_server[0].header, request(1));
  EXPECT_EQ(at_server[0].payload, little);
  EXPECT_THAT(clients, ElementsAre(at_server[0].from));
  EXPECT_EQ(at_server[0].from.address, client_address);
  EXPECT_THAT(connected_from, ElementsAre(at_server[0].from));
  EXPECT_EQ(client.local(), at_server[0].from);
  EXPECT_TRUE(server.connected(at_server[0].from));

  EXPECT_TRUE(server.send(at_server[0].from, response(1), {}));
  ASSERT_TRUE(run_until([&] { return at_client.size() == 1; }));
  EXPECT_EQ(at_client[0].header, response(1));
  EXPECT_THAT(at_client[0].payload, IsEmpty());
  EXPECT_FALSE(server.send({client_address, 1}, response(1), {})) << "nobody is connected from there";
}

TEST_F(TcpTest, CarriesLargeMessagesFromManySlices) {
  covers({"feat_req_someip_664"});
  TcpServer server{io, {.local = {server_address, 0}, .tcp = tcp_options}};
  start(server);
  TcpClient client{io, to(server), handlers()};
  const auto payload = std::make_shared<std::vector<std::byte>>(numbers(5 << 20));
  std::vector<ByteView> slices;
  for (std::size_t at = 0; at < payload->size(); at += 31'337) {
    slices.push_back(ByteView{*payload}.subspan(at, std::min<std::size_t>(31'337, payload->size() - at)));
  }
  ASSERT_TRUE(run_until([&] { return client.local().has_value(); }));
  EXPECT_TRUE(client.send(request(1), slices, payload));
  {
    const std::vector<std::byte> copy = *payload;  // dies before all of it can have been sent
    const std::array<ByteView, 2> halves{ByteView{copy}.first(1000), ByteView{copy}.subspan(1000)};
    EXPECT_TRUE(client.send(request(2), halves));
  }
  EXPECT_TRUE(client.send(request(3), {}));
  ASSERT_TRUE(run_until([&] { return at_server.size() == 3; }));
  EXPECT_EQ(at_server[0].header, request(1));
  EXPECT_EQ(at_server[0].payload, *payload);
  EXPECT_EQ(at_server[1].header, request(2));
  EXPECT_EQ(at_server[1].payload, *payload);
  EXPECT_EQ(at_server[2].header, request(3));
  EXPECT_EQ(payload.use_count(), 1);
  EXPECT_EQ(client.counters().streams.messages_sent, 3U);
}

TEST_F(TcpTest, KeepsTheOrderAndBoundsWhatWaitsForASlowReceiver) {
  tcp_options.max_queued_bytes = 1 << 20;
  TcpServer server{io, {.local = {server_address, 0}, .tcp = tcp_options}};
  start(server);
  tcp::socket slow = bare(server);
  ASSERT_TRUE(run_until([&] { return clients.size() == 1; }));
  const auto block = std::make_shared<std::vector<std::byte>>(numbers(100'000));
  const ByteView slice{*block};
  std::uint16_t taken = 0;
  while (server.send(clients[0], response(static_cast<std::uint16_t>(taken + 1)), {&slice, 1}, block)) {
    ASSERT_LT(++taken, 1000) << "there seems to be no bound";
  }
  EXPECT_EQ(server.counters().streams.queue_full, 1U);
  EXPECT_GT(block.use_count(), 1);
  // All that was taken arrives, whole and in order, once the receiver reads.
  std::vector<std::byte> all(static_cast<std::size_t>(taken) * (header_bytes + block->size()));
  bool read = false;
  boost::asio::async_read(slow, boost::asio::buffer(all), [&](auto error, std::size_t) { read = !error; });
  ASSERT_TRUE(run_until([&] { return read; }));
  std::uint16_t session = 1;
  for (MessageCursor cursor{all}; const auto message = cursor.next(); ++session) {
    ASSERT_EQ(message->header, response(session));
    ASSERT_TRUE(std::ranges::equal(message->payload, *block));
  }
  EXPECT_EQ(session, taken + 1);
  EXPECT_EQ(block.use_count(), 1);
  EXPECT_EQ(server.counters().streams.messages_sent, taken);
}

// The owner of a message that has waited is let go when it has left: it may send the next one there and then.
TEST_F(TcpTest, SendsWhatTheOwnerOfAMessageThatHasLeftSends) {
  tcp_options.send_buffer_bytes = 8192;
  TcpServer server{io, {.local = {server_address, 0}, .tcp = tcp_options}};
  start(server);
  TcpClient client{io, to(server), handlers()};
  ASSERT_TRUE(run_until([&] { return connected_from.size() == 1; }));
  const auto large = numbers(4'000'000);
  const ByteView slice{large};
  const auto next = numbers(300'000, 1);
  const ByteView next_slice{next};
  bool sent = false;
  client.send(request(1), {&slice, 1},
              std::shared_ptr<const void>{&large, [&](const void*) {
                                            sent = client.send(request(3), {&next_slice, 1});
                                            EXPECT_TRUE(client.send(request(4), {}));
                                          }});
  EXPECT_TRUE(client.send(request(2), {}));
  ASSERT_FALSE(sent) << "it does not wait";
  ASSERT_TRUE(run_until([&] { return at_server.size() == 4; }));
  EXPECT_TRUE(sent);
  for (std::uint16_t i = 0; i < 4; ++i) {
    EXPECT_EQ(at_server[i].header, request(static_cast<std::uint16_t>(i + 1)));
  }
  EXPECT_EQ(at_server[0].payload, large);
  EXPECT_EQ(at_server[2].payload, next);
  EXPECT_EQ(client.counters().streams.messages_sent, 4U);
}

// Or end the connection, with others still waiting, whose owners are then let go, too, and may ask for more.
TEST_F(TcpTest, MayBeDestroyedByTheOwnerOfAMessageThatHasLeft) {
  tcp_options.send_buffer_bytes = 8192;
  TcpServer server{io, {.local = {server_address, 0}, .tcp = tcp_options}};
  start(server);
  auto client = std::make_unique<TcpClient>(io, to(server), handlers());
  ASSERT_TRUE(run_until([&] { return connected_from.size() == 1; }));
  const auto large = numbers(4'000'000);
  const ByteView slice{large};
  unsigned released = 0;
  const auto owner = [&](auto then) {
    return std::shared_ptr<const void>{&large, [&released, then](const void*) {
                                         ++released;
                                         then();
                                       }};
  };
  client->send(request(1), {&slice, 1}, owner([&] { client.reset(); }));
  client->send(request(2), {&slice, 1}, owner([] {}));
  client->send(request(3), {&slice, 1}, owner([] {}));
  ASSERT_EQ(released, 0U) << "none of them waits";
  ASSERT_TRUE(run_until([&] { return gone.size() == 1; }));
  EXPECT_EQ(client, nullptr);
  EXPECT_EQ(released, 3U);
  EXPECT_THAT(lost, IsEmpty()) << "who has destroyed it is not told";
  EXPECT_THAT(at_server, SizeIs(1));
}

// Who asks us much that is answered with nothing, and does not read it.
TEST_F(TcpTest, BoundsTheMemoryOfMessagesWithoutPayload) {
  tcp_options.max_queued_bytes = 1 << 20;
  tcp_options.send_buffer_bytes = 4096;
  TcpServer server{io, {.local = {server_address, 0}, .tcp = tcp_options}};
  start(server);
  const tcp::socket slow = bare(server);
  ASSERT_TRUE(run_until([&] { return clients.size() == 1; }));
  int taken = 0;
  while (taken < 40'000 && server.send(clients[0], response(1), {})) {
    ++taken;
  }
  EXPECT_LT(taken, 40'000) << "16 bytes each make 65536 in the queue alone";
  EXPECT_EQ(server.counters().streams.queue_full, 1U);
}

TEST_F(TcpTest, RefusesAMessageThatCouldNeverBeQueued) {
  tcp_options.max_queued_bytes = 1000;
  TcpServer server{io, {.local = {server_address, 0}, .tcp = tcp_options}};
  start(server);
  TcpClient client{io, to(server), handlers()};
  const auto payload = numbers(1000);
  const ByteView slice{payload};
  EXPECT_FALSE(client.send(request(1), {&slice, 1})) << "while connecting";
  ASSERT_TRUE(run_until([&] { return client.local().has_value(); }));
  EXPECT_FALSE(client.send(request(1), {&slice, 1}));
  EXPECT_EQ(client.counters().streams.queue_full, 2U);
}

TEST_F(TcpTest, UnderstandsSeveralMessagesPerSegmentAndOneOverMany) {
  covers({"feat_req_someip_702", "feat_req_someip_664", "feat_req_someip_586"});
  TcpServer server{io, {.local = {server_address, 0}, .tcp = tcp_options}};
  start(server);
  tcp::socket peer = bare(server);
  peer.set_option(tcp::no_delay{true});
  write(peer, event + cookie + event + event.substr(0, 12));
  ASSERT_TRUE(run_until([&] { return at_server.size() == 2; }));
  for (const std::byte byte : hex(event.substr(12))) {
    boost::asio::write(peer, boost::asio::buffer(&byte, 1));
    io.poll();
  }
  ASSERT_TRUE(run_until([&] { return at_server.size() == 3; }));
  for (const Received& one : at_server) {
    EXPECT_EQ(to_hex(one.payload), "010203");
  }
  EXPECT_EQ(server.counters().streams.received.cookies, 1U);
}

TEST_F(TcpTest, ClosesTheConnectionWhenFramingIsLost) {
  covers({"feat_req_someip_798"});
  tcp_options.max_message_bytes = 100;
  TcpServer server{io, {.local = {server_address, 0}, .tcp = tcp_options}};
  start(server);
  tcp::socket good = bare(server);
  tcp::socket short_length = bare(server);
  tcp::socket too_large = bare(server);
  ASSERT_TRUE(run_until([&] { return clients.size() == 3; }));
  write(short_length, event + "1234 8001 00000007 0000 0007 01 01 02 00" + event);
  ASSERT_TRUE(run_until([&] { return gone.size() == 1; }));
  EXPECT_THAT(gone[0], HasSubstr("no SOME/IP"));
  write(too_large, "1234 8001 0000006d 0000 0007 01 01 02 00");
  ASSERT_TRUE(run_until([&] { return gone.size() == 2; }));
  EXPECT_THAT(gone[1], HasSubstr("larger than allowed"));
  EXPECT_THAT(at_server, SizeIs(1));
  EXPECT_EQ(server.counters().bad_framing, 2U);
  write(good, event);
  ASSERT_TRUE(run_until([&] { return at_server.size() == 2; }));
  EXPECT_EQ(server.counters().open, 1U);
}

TEST_F(TcpTest, WaitsForACookieWhereCookiesAreUsed) {
  covers({"feat_req_someip_586"});
  TcpServer server{io, {.local = {server_address, 0}, .tcp = tcp_options}};
  start(server);
  tcp::socket peer = bare(server);
  write(peer, cookie + event + "ff00ff00 00000000 ff00ff00 ff00ff00 abcdef" + event);
  ASSERT_TRUE(run_until([&] { return server.counters().streams.received.bad_length == 1; }));
  write(peer, cookie + event);
  ASSERT_TRUE(run_until([&] { return at_server.size() == 2; }));
  EXPECT_THAT(gone, IsEmpty());
  EXPECT_EQ(server.counters().streams.received.resynchronised, 1U);
}

TEST_F(TcpTest, SendsCookiesOfItsOwnDirectionWhenAsked) {
  covers({"feat_req_someip_586", "feat_req_someip_593", "feat_req_someip_609"});
  tcp_options.magic_cookies = true;
  tcp_options.cookie_in_each_segment = false;
  TcpServer server{io, {.local = {server_address, 0}, .tcp = tcp_options}};
  start(server);
  tcp::socket peer = bare(server);
  ASSERT_TRUE(run_until([&] { return clients.size() == 1; }));
  EXPECT_TRUE(server.send(clients[0], response(1), {}));
  EXPECT_TRUE(server.send(clients[0], response(2), {}));
  std::vector<std::byte> bytes(48);
  boost::asio::read(peer, boost::asio::buffer(bytes));
  EXPECT_EQ(to_hex(bytes),
            "ffff800000000008deadbeef01010200"
            "12340421000000080001000101018000"
            "12340421000000080001000201018000");

  TcpClient client{io, to(server), handlers()};
  EXPECT_TRUE(client.send(request(1), {}));
  ASSERT_TRUE(run_until([&] { return at_server.size() == 1; }));
  EXPECT_EQ(at_server[0].header, request(1));
  EXPECT_EQ(server.counters().streams.received.cookies, 1U);
}

TEST_F(TcpTest, RefusesConnectionsBeyondTheLimit) {
  TcpServer server{io, {.local = {server_address, 0}, .max_connections = 2, .tcp = tcp_options}};
  start(server);
  tcp::socket a = bare(server);
  tcp::socket b = bare(server);
  tcp::socket c = bare(server);
  ASSERT_TRUE(run_until([&] { return server.counters().refused == 1; }));
  EXPECT_EQ(server.counters().open, 2U);
  std::array<std::byte, 1> byte{};
  boost::system::error_code error;
  c.read_some(boost::asio::buffer(byte), error);
  EXPECT_TRUE(error) << "closed";
  a.close();
  ASSERT_TRUE(run_until([&] { return server.counters().open == 1; }));
  tcp::socket d = bare(server);
  write(d, event);
  EXPECT_TRUE(run_until([&] { return at_server.size() == 1; }));
}

TEST_F(TcpTest, ConnectsAgainAfterTheServerWasGone) {
  covers({"feat_req_someip_647"});
  auto server = std::make_unique<TcpServer>(io, TcpServerOptions{.local = {server_address, 0}});
  start(*server);
  const Endpoint at = server->local();
  TcpClient client{io, to(*server), handlers()};
  ASSERT_TRUE(run_until([&] { return connected_from.size() == 1; }));
  server.reset();
  ASSERT_TRUE(run_until([&] { return client.counters().failed_attempts >= 2; }));
  EXPECT_THAT(lost[0], AllOf(HasSubstr("connection to TCP " + to_string(at) + " lost")));
  EXPECT_THAT(lost[1],
              AllOf(HasSubstr("cannot connect to TCP " + to_string(at)), HasSubstr("Connection refused")));
  EXPECT_FALSE(client.local());
  EXPECT_FALSE(client.send(request(1), {})) << "between two attempts";
  EXPECT_EQ(client.counters().not_connected, 1U);

  server = std::make_unique<TcpServer>(io, TcpServerOptions{.local = at});
  start(*server);
  ASSERT_TRUE(run_until([&] { return connected_from.size() == 2; }));
  EXPECT_TRUE(client.send(request(2), {}));
  ASSERT_TRUE(run_until([&] { return at_server.size() == 1; }));
  EXPECT_EQ(at_server[0].header, request(2));
  EXPECT_EQ(client.counters().connections, 2U);
}

TEST_F(TcpTest, DropsWhatWaitedWhenAnAttemptFails) {
  const Endpoint nobody{server_address, 9};
  TcpClient client{io, {.local = client_address, .remote = nobody, .retry_min = 20ms}, handlers()};
  const auto payload = std::make_shared<std::vector<std::byte>>(10);
  const ByteView slice{*payload};
  EXPECT_TRUE(client.send(request(1), {&slice, 1}, payload));
  ASSERT_TRUE(run_until([&] { return lost.size() == 1; }));
  EXPECT_EQ(client.counters().not_connected, 1U);
  EXPECT_EQ(payload.use_count(), 1);
}

TEST_F(TcpTest, WaitsLongerBeforeEachFurtherAttempt) {
  const Endpoint nobody{server_address, 9};
  std::vector<std::chrono::steady_clock::time_point> attempts;
  TcpClient client{io,
                   {.local = client_address, .remote = nobody, .retry_min = 20ms, .retry_max = 40ms},
                   {.message = {}, .disconnected = [&](const std::string&) {
                      attempts.push_back(std::chrono::steady_clock::now());
                    }}};
  ASSERT_TRUE(run_until([&] { return attempts.size() == 4; }));
  EXPECT_GE(attempts[1] - attempts[0], 20ms);
  EXPECT_GE(attempts[2] - attempts[1], 40ms);
  EXPECT_GE(attempts[3] - attempts[2], 40ms);
}

TEST_F(TcpTest, WaitsNoLongerThanTheLongestPause) {
  const Endpoint nobody{server_address, 9};
  TcpClient client{
      io, {.local = client_address, .remote = nobody, .retry_min = 10ms, .retry_max = 20ms}, handlers()};
  // That takes 0.3 s and what the attempts need; pauses that kept doubling would take minutes.
  EXPECT_TRUE(run_until([&] { return client.counters().failed_attempts >= 15; }));
}

TEST_F(TcpTest, MayBeDestroyedByItsHandlers) {
  TcpServer server{io, {.local = {server_address, 0}, .tcp = tcp_options}};
  start(server);
  for (int which = 0; which < 3; ++which) {
    std::unique_ptr<TcpClient> client;
    bool told = false;
    const auto destroy = [&](int one) {
      if (one == which) {
        client.reset();
        told = true;
      }
    };
    clients.clear();
    client = std::make_unique<TcpClient>(
        io, to(server),
        TcpClient::Handlers{.message = [&](const Message&) { destroy(0); },
                            .connected = [&](const Endpoint&) { destroy(1); },
                            .disconnected = [&](const std::string&) { destroy(2); }});
    ASSERT_TRUE(run_until([&] { return clients.size() == 1; }));
    if (which == 0) {
      EXPECT_TRUE(server.send(clients[0], response(1), {}));
      server.send(clients[0], response(2), {});
    }
    if (which == 2) {
      client = std::make_unique<TcpClient>(
          io, TcpClientOptions{.local = client_address, .remote = {server_address, 9}},
          TcpClient::Handlers{.message = {}, .disconnected = [&](const std::string&) { destroy(2); }});
    }
    ASSERT_TRUE(run_until([&] { return told; })) << which;
    ASSERT_TRUE(run_until([&] { return server.counters().open == 0; })) << "the client closed it";
  }
}

TEST_F(TcpTest, ServerMayBeDestroyedByItsHandlers) {
  for (int which = 0; which < 3; ++which) {
    auto server =
        std::make_unique<TcpServer>(io, TcpServerOptions{.local = {server_address, 0}, .tcp = tcp_options});
    bool told = false;
    const auto destroy = [&](int one) {
      if (one == which) {
        server.reset();
        told = true;
      }
    };
    server->start({.message = [&](const Message&, const Endpoint&) { destroy(0); },
                   .connected = [&](const Endpoint&) { destroy(1); },
                   .closed = [&](const Endpoint&, const std::string&) { destroy(2); }});
    tcp::socket peer = bare(*server);
    write(peer, event + event);
    if (which == 2) {
      peer.close();
    }
    ASSERT_TRUE(run_until([&] { return told; })) << which;
  }
}

TEST_F(TcpTest, SaysWhichPortIsTakenAndWhatToDo) {
  TcpServer server{io, {.local = {server_address, 0}}};
  try {
    TcpServer second{io, {.local = server.local()}};
    FAIL() << "two servers have one port";
  } catch (const NetError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("TCP " + to_string(server.local())), HasSubstr("ss -tlpn"),
                                    HasSubstr("stop it, or use another address")));
  }
  EXPECT_THROW((TcpServer{io, {.local = {IpAddress::v4(192, 0, 2, 1), 0}}}), NetError);
}

TEST_F(TcpTest, WorksOverIpv6) {
  const IpAddress loopback = *parse_address("::1");
  std::unique_ptr<TcpServer> server;
  try {
    server = std::make_unique<TcpServer>(io, TcpServerOptions{.local = {loopback, 0}});
  } catch (const NetError& error) {
    GTEST_SKIP() << error.what();
  }
  start(*server);
  TcpClient client{io, {.local = loopback, .remote = server->local()}, handlers()};
  EXPECT_TRUE(client.send(request(1), {}));
  ASSERT_TRUE(run_until([&] { return at_server.size() == 1; }));
  EXPECT_EQ(at_server[0].from.address, loopback);
}

}  // namespace
}  // namespace trestle::someip::tcp_test
