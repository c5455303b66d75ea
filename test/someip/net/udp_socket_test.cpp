#include "someip/net/udp_socket.hpp"

#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <boost/asio/io_context.hpp>
#include <string>
#include <vector>

#include "someip/net/address_text.hpp"
#include "someip/net/addresses.hpp"
#include "someip/net/socket_calls.hpp"

namespace trestle::someip::udp_socket_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using namespace std::chrono_literals;

const IpAddress first = IpAddress::v4(127, 0, 0, 1);
const IpAddress second = IpAddress::v4(127, 0, 0, 2);
const IpAddress group = IpAddress::v4(224, 244, 224, 7);

ByteView bytes_of(std::string_view text) {
  return std::as_bytes(std::span{text});
}
std::string text_of(ByteView bytes) {
  std::string text(bytes.size(), '\0');
  std::transform(bytes.begin(), bytes.end(), text.begin(), [](std::byte b) { return static_cast<char>(b); });
  return text;
}

// Collects what arrives at a socket.
struct Inbox {
  std::vector<std::string> texts;
  std::vector<Endpoint> senders;
  UdpSocket::Handler handler() {
    return [this](ByteView datagram, const Endpoint& from) {
      texts.push_back(text_of(datagram));
      senders.push_back(from);
    };
  }
};

class UdpSocketTest : public ::testing::Test {
 protected:
  // Runs until `count` datagrams have come.
  void await(const Inbox& inbox, std::size_t count) {
    const auto end = std::chrono::steady_clock::now() + 60s;
    while (inbox.texts.size() < count && std::chrono::steady_clock::now() < end) {
      io.run_one_for(50ms);
    }
  }
  boost::asio::io_context io;
};

SendStatus send(UdpSocket& socket, const Endpoint& to, std::string_view text) {
  const ByteView slice = bytes_of(text);
  return socket.send(to, {&slice, 1});
}

TEST_F(UdpSocketTest, CarriesDatagramsWithTheirSender) {
  UdpSocket a{io, {.local = {first, 0}}};
  UdpSocket b{io, {.local = {second, 0}}};
  Inbox inbox;
  b.receive(inbox.handler());
  const std::array<ByteView, 3> slices{bytes_of("one"), bytes_of(""), bytes_of(" two")};
  EXPECT_EQ(a.send(b.local(), slices), SendStatus::sent);
  EXPECT_EQ(send(a, b.local(), ""), SendStatus::sent);
  await(inbox, 2);
  EXPECT_THAT(inbox.texts, ElementsAre("one two", ""));
  EXPECT_THAT(inbox.senders, ElementsAre(a.local(), a.local()));
}

TEST_F(UdpSocketTest, CarriesDatagramsOverIpv6) {
  IpAddress loopback{.v6 = true};
  loopback.bytes[15] = 1;
  UdpSocket a{io, {.local = {loopback, 0}}};
  UdpSocket b{io, {.local = {loopback, 0}}};
  Inbox inbox;
  b.receive(inbox.handler());
  EXPECT_EQ(send(a, b.local(), "six"), SendStatus::sent);
  await(inbox, 1);
  EXPECT_THAT(inbox.texts, ElementsAre("six"));
  EXPECT_THAT(inbox.senders, ElementsAre(a.local()));
}

TEST_F(UdpSocketTest, ReceivesMulticastOnLoopbackWhateverTheAddress) {
  UdpSocket probe{io, {.local = {first, 0}}};  // its port is free for the group too
  const Endpoint to{group, probe.local().port};
  UdpSocket member_a{
      io,
      {.local = to, .join = group, .interface = MulticastInterface{first}, .sharing = PortSharing::shared}};
  UdpSocket member_b{
      io,
      {.local = to, .join = group, .interface = MulticastInterface{second}, .sharing = PortSharing::shared}};
  UdpSocket sender{io, {.local = {second, 0}, .interface = MulticastInterface{second}}};
  Inbox a;
  Inbox b;
  member_a.receive(a.handler());
  member_b.receive(b.handler());
  EXPECT_EQ(send(sender, to, "to all"), SendStatus::sent);
  await(a, 1);
  await(b, 1);
  EXPECT_THAT(a.texts, ElementsAre("to all"));
  EXPECT_THAT(b.texts, ElementsAre("to all"));
  EXPECT_THAT(a.senders, ElementsAre(sender.local()));
}

