#include "dds_adapter/sample_sockets.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string>

namespace trestle::dds::detail::sample_sockets_test {
namespace {

using ::testing::ElementsAre;
using ::testing::SizeIs;

// Of loopback, that only this process uses: others run the same tests beside it.
std::string own(int host) {
  const auto pid = static_cast<unsigned>(getpid());
  return "127." + std::to_string(1 + (pid >> 8U) % 254) + "." + std::to_string(pid & 255U) + "." +
         std::to_string(host);
}

// Sends from a port of its own.
class Sender {
 public:
  Sender() : descriptor_{socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)} {}
  ~Sender() { close(descriptor_); }
  Sender(const Sender&) = delete;
  Sender& operator=(const Sender&) = delete;

  void send(const std::string& text, const std::string& address, std::uint16_t port) const {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    inet_pton(AF_INET, address.c_str(), &to.sin_addr);
    EXPECT_EQ(
        sendto(descriptor_, text.data(), text.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to),
        static_cast<ssize_t>(text.size()));
  }

 private:
  int descriptor_;
};

class SampleSocketsTest : public testing::Test {
 protected:
  // The first port that is free at these addresses.
  std::uint16_t open(SampleSockets& sockets, const std::vector<std::string>& addresses) {
    for (std::uint16_t port = 20'000; port < 30'000; ++port) {
      if (sockets.open(port, addresses, 0, [this](std::span<const std::byte> datagram, const sockaddr_in&) {
            const auto* text = reinterpret_cast<const char*>(datagram.data());
            taken.emplace_back(text, datagram.size());
          })) {
        return port;
      }
    }
    ADD_FAILURE() << "no port is free";
    return 0;
  }

  std::vector<std::string> taken;
};

TEST_F(SampleSocketsTest, TakeWhatComesToAnyAddressWhereNoneIsNamed) {
  SampleSockets sockets;
  const std::uint16_t port = open(sockets, {});
  const Sender sender;
  sender.send("one", own(1), port);
  sender.send("two", own(2), port);
  sockets.receive();
  EXPECT_THAT(taken, ElementsAre("one", "two"));
}

TEST_F(SampleSocketsTest, TakeWhatComesToTheirAddressesOnly) {
  SampleSockets sockets;
  const std::uint16_t port = open(sockets, {own(1), own(2)});
  const Sender sender;
  sender.send("three", own(3), port);
  sender.send("two", own(2), port);
  sender.send("one", own(1), port);
  sockets.receive();
  EXPECT_THAT(taken, testing::UnorderedElementsAre("one", "two"));
}

TEST_F(SampleSocketsTest, TakeOfEachAddressThoughAnotherIsFlooded) {
  SampleSockets sockets;
  const std::uint16_t port = open(sockets, {own(1), own(2)});
  const Sender sender;
  for (int i = 0; i < 100; ++i) {
    sender.send("flood", own(1), port);
  }
  sender.send("one", own(2), port);
  sockets.receive();
  EXPECT_LT(taken.size(), 100U) << "not all at once";
  EXPECT_EQ(taken.back(), "one");
  for (int i = 0; i < 10; ++i) {
    sockets.receive();
  }
  EXPECT_THAT(taken, SizeIs(101)) << "nothing is left";
}

TEST_F(SampleSocketsTest, OpenAllOrNone) {
  SampleSockets first;
  SampleSockets second;
  const std::uint16_t port = open(first, {own(2)});
  const auto ignore = [](std::span<const std::byte>, const sockaddr_in&) {};
  EXPECT_FALSE(second.open(port, {own(1), own(2)}, 0, ignore));
  EXPECT_FALSE(second.is_open(port));
  EXPECT_TRUE(first.open(port, {own(1)}, 0, ignore)) << "it has been closed again";
}

TEST_F(SampleSocketsTest, TakeNothingOfAPortThatIsClosed) {
  SampleSockets sockets;
  const std::uint16_t port = open(sockets, {own(1)});
  EXPECT_TRUE(sockets.is_open(port));
  Sender{}.send("one", own(1), port);
  EXPECT_TRUE(sockets.close(port));
  EXPECT_FALSE(sockets.is_open(port));
  EXPECT_FALSE(sockets.close(port));
  sockets.receive();
  EXPECT_THAT(taken, SizeIs(0));
}

}  // namespace
}  // namespace trestle::dds::detail::sample_sockets_test
