#include "bridge/console/console.hpp"

#include <gmock/gmock.h>

#include <atomic>
#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>
#include <future>
#include <optional>
#include <thread>

#include "bridge/messages/types/type_library.hpp"
#include "test/bytes.hpp"

namespace trestle::console {
namespace {

using boost::asio::ip::tcp;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

class ConsoleTest : public testing::Test {
 protected:
  ~ConsoleTest() override {
    io_.stop();
    if (thread_.joinable()) {
      thread_.join();
    }
  }
  void start(std::string token = {}) {
    console_.emplace(
        io_, ConsoleSettings{Endpoint{IpAddress::v4(127, 0, 0, 1), 0}, std::move(token)},
        [this] { return picture_; }, [this](std::size_t route) { return newest(route); },
        ViewerSources{.titles = [this] { return titles(); },
                      .view = [this](const carry::RouteTitle& title) { return view(title); },
                      .follow = [](std::uint64_t, const carry::MessageSink&) { return nullptr; }});
    const std::string url = console_->url();
    port_ = url.substr(url.rfind(':') + 1);
    port_.pop_back();
    thread_ = std::thread{[this] { io_.run(); }};
  }
  [[nodiscard]] std::string get(const std::string& target, const std::string& headers = {},
                                const std::string& method = "GET") const {
    boost::asio::io_context io;
    tcp::socket socket{io};
    boost::asio::connect(socket, tcp::resolver{io}.resolve("127.0.0.1", port_));
    const std::string request = method + " " + target + " HTTP/1.1\r\nHost: 127.0.0.1:" + port_ +
                                "\r\nConnection: close\r\n" + headers + "\r\n";
    boost::asio::write(socket, boost::asio::buffer(request));
    std::string answer;
    boost::system::error_code error;
    boost::asio::read(socket, boost::asio::dynamic_buffer(answer), error);
    return answer;
  }

  /// Route 0 is /talk, route 1 /cloud; of route 2 nothing can be looked at.
  [[nodiscard]] std::optional<ShownMessage> newest(std::size_t route) {
    if (route > 1) {
      return std::nullopt;
    }
    const std::string type = route == 0 ? "std_msgs/msg/String" : "sensor_msgs/msg/PointCloud2";
    return ShownMessage{route == 0 ? "/talk" : "/cloud", type, *types_.resolve(type), {}, newest_};
  }

  /// /talk, while it is there; and a route of a type that is not known.
  [[nodiscard]] std::vector<carry::RouteTitle> titles() const {
    std::vector<carry::RouteTitle> result{{1, "/unknown", "none/msg/None", 1, 1, 1}};
    if (talks_) {
      result.push_back({2, "/talk", "std_msgs/msg/String", 1, 1, 2});
    }
    return result;
  }
  [[nodiscard]] std::optional<RouteView> view(const carry::RouteTitle& title) {
    const auto tree = types_.resolve(title.type);
    if (!tree) {
      return std::nullopt;
    }
    return RouteView{title, *tree, *tree, {}, *messages::ConversionPlan::compile(*tree, {})};
  }

  boost::asio::io_context io_;
  std::atomic<bool> talks_ = true;
  carry::Picture picture_;
  messages::TypeLibrary types_;
  std::shared_ptr<const carry::SeenMessage> newest_;
  std::optional<Console> console_;
  std::string port_;
  std::thread thread_;
};

TEST_F(ConsoleTest, ServesMetricsInTheFormThatIsWanted) {
  picture_.pid = 4711;
  start();
  EXPECT_THAT(get("/metrics"), AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("text/plain; version=0.0.4"),
                                     Not(HasSubstr("# EOF"))));
  EXPECT_THAT(
      get("/metrics", "Accept: application/openmetrics-text;version=1.0.0,text/plain;q=0.5\r\n"),
      AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("application/openmetrics-text"), HasSubstr("# EOF")));
  EXPECT_THAT(get("/status.json"), AllOf(HasSubstr("application/json"), HasSubstr("\"pid\":4711")));
}

TEST_F(ConsoleTest, ServesItsPageAndNoOther) {
  start("a secret of many letters");
  EXPECT_THAT(get("/"), AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("text/html"),
                              HasSubstr("Content-Security-Policy: default-src 'none'; script-src 'self'")))
      << "the page asks for the token, and tells nothing before";
  EXPECT_THAT(get("/console/page.js"), AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("text/javascript")));
  EXPECT_THAT(get("/generate/page.js", "Authorization: Bearer a secret of many letters\r\n"),
              StartsWith("HTTP/1.1 404"));
}

TEST_F(ConsoleTest, ShowsTheNewestMessageOfARoute) {
  start();
  EXPECT_THAT(get("/message?route=0"),
              AllOf(StartsWith("HTTP/1.1 200"), HasSubstr(R"({"route":"/talk",)"), Not(HasSubstr("at_ns"))));
  EXPECT_THAT(get("/sight?route=1"), StartsWith("HTTP/1.1 204")) << "none has come yet";
  newest_ = std::make_shared<carry::SeenMessage>(carry::SeenMessage{
      .is_cdr = true, .bytes = test::hex("00010000 06000000 68656c6c6f 00"), .size = 14, .at_ns = 4711});
  EXPECT_THAT(get("/message?route=0"),
              AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("\"at_ns\":4711"), HasSubstr("data: hello")));
}