TEST_F(UdpSocketTest, TakesTheInterfaceForMulticastByName) {
  UdpSocket probe{io, {.local = {first, 0}}};
  const Endpoint to{group, probe.local().port};
  const MulticastInterface lo{.own = first, .name = "lo"};
  UdpSocket member{io, {.local = to, .join = group, .interface = lo, .sharing = PortSharing::shared}};
  UdpSocket sender{io, {.local = {second, 0}, .interface = lo}};
  Inbox inbox;
  member.receive(inbox.handler());
  send(sender, to, "by name");
  await(inbox, 1);
  EXPECT_THAT(inbox.texts, ElementsAre("by name"));
  const MulticastInterface missing{.own = first, .name = "eth77"};
  try {
    UdpSocket nowhere{io, {.local = {second, 0}, .interface = missing}};
    FAIL() << "there is no such interface";
  } catch (const NetError& error) {
    EXPECT_THAT(error.what(), HasSubstr("'eth77'"));
  }
}

TEST_F(UdpSocketTest, DeliversUnicastNotToTheGroupSocket) {
  UdpSocket unicast{io, {.local = {first, 0}}};
  const std::uint16_t port = unicast.local().port;
  UdpSocket member{io,
                   {.local = {group, port},
                    .join = group,
                    .interface = MulticastInterface{first},
                    .sharing = PortSharing::shared}};
  UdpSocket sender{io, {.local = {second, 0}, .interface = MulticastInterface{second}}};
  Inbox from_unicast;
  Inbox from_group;
  unicast.receive(from_unicast.handler());
  member.receive(from_group.handler());
  send(sender, {first, port}, "for one");
  send(sender, {group, port}, "for all");
  await(from_unicast, 1);
  await(from_group, 1);
  EXPECT_THAT(from_unicast.texts, ElementsAre("for one"));
  EXPECT_THAT(from_group.texts, ElementsAre("for all"));
}

TEST_F(UdpSocketTest, SendsFromTheGroupSocketAsFromTheAddressOfItsOwner) {
  UdpSocket receiver{io, {.local = {first, 0}}};
  const std::uint16_t port = receiver.local().port;
  UdpSocket member{io,
                   {.local = {group, port},
                    .join = group,
                    .interface = MulticastInterface{second},
                    .source = second,
                    .sharing = PortSharing::shared}};
  Inbox from_unicast;
  Inbox from_group;
  receiver.receive(from_unicast.handler());
  member.receive(from_group.handler());
  EXPECT_EQ(send(member, {first, port}, "for one"), SendStatus::sent);
  EXPECT_EQ(send(member, {group, port}, "for all"), SendStatus::sent);
  await(from_unicast, 1);
  await(from_group, 1);
  EXPECT_THAT(from_unicast.senders, ElementsAre(Endpoint{second, port}));
  EXPECT_THAT(from_group.senders, ElementsAre(Endpoint{second, port}));
}

TEST_F(UdpSocketTest, NamesAddressPortAndRemedyWhenThePortIsTaken) {
  UdpSocket owner{io, {.local = {first, 0}}};
  const std::string port = std::to_string(owner.local().port);
  try {
    UdpSocket late{io, {.local = owner.local()}};
    FAIL() << "opened a port that is taken";
  } catch (const NetError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("127.0.0.1:" + port), HasSubstr("ss -ulpn 'sport = :" + port),
                                    HasSubstr("127.0.0.2")));
  }
}

TEST_F(UdpSocketTest, SharesAPortByAddressWithASocketThatHasItOnAllAddresses) {
  // As another stack's SD does for multicast.
  UdpSocket everywhere{io, {.local = {{}, 0}, .sharing = PortSharing::shared}};
  const Endpoint own{second, everywhere.local().port};
  UdpSocket socket{io, {.local = own, .sharing = PortSharing::by_address}};
  UdpSocket sender{io, {.local = {first, 0}}};
  Inbox inbox;
  socket.receive(inbox.handler());
  send(sender, own, "mine");
  await(inbox, 1);
  EXPECT_THAT(inbox.texts, ElementsAre("mine"));
  EXPECT_THROW((UdpSocket{io, {.local = own, .sharing = PortSharing::by_address}}), NetError);
  EXPECT_NO_THROW((UdpSocket{io, {.local = {first, own.port}, .sharing = PortSharing::by_address}}));
}

