// TCP: what clients may take of our places and memory.
#include <gmock/gmock.h>
#include <sys/resource.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <fstream>
#include <functional>
#include <list>
#include <set>

#include "someip/net/address_text.hpp"
#include "someip/net/receive_memory.hpp"
#include "someip/net/send_budget.hpp"
#include "someip/net/tcp_server.hpp"
#include "test/bytes.hpp"
#include "test/loopback.hpp"
#include "test/sanitized.hpp"

namespace trestle::someip::tcp_limits_test {
namespace {

using boost::asio::ip::tcp;
using namespace std::chrono_literals;

constexpr std::size_t mebibyte = std::size_t{1} << 20U;
const std::string small = "1234 0001 00000008 0001 0001 01 01 00 00";

/// An event of so many bytes of payload, or the front of it.
std::vector<std::byte> event(std::size_t payload_bytes, std::size_t front_bytes) {
  std::vector<std::byte> whole(header_bytes + payload_bytes);
  for (std::size_t i = 0; i < payload_bytes; ++i) {
    whole[header_bytes + i] = static_cast<std::byte>(i * 131 >> 3U);
  }
  const Header header{.service = ServiceId{0x1234}, .method = MethodId{0x8001}, .interface_version = 1};
  EXPECT_TRUE(encode_header(header, payload_bytes, whole));
  whole.resize(front_bytes);
  return whole;
}

class TcpLimitsTest : public testing::Test {
 protected:
  void open(TcpServerOptions options) {
    options.local = {test::own_address(1), 0};
    options.tcp.max_message_bytes = 16 * mebibyte;
    options.tcp.receive_budget = budget;
    server = std::make_unique<TcpServer>(io, options);
    server->start({.message =
                       [this](const Message& message, const Endpoint& from) {
                         received.emplace_back(message.payload.begin(), message.payload.end());
                         spoke.insert(from);
                         fail(from.address, "message");
                         if (!answer.empty()) {
                           Header header = message.header;
                           header.type = MessageType::response;
                           const ByteView slice{answer};
                           EXPECT_TRUE(server->send(from, header, {&slice, 1}));
                         }
                       },
                   .connected = [this](const Endpoint& client) { fail(client.address, "connected"); },
                   .closed = [this](const Endpoint& client,
                                    const std::string& why) { gone.emplace_back(client.address, why); },
                   .in_use =
                       [this](const Endpoint& client) {
                         fail(client.address, "in_use");
                         return needed.contains(client);
                       },
                   .refused = [this](const Endpoint&, const std::string& why) { refused.push_back(why); }});
  }
  /// There is no memory for what this handler does for address 2.
  void fail(const IpAddress& address, const std::string& handler) const {
    if (handler == fails && address == test::own_address(2)) {
      throw std::bad_alloc{};
    }
  }
  /// A client of bare sockets, which is never waited for.
  tcp::socket& connect(unsigned address) {
    tcp::socket& socket = clients.emplace_back(io);
    const auto of = [](const Endpoint& one) {
      return tcp::endpoint{boost::asio::ip::make_address(to_string(one.address)), one.port};
    };
    socket.open(tcp::v4());
    socket.bind(of({test::own_address(static_cast<std::uint8_t>(address)), 0}));
    socket.connect(of(server->local()));
    const auto before = handled();
    EXPECT_TRUE(run_until([&] { return handled() > before; }));
    return socket;
  }
  std::uint64_t handled() const { return server->counters().accepted + server->counters().refused; }
  static Endpoint end_of(const tcp::socket& socket, unsigned address) {
    return {test::own_address(static_cast<std::uint8_t>(address)), socket.local_endpoint().port()};
  }
  /// Goes on in the background: we are also who receives it.
  void write(tcp::socket& socket, const std::vector<std::byte>& bytes) {
    const auto kept = std::make_shared<std::vector<std::byte>>(bytes);
    boost::asio::async_write(socket, boost::asio::buffer(*kept),
                             [this, kept](const boost::system::error_code&, std::size_t) { ++written; });
  }
  template <typename Condition>
  bool run_until(Condition condition, std::chrono::milliseconds limit = 60s) {
    const auto end = std::chrono::steady_clock::now() + limit;
    while (!condition()) {  // asked no more once it holds: it may do something
      if (std::chrono::steady_clock::now() >= end) {
        return false;
      }
      io.run_one_for(20ms);
    }
    return true;
  }