TEST_F(ConsoleTest, SaysWhatCannotBeLookedAt) {
  start();
  EXPECT_THAT(get("/message?route=2"), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(get("/message?route=1x"), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(get("/message?route=99999999999999999999999"), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(get("/message"), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(get("/sight?route=0"), AllOf(StartsWith("HTTP/1.1 404"), HasSubstr("nothing to see")));
}

TEST_F(ConsoleTest, ShowsMessagesToThoseAloneWhoHaveTheToken) {
  start("a secret of many letters");
  EXPECT_THAT(get("/message?route=0"), StartsWith("HTTP/1.1 401"));
  EXPECT_THAT(get("/sight?route=1"), StartsWith("HTTP/1.1 401"));
}

/// Requests for WebSocket; what is taken ends at once.
class ViewersOfConsoleTest : public ConsoleTest {
 protected:
  [[nodiscard]] std::string request(const std::string& target, const std::string& headers,
                                    const std::string& protocol, const std::string& host) const {
    return "GET " + target + " HTTP/1.1\r\nHost: " + host + ":" + port_ +
           "\r\nUpgrade: WebSocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
           "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: " +
           protocol + "\r\n" + headers + "\r\n";
  }
  [[nodiscard]] std::string ask(const std::string& target, const std::string& headers,
                                const std::string& protocol = "foxglove.websocket.v1",
                                const std::string& host = "127.0.0.1") const {
    boost::asio::io_context io;
    tcp::socket socket{io};
    boost::asio::connect(socket, tcp::resolver{io}.resolve("127.0.0.1", port_));
    boost::asio::write(socket, boost::asio::buffer(request(target, headers, protocol, host)));
    std::string answer;
    boost::system::error_code error;
    boost::asio::read_until(socket, boost::asio::dynamic_buffer(answer), "\r\n\r\n", error);
    // Until the server has closed: then there is room for the next one.
    socket.shutdown(tcp::socket::shutdown_send, error);
    boost::asio::read(socket, boost::asio::dynamic_buffer(answer), error);
    return answer;
  }
};

TEST_F(ViewersOfConsoleTest, SpeakFoxglovesProtocol) {
  start();
  // The key and its answer are those of RFC 6455, section 1.3.
  EXPECT_THAT(ask("/", ""), AllOf(StartsWith("HTTP/1.1 101"), HasSubstr("s3pPLMBiTxaQ9kYGzzhZRbK+xOo="),
                                  HasSubstr("Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n")));
  EXPECT_THAT(ask("/", "", "foxglove.sdk.v1, foxglove.websocket.v1"),
              HasSubstr("Protocol: foxglove.sdk.v1\r\n"));
  EXPECT_THAT(ask("/", "", "chat"), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(ask("/other", ""), StartsWith("HTTP/1.1 404"));
}

TEST_F(ViewersOfConsoleTest, AreNoPagesOfStrangers) {
  start();
  for (const std::string origin :
       {"file://", "https://app.foxglove.dev", "http://localhost:8080", "https://localhost",
        "http://127.0.0.1:9", "http://[::1]:8080", "http://[::1]"}) {
    EXPECT_THAT(ask("/", "Origin: " + origin + "\r\n"), StartsWith("HTTP/1.1 101")) << origin;
  }
  for (const std::string origin :
       {"null", "https://evil.example", "http://localhost.evil.example",
        "https://app.foxglove.dev.evil.example", "http://app.foxglove.dev", "file://evil",
        "http://[::1].evil.example", "http://127.0.0.1@evil.example", "http://localhost", "localhost:8080"}) {
    const bool is_here = origin == "http://localhost";
    EXPECT_THAT(ask("/", "Origin: " + origin + "\r\n"), StartsWith(is_here ? "HTTP/1.1 101" : "HTTP/1.1 403"))
        << origin;
  }
}

TEST_F(ViewersOfConsoleTest, AreToldOfRoutesThatComeAndGo) {
  start();
  boost::asio::io_context io;
  tcp::socket socket{io};
  boost::asio::connect(socket, tcp::resolver{io}.resolve("127.0.0.1", port_));
  boost::asio::write(socket, boost::asio::buffer(request("/", "", "foxglove.sdk.v1", "localhost")));
  std::string received;
  // A server masks nothing: texts stand in what comes as they are.
  const std::string told = R"("topic":"/someip/0x0001/0x0002"}],"op":"advertise"})";
  boost::asio::read_until(socket, boost::asio::dynamic_buffer(received), told);
  EXPECT_THAT(received, AllOf(HasSubstr(R"("op":"serverInfo")"), HasSubstr(R"("topic":"/talk")"),
                              Not(HasSubstr("/unknown"))));
  received.clear();
  talks_ = false;
  boost::asio::read_until(socket, boost::asio::dynamic_buffer(received),
                          R"({"channelIds":[1,2],"op":"unadvertise"})");
  received.clear();
  talks_ = true;
  boost::asio::read_until(socket, boost::asio::dynamic_buffer(received), told);
  EXPECT_THAT(received, AllOf(HasSubstr(R"("id":3)"), HasSubstr(R"("id":4)")))
      << "numbers are not used again";
}

TEST_F(ViewersOfConsoleTest, EndWithTheConsole) {
  start();
  boost::asio::io_context io;
  tcp::socket socket{io};
  boost::asio::connect(socket, tcp::resolver{io}.resolve("127.0.0.1", port_));
  boost::asio::write(socket, boost::asio::buffer(request("/", "", "foxglove.sdk.v1", "localhost")));
  std::string received;
  boost::asio::read_until(socket, boost::asio::dynamic_buffer(received), "serverInfo");
  std::promise<void> ended;
  boost::asio::post(io_, [&] {
    console_.reset();
    ended.set_value();
  });
  ended.get_future().wait();
  boost::system::error_code error;
  boost::asio::read(socket, boost::asio::dynamic_buffer(received), error);
  EXPECT_TRUE(error) << "it is closed, and nothing is left of it";
}

TEST_F(ViewersOfConsoleTest, MeanThisHost) {
  start();
  EXPECT_THAT(ask("/", "", "foxglove.sdk.v1", "localhost"), StartsWith("HTTP/1.1 101"));
  EXPECT_THAT(ask("/", "", "foxglove.sdk.v1", "evil.example"), StartsWith("HTTP/1.1 403"));
}

TEST_F(ViewersOfConsoleTest, GiveTheTokenInTheirAddress) {
  start("a secret of many letters");
  EXPECT_THAT(ask("/", ""), StartsWith("HTTP/1.1 401"));
  EXPECT_THAT(ask("/?token=a%20secret%20of%20many%20letterz", ""), StartsWith("HTTP/1.1 401"));
  EXPECT_THAT(ask("/?token=a%20secret%20of%20many%20letters", ""), StartsWith("HTTP/1.1 101"));
  EXPECT_THAT(ask("/", "Authorization: Bearer a secret of many letters\r\n"), StartsWith("HTTP/1.1 101"));
  EXPECT_THAT(ask("/?token=a%20secret%20of%20many%20letters", "Origin: https://lichtblick.example\r\n"),
              StartsWith("HTTP/1.1 101"))
      << "who gives the token to a page trusts it";
  EXPECT_THAT(ask("/", "Origin: https://lichtblick.example\r\n"), StartsWith("HTTP/1.1 403"));
}

TEST_F(ConsoleTest, SaysWhetherTheBridgeIsHealthyAndReady) {
  start();
  EXPECT_THAT(get("/healthz"), AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("ok\n")));
  EXPECT_THAT(get("/readyz"), AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("ready\n")));
}

TEST_F(ConsoleTest, IsNotReadyWhileItStops) {
  picture_.stopping = true;
  start();
  EXPECT_THAT(get("/healthz"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(get("/readyz"), AllOf(StartsWith("HTTP/1.1 503"), HasSubstr("the bridge is stopping")));
}

TEST_F(ConsoleTest, IsNotReadyOnAnotherInterface) {
  picture_.someip.other_interface = "10.0.0.1 is not that of `interface` eth1, but of eth0";
  start();
  EXPECT_THAT(get("/readyz"), AllOf(StartsWith("HTTP/1.1 503"), HasSubstr("but of eth0")));
}

TEST_F(ConsoleTest, ChangesNothing) {
  start();
  EXPECT_THAT(get("/metrics", "Content-Type: application/json\r\nContent-Length: 0\r\n", "POST"),
              StartsWith("HTTP/1.1 405"));
  EXPECT_THAT(get("/other"), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(get("/record"), AllOf(StartsWith("HTTP/1.1 200"), HasSubstr(R"("allowed":false)")));
  EXPECT_THAT(get("/record", "Content-Type: application/json\r\nContent-Length: 0\r\n", "POST"),
              StartsWith("HTTP/1.1 403"));
}

TEST_F(ConsoleTest, AsksForTheToken) {
  start("a secret of many letters");
  EXPECT_THAT(get("/metrics"), StartsWith("HTTP/1.1 401"));
  EXPECT_THAT(get("/status.json?token=a%20secret%20of%20many%20letters"), StartsWith("HTTP/1.1 401"))
      << "in the address for WebSocket alone";
  EXPECT_THAT(get("/status.json", "Authorization: Bearer a secret of many letterz\r\n"),
              StartsWith("HTTP/1.1 401"));
  EXPECT_THAT(get("/readyz", "Authorization: Bearer a secret of many letters and more\r\n"),
              StartsWith("HTTP/1.1 401"));
  EXPECT_THAT(get("/metrics", "Authorization: Bearer a secret of many letters\r\n"),
              StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(get("/healthz"), StartsWith("HTTP/1.1 200")) << "that it lives is no secret";
}

}  // namespace
}  // namespace trestle::console