// A socket of another stack, that shares the group's port by one socket option.
Descriptor foreign_member(const Endpoint& at, int option) {
  Descriptor socket{::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK, 0)};
  EXPECT_EQ(option == 0 ? 0 : set_option(socket.get(), SOL_SOCKET, option, 1), 0);
  SocketAddress address{at};
  EXPECT_EQ(bind(socket.get(), address.data(), address.size()), 0) << std::strerror(errno);
  ip_mreqn request{};
  std::memcpy(&request.imr_multiaddr, at.address.bytes.data(), sizeof request.imr_multiaddr);
  request.imr_ifindex = static_cast<int>(interface_of(first));
  EXPECT_EQ(setsockopt(socket.get(), IPPROTO_IP, IP_ADD_MEMBERSHIP, &request, sizeof request), 0);
  return socket;
}

TEST_F(UdpSocketTest, SharesAGroupWithOtherStacksWhoeverIsFirst) {
  // vsomeip and most others set SO_REUSEADDR; pysomeip sets SO_REUSEPORT alone.
  std::uint16_t port = 31321;
  for (const int option : {SO_REUSEADDR, SO_REUSEPORT}) {
    for (const bool they_are_first : {true, false}) {
      const Endpoint at{group, ++port};
      std::optional<Descriptor> theirs;
      if (they_are_first) {
        theirs.emplace(foreign_member(at, option));
      }
      UdpSocket ours{io,
                     {.local = at,
                      .join = group,
                      .interface = MulticastInterface{first},
                      .sharing = PortSharing::shared}};
      if (!theirs) {
        theirs.emplace(foreign_member(at, option));
      }
      UdpSocket sender{io, {.local = {first, 0}, .interface = MulticastInterface{first}}};
      Inbox inbox;
      ours.receive(inbox.handler());
      for (const char* text : {"one", "two", "three", "four"}) {  // each reaches both
        send(sender, at, text);
      }
      await(inbox, 4);
      EXPECT_THAT(inbox.texts, ElementsAre("one", "two", "three", "four"));
      std::array<char, 8> byte{};
      for (int i = 0; i < 4; ++i) {
        EXPECT_GT(recv(theirs->get(), byte.data(), byte.size(), 0), 0);
      }
    }
  }
}

TEST_F(UdpSocketTest, SaysWhetherTheAddressOrTheGroupIsTaken) {
  const auto words_of = [&](const UdpOptions& options) -> std::string {
    try {
      UdpSocket late{io, options};
    } catch (const NetError& error) {
      return error.what();
    }
    return "opened";
  };
  const Endpoint at{group, 31331};
  const Descriptor theirs = foreign_member(at, 0);  // that shares it with nobody
  const std::string of_group = words_of(
      {.local = at, .join = group, .interface = MulticastInterface{first}, .sharing = PortSharing::shared});
  EXPECT_THAT(of_group, AllOf(HasSubstr("UDP 224.244.224.7:31331"), HasSubstr("multicast group"),
                              HasSubstr("ss -ulpn 'sport = :31331'"), HasSubstr("SO_REUSEADDR"),
                              Not(HasSubstr("127.0.0.2"))));
  UdpSocket owner{io, {.local = {first, 0}, .sharing = PortSharing::by_address}};
  EXPECT_THAT(words_of({.local = owner.local(), .sharing = PortSharing::by_address}),
              AllOf(HasSubstr("port of this address"), HasSubstr("127.0.0.2"), Not(HasSubstr("group"))));
}

TEST_F(UdpSocketTest, SeesThatAnIpv6AddressIsTaken) {
  const Endpoint any_port{*parse_address("::1"), 0};
  UdpSocket owner{io, {.local = any_port, .sharing = PortSharing::by_address}};
  EXPECT_THROW((UdpSocket{io, {.local = owner.local(), .sharing = PortSharing::by_address}}), NetError);
}

TEST_F(UdpSocketTest, NamesAnAddressThatIsNotOnThisHost) {
  try {
    UdpSocket stranger{io, {.local = {IpAddress::v4(192, 0, 2, 1), 30490}}};
    FAIL() << "bound a foreign address";
  } catch (const NetError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("192.0.2.1:30490"), HasSubstr("no interface of this host")));
  }
}