  boost::asio::io_context io;
  std::shared_ptr<ReceiveBudget> budget = std::make_shared<ReceiveBudget>(8 * mebibyte);
  std::unique_ptr<TcpServer> server;
  std::list<tcp::socket> clients;
  std::vector<std::vector<std::byte>> received;
  std::set<Endpoint> spoke;
  std::set<Endpoint> needed;
  std::vector<std::pair<IpAddress, std::string>> gone;
  std::vector<std::string> refused;
  int written = 0;
  std::string fails;              ///< this handler has no memory
  std::vector<std::byte> answer;  ///< to each message; empty: none
};

// --- Descriptors ------------------------------------------------------------------------------------------

TEST_F(TcpLimitsTest, AreTakenForAConnectionAsSoonAsThereIsADescriptor) {
  if (test::sanitized) {
    GTEST_SKIP() << "a sanitizer opens pipes of its own, to see what memory there is";
  }
  open({});
  tcp::socket& socket = clients.emplace_back(io);
  socket.open(tcp::v4());
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit none = before;
  none.rlim_cur = 0;  // those that are open stay
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  boost::system::error_code error;
  socket.connect({boost::asio::ip::make_address(to_string(server->local().address)), server->local().port},
                 error);
  const bool told = run_until([&] { return !refused.empty(); });
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_FALSE(error);
  EXPECT_TRUE(told);
  EXPECT_THAT(refused.front(), testing::HasSubstr("ulimit -n"));
  EXPECT_GE(server->counters().not_accepted, 1U);
  EXPECT_TRUE(run_until([&] { return server->counters().accepted == 1; })) << "it is tried again";
}

// --- Memory -----------------------------------------------------------------------------------------------

TEST_F(TcpLimitsTest, MemoryIsTakenAsAMessageComes) {
  open({});
  for (int i = 0; i < 12; ++i) {
    write(connect(2), event(16 * mebibyte - 8, 1000));
  }
  ASSERT_TRUE(run_until([&] { return written == 12; }));
  EXPECT_EQ(budget->used_bytes(), 0U) << "what is announced is not there yet";
  tcp::socket& large = connect(3);
  write(large, event(5 * mebibyte, header_bytes + 5 * mebibyte));
  ASSERT_TRUE(run_until([&] { return received.size() == 1; }));
  const auto expected = event(5 * mebibyte, header_bytes + 5 * mebibyte);
  EXPECT_TRUE(std::ranges::equal(received[0], ByteView{expected}.subspan(header_bytes)));
  EXPECT_GE(budget->used_bytes(), 4 * mebibyte);
  EXPECT_LE(budget->used_bytes(), 5 * mebibyte + 8192) << "not more than the message has";
  const auto kept = budget->used_bytes();
  write(large, event(5 * mebibyte, header_bytes + 5 * mebibyte));
  ASSERT_TRUE(run_until([&] { return received.size() == 2; }));
  EXPECT_EQ(budget->used_bytes(), kept) << "the next one finds it";
  large.close();
  EXPECT_TRUE(run_until([&] { return budget->used_bytes() == 0; }));
}

// Who asks and does not read is asked for nothing more; who does not ask is not held up by it.
TEST_F(TcpLimitsTest, NoRequestsAreReadOfWhoDoesNotReadTheAnswers) {
  TcpServerOptions options;
  options.tcp.send_buffer_bytes = 16 << 10;
  options.tcp.max_unread_answer_bytes = 64 << 10;
  open(options);
  answer.resize(1000);
  tcp::socket& deaf = connect(2);
  std::vector<std::byte> requests;
  const auto one = test::hex(small);
  constexpr std::size_t asked = 200'000;  // whose answers are 203 MB
  for (std::size_t i = 0; i < asked; ++i) {
    requests.insert(requests.end(), one.begin(), one.end());
  }
  write(deaf, requests);
  ASSERT_TRUE(run_until([&] { return server->counters().streams.held_back != 0; }));
  tcp::socket& other = connect(3);
  write(other, test::hex(small));
  ASSERT_TRUE(run_until([&] { return spoke.contains(end_of(other, 3)); }));
  EXPECT_LT(received.size(), asked / 2) << "what is read at once, 64 KB, and what the system has room for";
  EXPECT_EQ(server->counters().streams.queue_full, 0U);
  // Now it reads: nothing was lost.
  std::size_t read = 0;
  std::vector<char> room(1 << 20U);
  std::function<void()> go_on = [&] {
    deaf.async_read_some(boost::asio::buffer(room),
                         [&](const boost::system::error_code& error, std::size_t n) {
                           read += n;
                           if (!error) {
                             go_on();
                           }
                         });
  };
  go_on();
  EXPECT_TRUE(run_until([&] { return read == asked * (header_bytes + answer.size()); }));
  deaf.close();
  run_until([] { return false; }, 20ms);
}

// Many who read nothing must not take memory without end; who reads loses nothing by them.
TEST_F(TcpLimitsTest, WhatWaitsForAllIsBoundedAndWhoReadsIsServed) {
  TcpServerOptions options;
  options.tcp.send_buffer_bytes = 16 << 10;
  const auto all = std::make_shared<SendBudget>(8 * mebibyte);
  options.tcp.send_budget = all;
  open(options);
  std::vector<Endpoint> deaf;
  for (unsigned address = 2; address < 10; ++address) {
    deaf.push_back(end_of(connect(address), address));
  }
  tcp::socket& reads = connect(10);
  std::size_t read = 0;
  std::vector<char> room(1 << 20U);
  std::function<void()> go_on = [&] {
    reads.async_read_some(boost::asio::buffer(room),
                          [&](const boost::system::error_code& error, std::size_t n) {
                            read += n;
                            if (!error) {
                              go_on();
                            }
                          });
  };
  go_on();
  const std::vector<std::byte> payload(mebibyte / 2);
  const ByteView slice{payload};
  const Header header{.service = ServiceId{0x1234}, .method = MethodId{0x8001}, .interface_version = 1};
  for (std::size_t i = 1; i <= 20; ++i) {
    for (const Endpoint& one : deaf) {
      server->send(one, header, {&slice, 1});
    }
    EXPECT_TRUE(server->send(end_of(reads, 10), header, {&slice, 1}));
    ASSERT_TRUE(run_until([&] { return read == i * (header_bytes + payload.size()); }));
    EXPECT_LE(all->used_bytes(), 8 * mebibyte + 9 * (payload.size() + header_bytes));
  }
  EXPECT_GT(server->counters().streams.queue_full, 20U);
  EXPECT_TRUE(server->is_full_for(deaf[0], payload.size()));
  EXPECT_FALSE(server->is_full_for(end_of(reads, 10), payload.size()));
  for (tcp::socket& one : clients) {
    one.close();
  }
  EXPECT_TRUE(run_until([&] { return all->used_bytes() == 0; }));
  EXPECT_FALSE(server->is_full_for(deaf[0], payload.size())) << "it is gone";
}

TEST_F(TcpLimitsTest, WhoHoldsMostForLongestEndsWhereMemoryIsShort) {
  open({});
  for (const unsigned address : {2U, 3U}) {  // 4 MB of each are there
    write(connect(address), event(16 * mebibyte - 8, 3 * mebibyte));
    ASSERT_TRUE(run_until([&] { return budget->used_bytes() >= (address - 1) * 3 * mebibyte; }));
    run_until([] { return false; }, 50ms);
  }
  write(connect(4), event(3 * mebibyte, header_bytes + 3 * mebibyte));
  ASSERT_TRUE(run_until([&] { return received.size() == 1; }));
  ASSERT_TRUE(run_until([&] { return !gone.empty(); }));
  EXPECT_EQ(gone[0], std::pair(test::own_address(2), std::string{no_memory_for_a_message}));
  EXPECT_EQ(gone.size(), 1U);
  EXPECT_EQ(server->counters().streams.no_memory, 1U);
  EXPECT_EQ(server->counters().open, 2U);
}

TEST_F(TcpLimitsTest, HandlersWithoutMemoryEndOneConnectionAndNotTheProgram) {
  open({});
  fails = "connected";
  tcp::socket& refused_one = connect(2);
  EXPECT_EQ(server->counters().open, 0U);
  EXPECT_EQ(server->counters().streams.no_memory, 1U);
  fails = "message";
  tcp::socket& ended = connect(2);
  tcp::socket& other = connect(3);
  write(ended, test::hex(small));
  ASSERT_TRUE(run_until([&] { return server->counters().streams.no_memory == 2; }));
  write(other, test::hex(small));
  ASSERT_TRUE(run_until([&] { return spoke.contains(end_of(other, 3)); }));
  EXPECT_EQ(server->counters().open, 1U);
  for (tcp::socket* const socket : {&refused_one, &ended}) {
    std::array<char, 8> room{};
    boost::system::error_code error;
    socket->read_some(boost::asio::buffer(room), error);
    EXPECT_TRUE(error) << "the connection is closed";
  }
  ASSERT_EQ(gone.size(), 2U);
  EXPECT_EQ(gone[0].second, no_memory_for_a_message);
}

TEST_F(TcpLimitsTest, WhoMustGiveWayIsFoundWithoutMemoryAnotherTime) {
  open({.max_connections = 2});
  connect(2);
  connect(2);
  fails = "in_use";
  tcp::socket& newcomer = clients.emplace_back(io);
  newcomer.open(tcp::v4());
  newcomer.bind({boost::asio::ip::make_address(to_string(test::own_address(3))), 0});
  newcomer.connect({boost::asio::ip::make_address(to_string(server->local().address)), server->local().port});
  ASSERT_TRUE(run_until([&] { return server->counters().streams.no_memory == 1; }));
  EXPECT_EQ(server->counters().open, 2U);
  fails.clear();
  connect(3);
  EXPECT_EQ(server->counters().gave_way, 1U);
}

TEST_F(TcpLimitsTest, MemoryThatNobodyUsesIsTakenFirst) {
  open({});
  write(connect(2), event(5 * mebibyte, header_bytes + 5 * mebibyte));
  ASSERT_TRUE(run_until([&] { return received.size() == 1; }));
  write(connect(3), event(6 * mebibyte, header_bytes + 6 * mebibyte));
  ASSERT_TRUE(run_until([&] { return received.size() == 2; }));
  EXPECT_EQ(server->counters().open, 2U);
  EXPECT_EQ(server->counters().streams.no_memory, 0U);
}

TEST_F(TcpLimitsTest, AConnectionEndsForWhichTheSystemHasNoMemory) {
  if (test::sanitized) {
    GTEST_SKIP() << "a sanitizer does not run with little memory";
  }
  open({});
  tcp::socket& large = connect(2);
  tcp::socket& other = connect(3);
  write(large, event(16 * mebibyte - 8, mebibyte));
  ASSERT_TRUE(run_until([&] { return written == 1; }));
  std::size_t pages = 0;
  std::ifstream{"/proc/self/statm"} >> pages;
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_AS, &before), 0);
  rlimit little = before;
  little.rlim_cur = pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE)) + 600'000;
  const auto rest = event(mebibyte, header_bytes + mebibyte);
  ASSERT_EQ(setrlimit(RLIMIT_AS, &little), 0);
  boost::system::error_code ignored;
  large.non_blocking(true);
  for (int i = 0; i < 1000 && gone.empty(); ++i) {
    large.write_some(boost::asio::buffer(rest), ignored);
    io.poll();
  }
  setrlimit(RLIMIT_AS, &before);
  ASSERT_EQ(gone.size(), 1U);
  EXPECT_EQ(gone[0].second, no_memory_for_a_message);
  EXPECT_EQ(server->counters().streams.no_memory, 1U);
  write(other, test::hex(small));
  EXPECT_TRUE(run_until([&] { return received.size() == 1; }));
}

