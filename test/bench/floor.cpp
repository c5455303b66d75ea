#include "test/bench/floor.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string_view>

namespace trestle::floor {

std::int64_t check(std::int64_t result, const char* what) {
  if (result < 0) {
    std::fprintf(stderr, "trestle_floor: %s: %s\n", what, std::strerror(errno));
    std::_Exit(1);
  }
  return result;
}

std::int64_t now_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * 1'000'000'000 + now.tv_nsec;
}

Socket::Socket(int type) : fd_{static_cast<int>(check(socket(AF_INET, type | SOCK_CLOEXEC, 0), "socket"))} {}
Socket::~Socket() {
  close(fd_);
}

void Socket::option(int level, int name, int value) const {
  check(setsockopt(fd_, level, name, &value, sizeof value), "setsockopt");
}

// The sockets interface of POSIX is made of these casts.
void Socket::bind(const sockaddr_in& address) const {
  check(::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), "bind");
}
void Socket::connect(const sockaddr_in& address) const {
  check(::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), "connect");
}

void Socket::large_buffers() const {
  constexpr int receive_bytes = 8 << 20;
  constexpr int send_bytes = 4 << 20;
  if (setsockopt(fd_, SOL_SOCKET, SO_RCVBUFFORCE, &receive_bytes, sizeof receive_bytes) != 0) {
    option(SOL_SOCKET, SO_RCVBUF, receive_bytes);
  }
  if (setsockopt(fd_, SOL_SOCKET, SO_SNDBUFFORCE, &send_bytes, sizeof send_bytes) != 0) {
    option(SOL_SOCKET, SO_SNDBUF, send_bytes);
  }
}

void Socket::receive_timeout(int milliseconds) const {
  const timeval limit{milliseconds / 1000, milliseconds % 1000 * 1000};
  check(setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit), "setsockopt");
}

void Figures::print() const {
  const auto rate = seconds > 0 ? static_cast<double>(received) / seconds : 0;
  std::printf(R"({"payload_bytes":%zu,"seconds":%.3f,"received":%zu,"lost":%zu,"per_second":%.1f,)"
              R"("megabytes_per_second":%.3f,"latency_ns":{"count":%zu,"p50":%lld,"p99":%lld,"max":%lld}})"
              "\n",
              static_cast<std::size_t>(bytes), seconds, static_cast<std::size_t>(received),
              static_cast<std::size_t>(lost), rate, rate * static_cast<double>(bytes) / 1e6,
              static_cast<std::size_t>(latency.count()), static_cast<long long>(latency.percentile(50)),
              static_cast<long long>(latency.percentile(99)), static_cast<long long>(latency.max()));
}

}  // namespace trestle::floor

namespace {

using trestle::floor::Options;

struct Role {
  std::string_view name;
  void (*run)(const Options&);
};
constexpr std::array<Role, 10> roles{{{"serve-udp", trestle::floor::serve_udp},
                                      {"ping-udp", trestle::floor::ping_udp},
                                      {"serve-tcp", trestle::floor::serve_tcp},
                                      {"ping-tcp", trestle::floor::ping_tcp},
                                      {"serve-flood", trestle::floor::serve_flood},
                                      {"receive-flood", trestle::floor::receive_flood},
                                      {"serve-tp", trestle::floor::serve_tp},
                                      {"receive-tp", trestle::floor::receive_tp},
                                      {"reflect-dds", trestle::floor::reflect_dds},
                                      {"ping-dds", trestle::floor::ping_dds}}};

int usage() {
  std::fputs(
      "Usage: trestle_floor ROLE [at=ADDRESS:PORT] [bytes=N] [window=N] [seconds=S] [segmentation=0]\n"
      "                     [domain=N] [shared_memory=1]\nRoles:",
      stderr);
  for (const Role& role : roles) {
    std::fprintf(stderr, " %s", role.name.data());
  }
  std::fputs("\n", stderr);
  return 2;
}

bool set(Options& options, std::string_view name, const std::string& value) {
  if (name == "at") {
    const auto colon = value.find(':');
    options.at.sin_family = AF_INET;
    options.at.sin_port = htons(static_cast<std::uint16_t>(std::atoi(value.c_str() + colon + 1)));
    return colon != std::string::npos &&
           inet_pton(AF_INET, value.substr(0, colon).c_str(), &options.at.sin_addr) == 1;
  }
  if (name == "bytes") {
    options.bytes = std::strtoul(value.c_str(), nullptr, 10);
  } else if (name == "window") {
    options.window = std::strtoul(value.c_str(), nullptr, 10);
  } else if (name == "seconds") {
    options.seconds = std::strtod(value.c_str(), nullptr);
  } else if (name == "segmentation") {
    options.segmentation = value != "0";
  } else if (name == "domain") {
    options.domain = static_cast<std::uint32_t>(std::strtoul(value.c_str(), nullptr, 10));
  } else if (name == "shared_memory") {
    options.shared_memory = value != "0";
  } else {
    return false;
  }
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  for (int i = 2; i < argc; ++i) {
    const std::string_view argument{argv[i]};
    const auto equals = argument.find('=');
    if (equals == std::string_view::npos ||
        !set(options, argument.substr(0, equals), std::string{argument.substr(equals + 1)})) {
      return usage();
    }
  }
  for (const Role& role : roles) {
    if (argc > 1 && role.name == argv[1]) {
      role.run(options);
      return 0;
    }
  }
  return usage();
}