// 64 KB of numbered segments, each of a header and a body; the last one is shorter.
struct Train {
  explicit Train(std::size_t count) : headers(count) {
    for (std::size_t i = 0; i < count; ++i) {
      headers[i] = "segment" + std::to_string(100 + i) + ":";
      slices.push_back(bytes_of(headers[i]));
      slices.push_back(bytes_of(body).first(i + 1 == count ? 5 : body.size()));
      expected.push_back(headers[i] + text_of(slices.back()));
    }
    counts.assign(count, 2);
  }
  std::string body = std::string(989, 'x');
  std::vector<std::string> headers;
  std::vector<ByteView> slices;
  std::vector<std::uint8_t> counts;
  std::vector<std::string> expected;
};

TEST_F(UdpSocketTest, SendsATrainOfSegmentsAsSeparateDatagrams) {
  UdpSocket a{io, {.local = {first, 0}}};
  UdpSocket b{io, {.local = {second, 0}}};
  Inbox inbox;
  b.receive(inbox.handler());
  const Train train{60};
  const auto batch = a.send_segments(b.local(), train.slices, train.counts, 1000);
  EXPECT_EQ(batch.sent, 60U);
  EXPECT_EQ(batch.status, SendStatus::sent);
  await(inbox, 60);
  EXPECT_EQ(inbox.texts, train.expected);
}

TEST_F(UdpSocketTest, FallsBackToSingleDatagramsWhenTheyCannotBeOffloaded) {
  UdpSocket a{io, {.local = {first, 0}}};
  UdpSocket b{io, {.local = {second, 0}}};
  Inbox inbox;
  b.receive(inbox.handler());
  // Together more than one offloaded train may hold, so the kernel refuses it: each then goes alone.
  const std::string large(3000, 'y');
  std::vector<ByteView> slices(40, bytes_of(large));
  const std::vector<std::uint8_t> counts(40, 1);
  const auto batch = a.send_segments(b.local(), slices, counts, large.size());
  EXPECT_EQ(batch.sent, 40U);
  await(inbox, 40);
  EXPECT_EQ(inbox.texts, std::vector<std::string>(40, large));
}

TEST_F(UdpSocketTest, CanBeDestroyedByItsOwnHandler) {
  UdpSocket sender{io, {.local = {first, 0}}};
  auto receiver = std::make_unique<UdpSocket>(io, UdpOptions{.local = {second, 0}});
  const Endpoint to = receiver->local();
  int calls = 0;
  receiver->receive([&](ByteView, const Endpoint&) {
    ++calls;
    receiver.reset();
  });
  send(sender, to, "last");
  send(sender, to, "too late");
  while (io.run_one_for(100ms) > 0) {
  }
  EXPECT_EQ(calls, 1);
}

TEST_F(UdpSocketTest, CountsWhatAFullReceiveBufferLoses) {
  UdpSocket sender{io, {.local = {first, 0}}};
  UdpSocket receiver{io, {.local = {second, 0}, .receive_buffer_bytes = 16 << 10}};
  const std::string text(1000, 'x');
  for (int i = 0; i < 100; ++i) {  // nobody reads meanwhile
    ASSERT_EQ(send(sender, receiver.local(), text), SendStatus::sent);
  }
  Inbox inbox;
  receiver.receive(inbox.handler());
  while (io.run_one_for(50ms) > 0) {
  }
  const std::size_t kept = inbox.texts.size();
  ASSERT_LT(kept, 100U);
  send(sender, receiver.local(), text);  // brings the news
  await(inbox, kept + 1);
  EXPECT_EQ(receiver.receive_overflows(), 100 - kept);
}

TEST_F(UdpSocketTest, TellsWhatReceiveBufferTheSystemGranted) {
  UdpSocket socket{io, {.local = {first, 0}, .receive_buffer_bytes = 64 << 10}};
  EXPECT_EQ(socket.receive_buffer_bytes(), 64 << 10);
}

TEST(AddressText, ReadsAndWritesBothFamilies) {
  for (const char* const text : {"127.0.0.1", "224.244.224.245", "::1", "fe80::1234:0:5"}) {
    const auto address = parse_address(text);
    ASSERT_TRUE(address) << text;
    EXPECT_EQ(to_string(*address), text);
  }
  EXPECT_EQ(to_string(Endpoint{first, 30490}), "127.0.0.1:30490");
  EXPECT_EQ(to_string(Endpoint{*parse_address("::1"), 5}), "[::1]:5");
  for (const char* const text : {"", "127.0.0", "127.0.0.256", "localhost", "::g"}) {
    EXPECT_FALSE(parse_address(text)) << text;
  }
}

}  // namespace
}  // namespace trestle::someip::udp_socket_test