// --- Places -----------------------------------------------------------------------------------------------

TEST_F(TcpLimitsTest, IdleConnectionsEndUnlessTheyAreNeeded) {
  open({.idle_timeout = 200ms});
  connect(2);
  tcp::socket& for_events = connect(3);
  needed.insert(end_of(for_events, 3));
  tcp::socket& busy = connect(4);
  const auto end = std::chrono::steady_clock::now() + 600ms;
  while (std::chrono::steady_clock::now() < end) {
    write(busy, test::hex(small));
    run_until([] { return false; }, 20ms);
  }
  ASSERT_TRUE(run_until([&] { return !gone.empty(); }));
  EXPECT_EQ(gone[0], std::pair(test::own_address(2), std::string{"it was idle"}));
  EXPECT_TRUE(server->connected(end_of(for_events, 3)));
  needed.clear();
  ASSERT_TRUE(run_until([&] { return server->counters().open == 0; }));
  EXPECT_EQ(server->counters().idle, 3U);
}

TEST_F(TcpLimitsTest, AConnectionThatWaitsForAnAnswerIsNotIdleForAWhile) {
  open({.idle_timeout = 40ms, .unanswered_timeout = 1h});
  const Endpoint waits = end_of(connect(2), 2);
  server->await_answer(waits);  // at once, before it can be idle for too long on a slow machine
  const Endpoint waits_twice = end_of(connect(3), 3);
  server->await_answer(waits_twice);
  server->await_answer(waits_twice);
  connect(4);
  ASSERT_TRUE(run_until([&] { return server->counters().idle == 1; }));
  connect(4);
  ASSERT_TRUE(run_until([&] { return server->counters().idle == 2; })) << "it has looked at all again";
  EXPECT_TRUE(server->connected(waits));
  server->answered(waits);
  server->answered(waits_twice);
  ASSERT_TRUE(run_until([&] { return server->counters().idle == 3; }));
  EXPECT_FALSE(server->connected(waits));
  EXPECT_TRUE(server->connected(waits_twice)) << "one is still to come";
}

