// That what the configuration says of sockets arrives at those of the running bridge.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <filesystem>

#include "someip/net/address_text.hpp"
#include "someip/net/udp_socket.hpp"
#include "test/bridge/end_to_end/two_bridges.hpp"
#include "test/loopback.hpp"

namespace trestle::test::socket_settings_test {
namespace {

int option(int fd, int name) {
  int value = 0;
  socklen_t size = sizeof value;
  return getsockopt(fd, SOL_SOCKET, name, &value, &size) == 0 ? value : -1;
}

bool is_udp_at(int fd, const std::string& address) {
  sockaddr_in bound{};
  socklen_t size = sizeof bound;
  std::array<char, INET_ADDRSTRLEN> text{};
  return option(fd, SO_TYPE) == SOCK_DGRAM &&
         getsockname(fd, reinterpret_cast<sockaddr*>(&bound), &size) == 0 && bound.sin_family == AF_INET &&
         inet_ntop(AF_INET, &bound.sin_addr, text.data(), text.size()) != nullptr && address == text.data();
}

/// Of all UDP sockets of this process that are bound to the address.
std::vector<int> options_at(const std::string& address, int name) {
  std::vector<int> values;
  for (const auto& entry : std::filesystem::directory_iterator{"/proc/self/fd"}) {
    const int fd = std::stoi(entry.path().filename());
    if (is_udp_at(fd, address)) {
      values.push_back(option(fd, name));
    }
  }
  return values;
}

class SocketSettings : public TwoBridges {
 protected:
  /// A bridge with this in its section `someip`.
  void run(const std::string& settings, const TestRoute& route) {
    std::string description = yaml(true, {route}, "");
    description.insert(description.find("sd: {"), settings);
    a_ = std::make_unique<RunningBridge>(description);
  }
  [[nodiscard]] static std::string address() { return someip::to_string(own_address(1)); }
  /// What any socket is granted that asks for as much.
  [[nodiscard]] someip::UdpSocket granted(int bytes) {
    return someip::UdpSocket{io_,
                             {.local = {own_address(9), 0},
                              .receive_buffer_bytes = bytes,
                              .send_buffer_bytes = bytes,
                              .busy_poll = std::chrono::microseconds{50}}};
  }
  boost::asio::io_context io_;
  // The system's figures count its own needs too.
  static constexpr int charged = 2;
};

TEST_F(SocketSettings, ArriveAtEachSocket) {
  run("receive_buffer: 100 KiB\n  send_buffer: 50 KiB\n  busy_poll: 50 us\n  ",
      {"/text", "std_msgs/msg/String"});
  const someip::UdpSocket probe = granted(100 << 10);
  EXPECT_THAT(options_at(address(), SO_RCVBUF),
              testing::AllOf(testing::SizeIs(2), testing::Each(charged * (100 << 10))));
  EXPECT_THAT(options_at(address(), SO_SNDBUF), testing::Each(charged * (50 << 10)));
  EXPECT_THAT(options_at(address(), SO_BUSY_POLL),
              testing::Each(static_cast<int>(probe.busy_poll().count())));
}

TEST_F(SocketSettings, FollowTheLargestMessageOfEachDirection) {
  constexpr int large = 12 << 20;
  run("", {"/text", "std_msgs/msg/String", false, "    tp: {max_message: 12 MiB}\n"});
  EXPECT_THAT(options_at(address(), SO_RCVBUF),
              testing::Each(charged * granted(large).receive_buffer_bytes()));
  EXPECT_THAT(options_at(address(), SO_SNDBUF),
              testing::Each(charged * granted(4 << 20).send_buffer_bytes()));
}

}  // namespace
}  // namespace trestle::test::socket_settings_test
