// Nodes at the two ends of a cable that is pulled: two network namespaces with an Ethernet device each.
#include <fcntl.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <optional>

#include "someip/net/udp_socket.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/interop/suite_namespaces.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::link_test {
namespace {

using interop::Namespaces;
using someip::MethodId;
using test::covers;
using namespace std::chrono_literals;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr MethodId event{0x8001};
constexpr MethodId event_tcp{0x8002};

void run(const std::string& command) {
  ASSERT_EQ(std::system(command.c_str()), 0) << command;  // NOLINT(*-env33-c): of our own text only
}

/// So long that nothing here heals by waiting for it.
constexpr std::uint32_t long_ttl_s = 3600;

NodeConfig slow_to_expire(const IpAddress& address) {
  NodeConfig config = test::quick(address);
  config.timing.ttl_s = long_ttl_s;
  return config;
}

class LinkTest : public test::TwoNodes {
 protected:
  static void SetUpTestSuite() {
    namespaces.make();
    if (namespaces) {
      own_place = open("/proc/self/ns/net", O_RDONLY | O_CLOEXEC);
      peer_place = open(namespaces->peer_file().c_str(), O_RDONLY | O_CLOEXEC);
    }
  }
  void SetUp() override { namespaces.expect(); }
  void TearDown() override {
    client.reset();
    server.reset();
  }

  /// Does it in the peers' namespace: sockets that are opened meanwhile are there.
  template <typename Function>
  static void at_peer(Function function) {
    ASSERT_EQ(setns(peer_place, CLONE_NEWNET), 0);
    function();
    ASSERT_EQ(setns(own_place, CLONE_NEWNET), 0);
  }
  static void run_at_peer(const std::string& command) {
    run("nsenter --net=" + namespaces->peer_file() + " " + command);
  }

  /// Runs both ends.
  template <typename Condition>
  [[nodiscard]] bool both_until(Condition condition, std::chrono::milliseconds limit = 60s) {
    using Clock = std::chrono::steady_clock;
    constexpr Clock::duration step = 5ms;
    // As run_until(): a stall of the machine does not count.
    for (Clock::duration left = limit; left > 0s;) {
      if (condition()) {
        return true;
      }
      const Clock::time_point before = Clock::now();
      io.run_one_for(1ms);
      at_peer([&] { peer_io.poll(); });
      left -= std::min(Clock::now() - before, step);
    }
    return condition();
  }
  void both_for(std::chrono::milliseconds time) {
    static_cast<void>(both_until([] { return false; }, time));
  }

  void start_server(const NodeConfig& config) {
    server.emplace(io, config, into(server_log));
    offer = server->offer({.service = ServiceId{0x1234},
                           .instance = someip::InstanceId{1},
                           .udp_port = 0,
                           .tcp_port = 0,
                           .eventgroups = {{.id = EventgroupId{1}, .events = {event}},
                                           {.id = EventgroupId{2}, .events = {event_tcp}}},
                           .tcp_events = {event_tcp}});
  }
  void start_server() { start_server(slow_to_expire(Namespaces::own)); }
  void start_client(const NodeConfig& config) {
    at_peer([&] {
      client.emplace(peer_io, config, into(client_log));
      const SubscribeSpec wanted{.service = ServiceId{0x1234},
                                 .instance = someip::InstanceId{1},
                                 .eventgroup = EventgroupId{1},
                                 .events = {event}};
      by_udp = client->subscribe(wanted, collect());
      SubscribeSpec wanted_by_tcp = wanted;
      wanted_by_tcp.eventgroup = EventgroupId{2};
      wanted_by_tcp.events = {event_tcp};
      wanted_by_tcp.udp = false;
      wanted_by_tcp.tcp = true;
      by_tcp = client->subscribe(wanted_by_tcp, collect());
    });
  }
  void start_client() { start_client(slow_to_expire(Namespaces::peer)); }
  void start() {
    start_server();
    start_client();
    ASSERT_TRUE(both_until([&] { return subscribed(); }));
  }

