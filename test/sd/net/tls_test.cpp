// TLS of TCP connections, with certificates that `openssl` makes for each run, and with a key that both know.
#include "someip/net/tls.hpp"

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "someip/net/address_text.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::tls_test {
namespace {
using namespace test;
using namespace std::chrono_literals;
using someip::EventgroupId;
using someip::InstanceId;
using someip::MethodId;
using someip::ServiceId;
using someip::TlsSettings;
using testing::HasSubstr;

/// Keys of two certificate authorities, and of two hosts that the first one has signed and one that the other
/// has.
class Keys {
 public:
  Keys() {
    std::string name = (std::filesystem::temp_directory_path() / "trestle_tls_XXXXXX").string();
    EXPECT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    for (const char* const root : {"ours", "theirs"}) {
      run("req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 2 -subj /CN=" +
          std::string{root} + " -keyout " + root + ".key -out " + root + ".pem");
    }
    sign("server", "ours");
    sign("client", "ours");
    sign("stranger", "theirs");
    write("psk.hex", "000102030405060708090a0b0c0d0e0f\n");
    write("other.hex", "ff0102030405060708090a0b0c0d0e0f\n");
  }
  Keys(const Keys&) = delete;
  Keys& operator=(const Keys&) = delete;
  ~Keys() { std::filesystem::remove_all(folder_); }

  [[nodiscard]] TlsSettings of(const std::string& host) const {
    return {.certificate_file = at(host + ".pem"), .key_file = at(host + ".key"), .ca_file = at("ours.pem")};
  }
  [[nodiscard]] TlsSettings psk(const std::string& file = "psk.hex") const {
    return {.psk_identity = "vehicle", .psk_key_file = at(file)};
  }
  [[nodiscard]] std::string at(const std::string& name) const { return (folder_ / name).string(); }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream{folder_ / name} << text;
  }

 private:
  void sign(const std::string& host, const std::string& root) const {
    run("req -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -subj /CN=" + host + " -keyout " + host +
        ".key -out " + host + ".csr");
    run("x509 -req -days 2 -in " + host + ".csr -CA " + root + ".pem -CAkey " + root +
        ".key -CAcreateserial -out " + host + ".pem");
  }
  void run(const std::string& command) const {
    ASSERT_EQ(std::system(("cd " + folder_.string() + " && openssl " + command + " >log 2>&1").c_str()), 0)
        << command;
  }
  std::filesystem::path folder_;
};

const Keys& keys() {
  static const Keys once;
  return once;
}

/// A server with a method and an event over TCP, and a client.
class Tls : public TwoNodes {
 protected:
  static constexpr MethodId echo{0x11};
  static constexpr MethodId event{0x8001};
  static constexpr std::uint16_t port = 40388;

  void SetUp() override { ASSERT_TRUE(someip::has_tls()); }

  void start(const std::optional<TlsSettings>& of_server, const std::optional<TlsSettings>& of_client) {
    NodeConfig config = quick(server_address);
    config.tls = of_server;
    server.emplace(io, config, into(server_log), into(server_log));
    offered = server->offer(
        {.service = ServiceId{0x1234},
         .instance = InstanceId{1},
         .udp_port = {},
         .tcp_port = port,
         .methods = {{.id = echo,
                      .handler = [](const someip::Message& request,
                                    Responder responder) { responder.respond(request.payload); }}},
         .eventgroups = {{.id = EventgroupId{1}, .events = {event}}}});
    config = quick(client_address);
    config.tls = of_client;
    client.emplace(io, config, into(client_log), into(client_log));
    echoed = client->require({.service = ServiceId{0x1234}});
    ASSERT_TRUE(run_until([&] { return !client->available(echoed).empty(); }));
  }
  void call(const std::vector<std::byte>& payload, std::chrono::milliseconds timeout = 20s) {
    const ByteView view{payload};
    client->call(echoed, {.method = echo, .timeout = timeout}, {&view, 1}, note());
  }
  void expect_no_call() {
    call(numbers(4), 400ms);
    ASSERT_TRUE(run_until([&] { return !outcomes.empty() && failures() > 0; }));
    EXPECT_NE(outcomes.front().fault, std::nullopt);
    EXPECT_EQ(server->counters().requests, 0U);
    const someip::TcpStreamCounters seen = server->tcp_server_counters().streams;
    EXPECT_EQ(seen.received.messages, 0U);
    EXPECT_EQ(seen.received.bad_length, 0U);
  }
  [[nodiscard]] std::uint64_t failures() const {
    return server->tcp_server_counters().streams.handshakes_failed;
  }

  std::optional<Node> server;
  std::optional<Node> client;
  OfferHandle offered{};
  RequirementId echoed{};
};

