#include "bridge/web/server.hpp"

#include <gmock/gmock.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <thread>

#include "bridge/web/assets.hpp"

namespace trestle::web {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

/// A server on a port of its own, in a thread.
class ServerTest : public ::testing::Test {
 protected:
  ServerTest()
      : server_{io_,
                {IpAddress::v4(127, 0, 0, 1), 0},
                [this](const Request& request, const Server::Reply& reply) {
                  if (request.path == "/throw") {
                    throw std::runtime_error{"something broke"};
                  }
                  std::string text = request.method + " " + request.path;
                  for (const auto& [key, value] : request.query) {
                    text += " " + key + "=" + value;
                  }
                  const Answer answer{.body = text + " [" + request.body + "]",
                                      .file_name = request.path == "/save" ? "a\"b/c.txt" : ""};
                  if (request.path == "/later") {
                    boost::asio::post(io_, [reply, answer] { reply(answer); });
                    return;
                  }
                  reply(answer);
                  reply(answer);  // is ignored
                },
                {.connections = 4, .header_bytes = 2000, .body_bytes = 1000}},
        thread_{[this] { io_.run(); }} {}
  ~ServerTest() override {
    io_.stop();
    thread_.join();
  }

  [[nodiscard]] std::string port() const { return std::to_string(server_.port()); }
  /// Sends text as it is, and returns all that comes until the server closes.
  [[nodiscard]] std::string talk(const std::string& text) const {
    boost::asio::io_context io;
    boost::asio::ip::tcp::socket socket{io};
    socket.connect({boost::asio::ip::address_v4::loopback(), server_.port()});
    boost::system::error_code error;
    boost::asio::write(socket, boost::asio::buffer(text), error);
    std::string answer;
    boost::asio::read(socket, boost::asio::dynamic_buffer(answer), error);
    return answer;
  }
  [[nodiscard]] std::string get(const std::string& target, const std::string& host = "") const {
    return talk("GET " + target + " HTTP/1.1\r\nHost: " + (host.empty() ? "127.0.0.1:" + port() : host) +
                "\r\nConnection: close\r\n\r\n");
  }
  [[nodiscard]] std::string post(const std::string& body, const std::string& headers,
                                 const std::string& type = "application/json") const {
    return talk("POST /x HTTP/1.1\r\nHost: localhost:" + port() +
                "\r\nConnection: close\r\nContent-Type: " + type +
                "\r\nContent-Length: " + std::to_string(body.size()) + "\r\n" + headers + "\r\n" + body);
  }