TEST_F(TcpLimitsTest, AnAnswerThatNeverComesKeepsNoConnectionForEver) {
  open({.idle_timeout = 20ms, .unanswered_timeout = 60ms});
  server->await_answer(end_of(connect(2), 2));
  server->answered({test::own_address(9), 1});  // nobody
  EXPECT_TRUE(run_until([&] { return server->counters().idle == 1; }));
}

TEST_F(TcpLimitsTest, PlacesAreSharedByAddress) {
  open({.max_connections = 8, .max_connections_per_address = 4});
  // All wait for an answer: else those that were silent for a second give way, and a slow machine takes that
  // long.
  const auto come = [&](unsigned address) -> tcp::socket& {
    tcp::socket& socket = connect(address);
    server->await_answer(end_of(socket, address));
    return socket;
  };
  for (int i = 0; i < 4; ++i) {
    for (const unsigned address : {2U, 3U}) {
      come(address);
    }
  }
  tcp::socket& newcomer = come(4);
  EXPECT_EQ(server->counters().gave_way, 1U);
  EXPECT_EQ(server->counters().refused, 0U);
  write(newcomer, test::hex(small));
  ASSERT_TRUE(run_until([&] { return received.size() == 1; }));
  come(4);
  EXPECT_EQ(server->counters().gave_way, 2U);
  come(4);  // all of them have 2 or 3
  EXPECT_EQ(server->counters().gave_way, 2U);
  EXPECT_THAT(refused, testing::ElementsAre(testing::HasSubstr("max_tcp_clients")));
  EXPECT_THAT(gone, testing::Each(testing::Pair(testing::Ne(test::own_address(4)), testing::_)));
}

