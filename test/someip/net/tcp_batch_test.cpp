// TCP: what answers messages that came together leaves together, in order.
#include <gmock/gmock.h>

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <memory>
#include <vector>

#include "someip/net/tcp_client.hpp"
#include "someip/net/tcp_server.hpp"
#include "test/loopback.hpp"

namespace trestle::someip::tcp_batch_test {
namespace {

using namespace std::chrono_literals;

constexpr Header request{.service = ServiceId{0x1234}, .method = MethodId{1}};

class TcpBatchTest : public testing::Test {
 protected:
  // Sends `count` requests before the connection stands, so that they come together.
  void call(std::uint16_t count) {
    client = std::make_unique<TcpClient>(
        io, TcpClientOptions{.local = test::own_address(2), .remote = server->local()},
        TcpClient::Handlers{.message = [this](const Message& message) {
          answers.emplace_back(value(message.header.session), message.payload.size());
          EXPECT_THAT(message.payload, testing::Each(static_cast<std::byte>(answers.back().first)));
        }});
    for (std::uint16_t i = 1; i <= count; ++i) {
      Header header = request;
      header.session = SessionId{i};
      ASSERT_TRUE(client->send(header, {}));
    }
  }
  // Its payload is gone when it returns.
  void answer(const Message& message, const Endpoint& to, std::size_t bytes) {
    const std::vector<std::byte> payload(bytes, static_cast<std::byte>(message.header.session));
    const ByteView slice{payload};
    EXPECT_TRUE(server->send(to, message.header, {&slice, 1}));
  }
  template <typename Condition>
  void run_until(Condition condition) {
    const auto end = std::chrono::steady_clock::now() + 30s;
    while (!condition() && std::chrono::steady_clock::now() < end) {
      io.run_one_for(20ms);
    }
    ASSERT_TRUE(condition());
  }

  boost::asio::io_context io;
  std::unique_ptr<TcpServer> server =
      std::make_unique<TcpServer>(io, TcpServerOptions{.local = {test::own_address(1), 0}});
  std::unique_ptr<TcpClient> client;
  std::vector<std::pair<std::uint16_t, std::size_t>> answers;
};

TEST_F(TcpBatchTest, TheFirstAnswerLeavesAtOnceAndTheOthersTogether) {
  std::vector<std::uint64_t> sent;
  server->start({.message = [&](const Message& message, const Endpoint& from) {
    answer(message, from, 10);
    sent.push_back(server->counters().streams.messages_sent);
  }});
  call(40);
  run_until([&] { return answers.size() == 40; });
  for (std::uint16_t i = 0; i < 40; ++i) {
    EXPECT_EQ(answers[i], std::pair(static_cast<std::uint16_t>(i + 1), std::size_t{10}));
  }
  EXPECT_EQ(sent.front(), 1U);
  EXPECT_LT(sent.back(), 40U);
  EXPECT_EQ(server->counters().streams.messages_sent, 40U);
}

TEST_F(TcpBatchTest, LargeOnesKeepTheOrderAndDoNotWait) {
  server->start({.message = [&](const Message& message, const Endpoint& from) {
    answer(message, from, value(message.header.session) % 4 == 3 ? 100'000 : 10);
  }});
  call(20);
  run_until([&] { return answers.size() == 20; });
  for (std::uint16_t i = 0; i < 20; ++i) {
    const auto session = static_cast<std::uint16_t>(i + 1);
    EXPECT_EQ(answers[i], std::pair(session, std::size_t{session % 4 == 3 ? 100'000U : 10U}));
  }
}

TEST_F(TcpBatchTest, LeaveAlsoWhenAHandlerEndsTheServer) {
  server->start({.message = [&](const Message& message, const Endpoint& from) {
    answer(message, from, 10);
    if (message.header.session == SessionId{5}) {
      server.reset();
    }
  }});
  call(5);
  run_until([&] { return answers.size() == 5; });
}

}  // namespace
}  // namespace trestle::someip::tcp_batch_test