  [[nodiscard]] bool subscribed() const { return client->subscribed(by_udp) && client->subscribed(by_tcp); }
  [[nodiscard]] std::size_t subscribers() const {
    return server->subscribers(offer, event) + server->subscribers(offer, event_tcp);
  }
  [[nodiscard]] static std::size_t count(const std::vector<std::string>& log, const std::string& part) {
    return static_cast<std::size_t>(std::count_if(log.begin(), log.end(), [&](const std::string& line) {
      return line.find(part) != std::string::npos;
    }));
  }
  /// Both have lost each other.
  void expect_lost() {
    EXPECT_EQ(subscribers(), 0U);
    EXPECT_EQ(server->tcp_server_counters().open, 0U);
    EXPECT_FALSE(client->subscribed(by_udp));
    EXPECT_FALSE(client->subscribed(by_tcp));
    EXPECT_THAT(server_log, Contains(HasSubstr("link down, no longer subscribed")));
    EXPECT_THAT(client_log, Contains(HasSubstr("is gone: link down")));
  }
  /// Both find each other and events come, and nobody has taken the other for started anew.
  void expect_healed() {
    EXPECT_TRUE(both_until([&] { return subscribed() && subscribers() == 2; }));
    events.clear();
    server->notify(offer, event, {});
    server->notify(offer, event_tcp, {});
    EXPECT_TRUE(both_until([&] { return events.size() == 2; }));
    EXPECT_THAT(server_log, Not(Contains(HasSubstr("has restarted"))));
    EXPECT_THAT(client_log, Not(Contains(HasSubstr("has restarted"))));
  }

