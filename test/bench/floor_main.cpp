#include <arpa/inet.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "test/bench/floor.hpp"

namespace {

using trestle::floor::Options;

struct Role {
  std::string_view name;
  void (*run)(const Options&);
};
constexpr std::array<Role, 12> roles{{{"serve-udp", trestle::floor::serve_udp},
                                      {"ping-udp", trestle::floor::ping_udp},
                                      {"serve-tcp", trestle::floor::serve_tcp},
                                      {"ping-tcp", trestle::floor::ping_tcp},
                                      {"serve-flood", trestle::floor::serve_flood},
                                      {"receive-flood", trestle::floor::receive_flood},
                                      {"serve-tp", trestle::floor::serve_tp},
                                      {"receive-tp", trestle::floor::receive_tp},
                                      {"receive-silent", trestle::floor::receive_silent},
                                      {"reflect-dds", trestle::floor::reflect_dds},
                                      {"ping-dds", trestle::floor::ping_dds},
                                      {"publish-dds", trestle::floor::publish_dds}}};

/// ADDRESS, or ADDRESS:PORT.
bool read_address(sockaddr_in& address, const std::string& text) {
  const auto colon = text.find(':');
  address.sin_family = AF_INET;
  address.sin_port =
      htons(static_cast<std::uint16_t>(colon == std::string::npos ? 0 : std::atoi(text.c_str() + colon + 1)));
  return inet_pton(AF_INET, text.substr(0, colon).c_str(), &address.sin_addr) == 1;
}

int usage() {
  std::fputs(
      "Usage: trestle_floor ROLE [at=ADDRESS:PORT] [bytes=N] [window=N] [seconds=S] [segmentation=0]\n"
      "                     [domain=N] [shared_memory=1] [synchronous=1] [busy=1] [batches=0]\n"
      "                     [own=ADDRESS] [messages=N] [reads=MB_PER_SECOND] [vsomeip=1] [rate=HZ]\nRoles:",
      stderr);
  for (const Role& role : roles) {
    std::fprintf(stderr, " %s", role.name.data());
  }
  std::fputs("\n", stderr);
  return 2;
}

bool set(Options& options, std::string_view name, const std::string& value) {
  if (name == "at") {
    return value.find(':') != std::string::npos && read_address(options.at, value);
  }
  if (name == "own") {
    return read_address(options.own, value);
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
  } else if (name == "synchronous") {
    options.synchronous = value != "0";
  } else if (name == "busy") {
    options.busy = value != "0";
  } else if (name == "batches") {
    options.batches = value != "0";
  } else if (name == "messages") {
    options.messages = std::strtoul(value.c_str(), nullptr, 10);
  } else if (name == "reads") {
    options.reads = std::strtod(value.c_str(), nullptr);
  } else if (name == "vsomeip") {
    options.vsomeip = value != "0";
  } else if (name == "rate") {
    options.rate = std::strtod(value.c_str(), nullptr);
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