  boost::asio::io_context io_;
  Server server_;
  std::thread thread_;
};

TEST_F(ServerTest, AnswersWithWhatTheHandlerSays) {
  const std::string answer = get("/a%20b?x=1+2&y=%C3%A4");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200 OK\r\n"));
  EXPECT_THAT(answer, HasSubstr("GET /a b x=1 2 y=\xc3\xa4 []"));
  EXPECT_THAT(answer, HasSubstr("Content-Security-Policy: default-src 'none'"));
  EXPECT_EQ(server_.url(), "http://127.0.0.1:" + port() + "/");
}

TEST_F(ServerTest, AnswersSeveralRequestsOfOneConnection) {
  const std::string one = "GET /1 HTTP/1.1\r\nHost: localhost\r\n\r\n";
  const std::string last = "GET /2 HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
  const std::string answer = talk(one + last);
  EXPECT_THAT(answer, HasSubstr("GET /1"));
  EXPECT_THAT(answer, HasSubstr("GET /2"));
}

TEST_F(ServerTest, ServesNobodyElsesName) {
  EXPECT_THAT(get("/", "evil.example:" + port()), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(get("/", "127.0.0.1.evil.example"), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(talk("GET / HTTP/1.0\r\n\r\n"), StartsWith("HTTP/1.1 403"));
}

TEST_F(ServerTest, TakesRequestsOfItsOwnPagesOnly) {
  EXPECT_THAT(post("hello", "Origin: http://localhost:" + port() + "\r\n"), HasSubstr("POST /x [hello]"));
  EXPECT_THAT(post("hello", ""), HasSubstr("[hello]"));
  EXPECT_THAT(post("hello", "Origin: http://evil.example\r\n"), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(post("hello", "Origin: https://localhost:" + port() + "\r\n"), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(post("hello", "Origin: null\r\n"), StartsWith("HTTP/1.1 403"));
}

TEST_F(ServerTest, TakesNothingThatAFormOfAnotherPageCouldSend) {
  EXPECT_THAT(post("a=1", "", "application/x-www-form-urlencoded"), StartsWith("HTTP/1.1 415"));
  EXPECT_THAT(post("{}", "", "text/plain"), StartsWith("HTTP/1.1 415"));
  // What a browser asks first when a script of another page wants to send JSON.
  EXPECT_THAT(talk("OPTIONS /x HTTP/1.1\r\nHost: localhost\r\nOrigin: http://evil.example\r\n"
                   "Access-Control-Request-Method: POST\r\nConnection: close\r\n\r\n"),
              StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(get("/"), HasSubstr("Cross-Origin-Resource-Policy: same-origin"));
}

TEST_F(ServerTest, IsMeantByTheAddressThatARequestCameTo) {
  boost::asio::io_context io;
  const Server everywhere{
      io, {IpAddress::v4(0, 0, 0, 0), 0}, [](const Request&, const Server::Reply& reply) { reply({}); }};
  std::thread thread{[&] { io.run(); }};
  const auto ask = [&](const std::string& host) {
    boost::asio::io_context own;
    boost::asio::ip::tcp::socket socket{own};
    socket.connect({boost::asio::ip::address_v4::loopback(), everywhere.port()});
    boost::asio::write(
        socket, boost::asio::buffer("GET / HTTP/1.1\r\nHost: " + host + ":" +
                                    std::to_string(everywhere.port()) + "\r\nConnection: close\r\n\r\n"));
    std::string answer;
    boost::system::error_code error;
    boost::asio::read(socket, boost::asio::dynamic_buffer(answer), error);
    return answer;
  };
  EXPECT_THAT(ask("127.0.0.1"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(ask("127.0.0.2"), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(ask("evil.example"), StartsWith("HTTP/1.1 403"));
  io.stop();
  thread.join();
}

TEST_F(ServerTest, RefusesWhatIsTooLargeOrNoRequest) {
  EXPECT_THAT(post(std::string(1001, 'x'), ""), StartsWith("HTTP/1.1 413"));
  EXPECT_THAT(post("", "X-Long: " + std::string(3000, 'x') + "\r\n"), StartsWith("HTTP/1.1 431"));
  EXPECT_THAT(talk("nonsense\r\n\r\n"), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(get("/%zz"), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(get("/%4"), StartsWith("HTTP/1.1 400"));
}

TEST_F(ServerTest, TakesAnAnswerThatComesLater) {
  EXPECT_THAT(get("/later"), HasSubstr("GET /later []"));
}

TEST_F(ServerTest, TellsWhatTheHandlerThrew) {
  const std::string answer = get("/throw");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 500"));
  EXPECT_THAT(answer, HasSubstr("something broke"));
}

TEST_F(ServerTest, NamesAFileWithoutWhatWouldBreakTheHeader) {
  EXPECT_THAT(get("/save"), HasSubstr("Content-Disposition: attachment; filename=\"a_b_c.txt\""));
}

TEST_F(ServerTest, LetsNobodyTakeAllPlaces) {
  boost::asio::io_context io;
  std::vector<std::unique_ptr<boost::asio::ip::tcp::socket>> idle;
  for (int i = 0; i < 4; ++i) {
    idle.push_back(std::make_unique<boost::asio::ip::tcp::socket>(io));
    idle.back()->connect({boost::asio::ip::address_v4::loopback(), server_.port()});
  }
  idle.pop_back();  // one place is free again, and the next one gets it
  EXPECT_THAT(get("/"), StartsWith("HTTP/1.1 200"));
}

TEST_F(ServerTest, AnswersHeadWithoutABody) {
  const std::string answer = talk("HEAD / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(answer, Not(HasSubstr("[")));
}

TEST(Assets, AreAnsweredByTheirNamesAlone) {
  const auto look = asset_answer("/look.css");
  ASSERT_TRUE(look);
  EXPECT_EQ(look->type, "text/css; charset=utf-8");
  EXPECT_THAT(look->body, HasSubstr("color-scheme"));
  EXPECT_FALSE(asset_answer("/../assets/look.css"));
  EXPECT_FALSE(asset_answer("look.css"));
  EXPECT_FALSE(asset_answer("/etc/passwd"));
  EXPECT_FALSE(asset_answer(""));
}

TEST(Assets, AreThere) {
  EXPECT_FALSE(assets().empty());
  for (const Asset& asset : assets()) {
    EXPECT_FALSE(asset.text.empty()) << asset.name;
  }
}

}  // namespace
}  // namespace trestle::web