TEST_F(TcpLimitsTest, WhatIsNeededKeepsItsPlaceWhereAnotherIsNot) {
  open({.max_connections = 3});
  tcp::socket& first = connect(2);
  needed.insert(end_of(first, 2));
  connect(2);
  tcp::socket& last = connect(2);
  write(last, test::hex(small));
  ASSERT_TRUE(run_until([&] { return received.size() == 1; }));
  connect(3);
  EXPECT_EQ(server->counters().gave_way, 1U);
  EXPECT_TRUE(server->connected(end_of(first, 2)));
  EXPECT_TRUE(server->connected(end_of(last, 2))) << "the second was idle for longer";
}

// Each has an address of its own, and has spoken once. Only who goes on is safe, or is needed.
TEST_F(TcpLimitsTest, WhoSpokeOnceKeepsNobodyOut) {
  open({.max_connections = 4});
  tcp::socket& busy = connect(2);
  const Endpoint for_events = end_of(connect(3), 3);
  const Endpoint waits = end_of(connect(4), 4);
  const Endpoint silent = end_of(connect(5), 5);
  needed.insert(for_events);
  server->await_answer(waits);
  const auto speak = [&](tcp::socket& one) {
    const std::size_t before = received.size();
    write(one, test::hex(small));
    ASSERT_TRUE(run_until([&] { return received.size() > before; }));
  };
  for (tcp::socket& one : clients) {
    speak(one);
  }
  ASSERT_EQ(spoke.size(), 4U);
  // Others try again and again until there is room; the first may come before a second is over.
  const auto end = std::chrono::steady_clock::now() + 60s;
  while (server->counters().gave_way == 0 && std::chrono::steady_clock::now() < end) {
    speak(busy);
    connect(6);
    run_until([] { return false; }, 50ms);
  }
  EXPECT_EQ(server->counters().gave_way, 1U);
  EXPECT_FALSE(server->connected(silent));
  EXPECT_TRUE(server->connected(end_of(busy, 2)));
  EXPECT_TRUE(server->connected(for_events));
  EXPECT_TRUE(server->connected(waits));
}

