#pragma once
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstring>
#include <filesystem>
#include <string>
#include <thread>
#include <utility>

#include "bridge/conform/stimulus.hpp"

namespace trestle::conform::small_device {

/// Of this process alone, on loopback.
inline IpAddress host(std::uint8_t last) {
  const auto process = static_cast<unsigned>(getpid());
  return IpAddress::v4(127, static_cast<std::uint8_t>(1 + (process >> 8U) % 254),
                       static_cast<std::uint8_t>(process), last);
}

/// As host(): the tests that run beside this one have other groups.
inline const IpAddress group_of_test = IpAddress::v4(239, 251, host(1).bytes[1], host(1).bytes[2]);

/// A device of one message, such as an offer: as much as it takes to be there.
class SmallDevice {
 public:
  enum class Way : std::uint8_t {
    answers,   ///< to everything
    repeats,   ///< answers, and sends it again and again to the client that asked last
    to_group,  ///< answers nothing, but repeats it to everybody
    answers_to_group,
    answers_each_third,
  };
  static constexpr std::uint16_t port = 30490;
  static constexpr someip::ServiceId service{1};

  static Bytes offer(someip::InstanceId instance = {}) {
    return SdStimulus{.entries = {{.type = sd::EntryType::offer_service,
                                   .service = service,
                                   .instance = instance,
                                   .ttl_s = 3}}}
        .encode(someip::SessionId{1}, true);
  }
  explicit SmallDevice(Bytes message = offer(), Way way = Way::repeats)
      : message_{std::move(message)}, way_{way}, fd_{::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)} {
    const sockaddr_in address = address_of(host(1));
    EXPECT_EQ(::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    const timeval wait{.tv_sec = 0, .tv_usec = 20'000};
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof wait);
    ::setsockopt(fd_, IPPROTO_IP, IP_MULTICAST_IF, &address.sin_addr, sizeof address.sin_addr);
    thread_ = std::thread{[this] { serve(); }};
  }
  ~SmallDevice() {
    ended_ = true;
    thread_.join();
    ::close(fd_);
  }
  SmallDevice(const SmallDevice&) = delete;
  SmallDevice& operator=(const SmallDevice&) = delete;

  /// Does nothing any more, until this file is there.
  void die(std::string until) {
    file_ = std::move(until);
    dead_ = true;
  }

 private:
  static sockaddr_in address_of(const IpAddress& own) {
    sockaddr_in address{.sin_family = AF_INET, .sin_port = htons(port), .sin_addr = {}, .sin_zero = {}};
    std::memcpy(&address.sin_addr, own.bytes.data(), 4);
    return address;
  }
  void send(const sockaddr_in& to) const {
    ::sendto(fd_, message_.data(), message_.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  }
  void serve() {
    sockaddr_in last{};
    while (!ended_) {
      std::array<std::byte, 1500> room{};
      sockaddr_in from{};
      socklen_t size = sizeof from;
      const bool asked =
          ::recvfrom(fd_, room.data(), room.size(), 0, reinterpret_cast<sockaddr*>(&from), &size) > 0;
      if (dead_) {
        if (!std::filesystem::exists(file_)) {
          continue;
        }
        dead_ = false;
      }
      last = asked ? from : last;
      number_ += asked ? 1 : 0;
      if (way_ == Way::to_group || (way_ == Way::answers_to_group && asked)) {
        send(address_of(group_of_test));
      } else if ((asked && (way_ == Way::answers || (way_ == Way::answers_each_third && number_ % 3 == 0))) ||
                 (way_ == Way::repeats && last.sin_port != 0)) {
        send(last);
      }
    }
  }

  Bytes message_;
  Way way_;
  int fd_;
  std::string file_;
  int number_ = 0;  ///< of the message that came last
  std::atomic<bool> dead_ = false;
  std::atomic<bool> ended_ = false;
  std::thread thread_;
};

}  // namespace trestle::conform::small_device