TEST_F(Tls, CarriesCallsAndEvents) {
  for (const bool by_key : {false, true}) {
    SCOPED_TRACE(by_key ? "PSK" : "certificates");
    client.reset();
    server.reset();
    start(by_key ? keys().psk() : keys().of("server"), by_key ? keys().psk() : keys().of("client"));
    outcomes.clear();
    events.clear();
    for (const std::size_t size : {0U, 1U, 1400U, 20'000U, 3'000'000U}) {
      call(numbers(size));
    }
    ASSERT_TRUE(run_until([&] { return outcomes.size() == 5; }));
    EXPECT_EQ(outcomes.back().payload, numbers(3'000'000));
    for (const Outcome& one : outcomes) {
      EXPECT_EQ(one.fault, std::nullopt);
    }
    client->subscribe({.service = ServiceId{0x1234},
                       .eventgroup = EventgroupId{1},
                       .events = {event},
                       .udp = false,
                       .tcp = true},
                      collect());
    ASSERT_TRUE(run_until([&] { return server->subscribers(offered, event) == 1; }));
    for (std::size_t i = 0; i < 100; ++i) {
      const std::vector<std::byte> payload = numbers(i * 500, i);
      const ByteView view{payload};
      server->notify(offered, event, {&view, 1});
    }
    ASSERT_TRUE(run_until([&] { return events.size() == 100; }));
    EXPECT_EQ(events.back().payload, numbers(99 * 500, 99));
    EXPECT_EQ(failures(), 0U);
  }
}

TEST_F(Tls, RefusesACertificateThatNoneOfItsRootsHasSigned) {
  start(keys().of("server"), keys().of("stranger"));
  expect_no_call();
  EXPECT_THAT(server_log, testing::Contains(HasSubstr("the TLS handshake failed")));
}

TEST_F(Tls, RefusesAServerThatNoneOfItsRootsHasSigned) {
  start(keys().of("stranger"), keys().of("client"));
  expect_no_call();
  EXPECT_THAT(client_log, testing::Contains(HasSubstr("certificate verify failed")));
}

TEST_F(Tls, RefusesAnotherNameThanItWants) {
  TlsSettings wanted = keys().of("client");
  wanted.peer_name = "server";
  start(keys().of("server"), wanted);
  call(numbers(4));
  ASSERT_TRUE(run_until([&] { return !outcomes.empty(); }));
  EXPECT_EQ(outcomes.front().fault, std::nullopt);
  client.reset();
  server.reset();
  outcomes.clear();
  wanted.peer_name = "another";
  start(keys().of("server"), wanted);
  expect_no_call();
}

TEST_F(Tls, RefusesAnotherKey) {
  start(keys().psk(), keys().psk("other.hex"));
  expect_no_call();
}

// A server that does not know the key may show any certificate.
TEST_F(Tls, WithAKeyTrustsNoCertificate) {
  start(keys().of("server"), keys().psk());
  expect_no_call();
}

TEST_F(Tls, RefusesPlainTcp) {
  start(keys().of("server"), std::nullopt);
  call(numbers(4), 400ms);
  ASSERT_TRUE(run_until([&] { return !outcomes.empty() && failures() > 0; }));
  EXPECT_EQ(server->counters().requests, 0U);
}

TEST_F(Tls, EndsAHandshakeThatTakesTooLong) {
  TlsSettings settings = keys().of("server");
  settings.handshake_timeout = 50ms;
  start(settings, keys().of("client"));
  boost::asio::ip::tcp::socket silent{io};
  silent.connect({boost::asio::ip::make_address(someip::to_string(server_address)), port});
  ASSERT_TRUE(run_until([&] { return server->tcp_server_counters().open == 1; }));  // it has a place
  ASSERT_TRUE(run_until([&] { return failures() == 1; }));
  EXPECT_EQ(server->tcp_server_counters().open, 0U);
}

TEST(TlsSettingsOfANode, HaveTheirMistakesTold) {
  boost::asio::io_context io;
  const auto refusal = [&](const TlsSettings& settings) -> std::string {
    NodeConfig config = quick(server_address);
    config.tls = settings;
    try {
      const Node node{io, config};
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal({}), HasSubstr("tls: needs a certificate, key and ca, or a psk_identity and psk_key"));
  TlsSettings settings = keys().of("server");
  settings.key_file = keys().at("client.key");
  EXPECT_THAT(refusal(settings), HasSubstr("tls: key: "));
  settings = keys().of("server");
  settings.certificate_file = keys().at("none.pem");
  EXPECT_THAT(refusal(settings), HasSubstr("tls: certificate: "));
  settings = keys().of("server");
  settings.psk_identity = "vehicle";
  EXPECT_THAT(refusal(settings), HasSubstr("not both"));
  keys().write("short.hex", "0001");
  EXPECT_THAT(refusal(keys().psk("short.hex")), HasSubstr("16 to 64 bytes in hexadecimal digits"));
  settings = keys().psk();
  settings.psk_identity.clear();
  EXPECT_THAT(refusal(settings), HasSubstr("needs both"));
}

}  // namespace
}  // namespace trestle::sd::tls_test