// Its address takes no place from others for a while: else it would come again at once, and keep them out.
TEST_F(TcpLimitsTest, WhoReadsNothingMakesRoomEvenIfItIsNeeded) {
  open({.max_connections = 2});
  tcp::socket& reader = connect(2);
  tcp::socket& deaf = connect(3);
  constexpr std::size_t sent = 16;
  const std::vector<std::byte> payload(mebibyte);
  const ByteView slice{payload};
  const Header header{.service = ServiceId{0x1234}, .method = MethodId{0x8001}, .interface_version = 1};
  for (const Endpoint& to : {end_of(reader, 2), end_of(deaf, 3)}) {
    needed.insert(to);
    for (std::size_t i = 0; i < sent; ++i) {
      ASSERT_TRUE(server->send(to, header, {&slice, 1}));
    }
  }
  std::vector<std::byte> room(sent * (mebibyte + header_bytes));
  bool has_read = false;
  boost::asio::async_read(reader, boost::asio::buffer(room),
                          [&](const boost::system::error_code& error, std::size_t) { has_read = !error; });
  ASSERT_TRUE(run_until([&] { return has_read; }));
  // Others try until it has been seen that one does not read.
  const auto end = std::chrono::steady_clock::now() + 60s;
  while (server->counters().gave_way == 0 && std::chrono::steady_clock::now() < end) {
    connect(4);
    run_until([] { return false; }, 50ms);
  }
  EXPECT_EQ(server->counters().unread, 1U);
  EXPECT_TRUE(server->connected(end_of(reader, 2)));
  ASSERT_EQ(gone.size(), 1U);
  EXPECT_EQ(gone[0].first, test::own_address(3));
  EXPECT_THAT(gone[0].second, testing::HasSubstr("did not read"));
  refused.clear();
  connect(3);
  EXPECT_THAT(refused, testing::ElementsAre(testing::HasSubstr("did not read")));
}

TEST_F(TcpLimitsTest, WhoSpokeTheLongestAgoGivesWayFirst) {
  open({.max_connections = 2});
  connect(3);
  connect(2);
  for (tcp::socket& one : clients) {
    const std::size_t before = spoke.size();
    write(one, test::hex(small));
    ASSERT_TRUE(run_until([&] { return spoke.size() > before; }));
    // Until it has been seen that this one has spoken.
    run_until([] { return false; }, 600ms);
    io.poll();
  }
  ASSERT_TRUE(run_until([&] {
    connect(4);
    return server->counters().gave_way == 1;
  }));
  ASSERT_EQ(gone.size(), 1U);
  EXPECT_EQ(gone[0].first, test::own_address(3));
}

// Else an address could take one connection after the other from those that seldom speak.
TEST_F(TcpLimitsTest, NobodyTakesAPlaceFromAnAddressThatHasNoMore) {
  open({.max_connections = 2});
  for (const unsigned address : {2U, 3U}) {
    write(connect(address), test::hex(small));
    ASSERT_TRUE(run_until([&] { return spoke.size() == address - 1; }));
  }
  run_until([] { return false; }, 2s);
  connect(2);
  EXPECT_EQ(server->counters().gave_way, 0U);
  EXPECT_EQ(server->counters().refused, 1U);
  EXPECT_TRUE(run_until([&] {
    connect(4);
    return server->counters().gave_way == 1;
  })) << "they were silent for long enough";
}

TEST_F(TcpLimitsTest, WhoNeverSaysAnythingKeepsNobodyOut) {
  open({.max_connections = 2});
  tcp::socket& speaks = connect(2);
  write(speaks, test::hex(small));
  ASSERT_TRUE(run_until([&] { return received.size() == 1; }));
  connect(3);
  run_until([] { return false; }, 1100ms);
  connect(4);
  EXPECT_EQ(server->counters().gave_way, 1U);
  ASSERT_EQ(gone.size(), 1U);
  EXPECT_EQ(gone[0].first, test::own_address(3));
}

}  // namespace
}  // namespace trestle::someip::tcp_limits_test