  static inline interop::SuiteNamespaces namespaces;
  static inline int own_place = -1;
  static inline int peer_place = -1;
  boost::asio::io_context peer_io;
  std::optional<Node> server;  ///< at our end
  std::optional<Node> client;  ///< at the peers' end
  OfferHandle offer{};
  SubscriptionId by_udp{};
  SubscriptionId by_tcp{};
};

TEST_F(LinkTest, IsFollowedAtBothEnds) {
  covers({"feat_req_someipsd_23", "feat_req_someipsd_72", "feat_req_someipsd_436", "feat_req_someipsd_437",
          "feat_req_someipsd_440"});
  NodeConfig config = slow_to_expire(Namespaces::own);
  config.timing.initial_delay_min = config.timing.initial_delay_max = 600ms;
  start_server(config);
  config.address = Namespaces::peer;
  start_client(config);
  ASSERT_TRUE(both_until([&] { return subscribed(); }));
  EXPECT_EQ(subscribers(), 2U);

  run("ip link set eth0 down");
  ASSERT_TRUE(both_until([&] { return subscribers() == 0 && !client->subscribed(by_udp); }));
  expect_lost();
  EXPECT_THAT(server_log, Contains("link eth0 is down: it is switched off"));
  EXPECT_THAT(client_log, Contains("link eth0 is down: it has no carrier"));
  const auto said = [&] {
    return server->discovery_counters().datagrams_sent + client->discovery_counters().datagrams_sent;
  };
  const std::uint64_t before = said();
  const std::uint64_t sent = server->sender_counters().datagrams;
  both_for(200ms);  // four cycles of offers
  EXPECT_EQ(server->notify(offer, event, {}).subscribers, 0U);
  EXPECT_EQ(said(), before);
  EXPECT_EQ(server->sender_counters().datagrams, sent);

  const auto begin = std::chrono::steady_clock::now();
  run("ip link set eth0 up");
  ASSERT_TRUE(both_until([&] { return count(server_log, "link eth0 is up") == 1; }));
  const std::uint64_t offers = server->discovery_counters().datagrams_sent;
  both_for(100ms);
  const bool offered = server->discovery_counters().datagrams_sent > offers;
  EXPECT_TRUE(!offered || std::chrono::steady_clock::now() - begin >= 600ms)
      << "all begins with the initial wait";
  expect_healed();
  EXPECT_EQ(server->counters().discovery_not_sent, 0U);
  EXPECT_EQ(client->counters().discovery_not_sent, 0U);
  EXPECT_EQ(count(client_log, "link eth0 is up"), 1U);
}

TEST_F(LinkTest, ThatIsDownAtTheStartIsWaitedFor) {
  covers({"feat_req_someipsd_72"});
  run("ip link set eth0 down");
  start_server();
  EXPECT_THAT(server_log, Contains("link eth0 is down: it is switched off; discovery starts when it is up"));
  start_client();
  // The system itself may need a second to see that a cable is dead.
  ASSERT_TRUE(both_until([&] { return count(client_log, "link eth0 is down: it has no carrier") == 1; }));
  const std::uint64_t said = client->discovery_counters().datagrams_sent;
  both_for(200ms);
  EXPECT_EQ(server->discovery_counters().datagrams_sent, 0U);
  EXPECT_EQ(client->discovery_counters().datagrams_sent, said);
  run("ip link set eth0 up");
  expect_healed();
}

TEST_F(LinkTest, ThatWasDownForAMomentOnlyWasDown) {
  start();
  run("ip link set eth0 down && ip link set eth0 up");  // before a Node gets to see anything
  ASSERT_TRUE(both_until([&] { return count(server_log, "link eth0 is up") == 1; }));
  EXPECT_EQ(count(server_log, "link eth0 is down"), 1U);
  EXPECT_EQ(count(server_log, "link down, no longer subscribed"), 2U);
  expect_healed();
}

TEST_F(LinkTest, NeedsTheAddress) {
  start();
  run("ip address del 10.77.0.2/24 dev eth0");
  ASSERT_TRUE(both_until([&] { return subscribers() == 0; }));
  EXPECT_THAT(server_log, Contains("link eth0 is down: no interface has 10.77.0.2"));
  EXPECT_TRUE(subscribed()) << "the other end cannot see it";
  run("ip address add 10.77.0.2/24 dev eth0");
  expect_healed();
}

TEST_F(LinkTest, IsFollowedToAnInterfaceThatIsMadeAnew) {
  start();
  run("ip link del eth0");  // and with it the other end
  ASSERT_TRUE(both_until([&] { return subscribers() == 0 && !client->subscribed(by_udp); }));
  expect_lost();
  run("ip link add eth0 type veth peer name eth0 netns " + namespaces->peer_file());
  run("ip address add 10.77.0.2/24 dev eth0 && ip link set eth0 up");
  run_at_peer("ip address add 10.77.0.1/24 dev eth0");
  run_at_peer("ip link set eth0 up");
  expect_healed();
}

TEST_F(LinkTest, IsNotWatchedWhereThatIsNotWanted) {
  NodeConfig config = slow_to_expire(Namespaces::own);
  config.watch_link = false;
  start_server(config);
  start_client();
  ASSERT_TRUE(both_until([&] { return subscribed(); }));
  run("ip link set eth0 down");
  ASSERT_TRUE(both_until([&] { return !client->subscribed(by_udp); }));
  EXPECT_EQ(subscribers(), 2U);
  EXPECT_THAT(server_log, Not(Contains(HasSubstr("link"))));
  run("ip link set eth0 up");
}

TEST_F(LinkTest, IsUpWhenApplicationAndSystemSaySo) {
  start();
  server->link(false);
  EXPECT_EQ(subscribers(), 0U);
  run("ip link set eth0 down && ip link set eth0 up");
  ASSERT_TRUE(both_until([&] { return count(server_log, "link eth0 is up") == 1; }));
  const std::uint64_t said = server->discovery_counters().datagrams_sent;
  both_for(150ms);
  EXPECT_EQ(server->discovery_counters().datagrams_sent, said);
  server->link(true);
  expect_healed();
}

TEST_F(LinkTest, IsLookedAtAgainWhenNewsWereLost) {
  start();
  // More than what the system keeps for us; what comes last is lost.
  run("(for i in $(seq 1000); do echo link set eth0 mtu $((1499 + i % 2)); done; echo link set eth0 down) | "
      "ip -batch -");
  ASSERT_TRUE(both_until([&] { return subscribers() == 0; }));
  EXPECT_THAT(server_log, Contains("link eth0 is down: it is switched off"));
  run("ip link set eth0 up");
  expect_healed();
}

TEST_F(LinkTest, IsLeftAloneAfterTheShutdown) {
  start();
  server->shutdown();
  run("ip link set eth0 down && ip link set eth0 up");
  both_for(100ms);
  EXPECT_THAT(server_log, Not(Contains(HasSubstr("link eth0"))));
}

TEST_F(LinkTest, IsNoReasonToIgnoreLoopbackWhereSubnetsAreNotChecked) {
  covers({"feat_req_someipsd_1149", "feat_req_someipsd_1233"});
  run("ip link set lo up");
  const auto subscribe = test::hex(
      "ffff8100 00000030 00000000 01010200 c0000000"
      "00000010 06000010 12340001 01000e10 00000001"
      "0000000c 000904007f00000500119c40");  // 127.0.0.5:40000
  for (const bool check : {true, false}) {
    NodeConfig config = slow_to_expire(Namespaces::own);
    config.check_subnet = check;
    start_server(config);
    // Our own offers come back: the link is up, also where the test before has just switched it on.
    ASSERT_TRUE(run_until([&] { return server->discovery_counters().dropped_own != 0; }));
    someip::UdpSocket stranger{io, {.local = {IpAddress::v4(127, 0, 0, 5), 0}}};
    const ByteView view{subscribe};
    ASSERT_EQ(stranger.send({Namespaces::own, config.port}, {&view, 1}), someip::SendStatus::sent);
    ASSERT_TRUE(run_until([&] {
      return server->discovery_counters().dropped_source + server->subscribers(offer, event) != 0;
    }));
    EXPECT_EQ(server->discovery_counters().dropped_source, check ? 1U : 0U);
    EXPECT_EQ(server->subscribers(offer, event), check ? 0U : 1U);
    server.reset();
  }
}

/// Sends a datagram that says it comes from port 40000 of somebody else.
void send_as(int raw, const IpAddress& from, std::uint16_t port, ByteView payload) {
  // Of IPv4 and UDP; lengths and checksums that are 0 are filled in by the system, or not needed.
  std::vector<std::byte> packet = test::hex("45000000 00000000 40110000 00000000 00000000 9c400000 00000000");
  packet.insert(packet.end(), payload.begin(), payload.end());
  const auto put = [&](std::size_t at, const auto& bytes, std::size_t count) {
    std::memcpy(packet.data() + at, bytes.data(), count);
  };
  const auto put_u16 = [&](std::size_t at, std::size_t number) {
    put(at, std::array{static_cast<std::uint8_t>(number >> 8U), static_cast<std::uint8_t>(number)}, 2);
  };
  put(12, from.bytes, 4);
  put(16, Namespaces::own.bytes, 4);
  put_u16(22, port);
  put_u16(24, 8 + payload.size());
  sockaddr_in to{};
  to.sin_family = AF_INET;
  std::memcpy(&to.sin_addr, Namespaces::own.bytes.data(), 4);
  ASSERT_EQ(sendto(raw, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to),
            static_cast<ssize_t>(packet.size()));
}

// Somebody asks in the names of hosts that are not there.
TEST_F(LinkTest, IsNotWaitedForByAllAnswersToSilentHosts) {
  constexpr std::uint16_t port = 40123;
  constexpr MethodId method{1};
  const auto request = test::hex("12340001 00000008 00010001 01010000");
  server.emplace(io, slow_to_expire(Namespaces::own), into(server_log));
  server->offer(
      {.service = ServiceId{0x1234},
       .instance = someip::InstanceId{1},
       .udp_port = port,
       .methods = {{method, [](const someip::Message&, Responder responder) { responder.respond(); }}}});
  int raw = -1;
  at_peer([&] { raw = socket(AF_INET, SOCK_RAW | SOCK_CLOEXEC, IPPROTO_RAW); });
  ASSERT_NE(raw, -1);
  // However slow the machine is: hosts are given up after some seconds, and others take their places.
  std::uint8_t host = 100;
  ASSERT_TRUE(run_until([&] {
    send_as(raw, IpAddress::v4(10, 77, 0, host), port, request);
    host = host == 250 ? 100 : host + 1;
    return server->counters().answers_to_silent >= 10;
  }));
  close(raw);
  EXPECT_EQ(count(server_log, " answers over UDP, the last one to 10.77.0."), 1U) << "not one for each";
  EXPECT_THAT(server_log, Contains(HasSubstr("too many hosts have asked that are not there")));
}

// Subscribers that are not there come and go: no more is kept for them than for those of the moment.
TEST_F(LinkTest, IsNotWaitedForWhereASilentSubscriberHasGone) {
  const NodeConfig config = slow_to_expire(Namespaces::own);
  start_server(config);
  int raw = -1;
  at_peer([&] { raw = socket(AF_INET, SOCK_RAW | SOCK_CLOEXEC, IPPROTO_RAW); });
  ASSERT_NE(raw, -1);
  const auto say = [&](const std::string& session, const std::string& ttl) {
    send_as(
        raw, IpAddress::v4(10, 77, 0, 100), config.port,
        test::hex("ffff8100 00000030 0000" + session + " 01010200 c0000000 00000010 06000010 12340001 01" +
                  ttl + " 00000001 0000000c 000904000a4d006400119c40"));
  };
  say("0001", "000e10");
  ASSERT_TRUE(run_until([&] { return server->subscribers(offer, event) == 1; }));
  for (int i = 0; i < 3; ++i) {
    server->notify(offer, event, {});
  }
  EXPECT_EQ(server->sender_counters().refused, 0U) << "they wait";
  say("0002", "000000");
  ASSERT_TRUE(run_until([&] { return server->subscribers(offer, event) == 0; }));
  close(raw);
  EXPECT_THAT(server_log, Contains(HasSubstr("stopped, no longer subscribed")));
  EXPECT_EQ(server->sender_counters().refused, 3U);
}

using LinkWithoutNetlink = test::TwoNodes;

/// From now on this process cannot open sockets of netlink, as RestrictAddressFamilies= of systemd has it.
void forbid_netlink() {
  std::array<sock_filter, 6> rules{{
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_socket, 0, 3),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, args)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, AF_NETLINK, 0, 1),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EAFNOSUPPORT),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
  }};
  const sock_fprog program{.len = static_cast<unsigned short>(rules.size()), .filter = rules.data()};
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 ||
      prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) != 0) {
    std::_Exit(77);
  }
}

TEST_F(LinkWithoutNetlink, IsTakenToBeUpAndTheLogSaysSo) {
  const auto in_a_process_of_its_own = [&] {
    forbid_netlink();
    NodeConfig config = test::quick(test::server_address);
    config.multicast_interface = "lo";
    Node node{io, config, into(server_log)};
    static_cast<void>(node.offer({.service = ServiceId{0x1234}, .instance = someip::InstanceId{1}}));
    const bool offers = run_until([&] { return node.discovery_counters().datagrams_sent > 1; });
    const std::string wanted =
        "cannot watch the link: Address family not supported by protocol; it is taken to be up";
    std::_Exit(offers && std::count(server_log.begin(), server_log.end(), wanted) == 1 ? 0 : 1);
  };
  EXPECT_EXIT(in_a_process_of_its_own(), ::testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace trestle::sd::link_test
