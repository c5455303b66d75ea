#include "bridge/console/console.hpp"

#include <gmock/gmock.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
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
        [this] { return picture_; }, [this](std::size_t route) { return newest(route); });
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

  boost::asio::io_context io_;
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
}

TEST_F(ConsoleTest, AsksForTheToken) {
  start("a secret of many letters");
  EXPECT_THAT(get("/metrics"), StartsWith("HTTP/1.1 401"));
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
