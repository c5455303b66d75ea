// A sender, and a receiver of what it sends.
#pragma once
#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <vector>

#include "someip/net/message_sender.hpp"

namespace trestle::someip::message_sender_test {

using namespace std::chrono_literals;

inline const Header event{.service = ServiceId{0x1234},
                          .method = MethodId{0x8001},
                          .session = SessionId{7},
                          .interface_version = 1,
                          .type = MessageType::notification};

/// The second burst is not due while a test looks at the first one, however slow the machine is.
inline constexpr TpPacing slow{.separation = 200ms};

inline std::vector<std::byte> numbers(std::size_t bytes) {
  std::vector<std::byte> result(bytes);
  for (std::size_t i = 0; i < bytes; ++i) {
    result[i] = static_cast<std::byte>(i * 131 >> 3U);
  }
  return result;
}

class MessageSenderTest : public ::testing::Test {
 protected:
  MessageSenderTest() {
    receiver.receive([this](ByteView datagram, const Endpoint&) {
      const auto message = decode(datagram);
      ASSERT_TRUE(message);
      ASSERT_EQ(message->size(), datagram.size());
      arrived.emplace_back(datagram.begin(), datagram.end());
    });
  }
  void await_datagrams(std::size_t count) {
    const auto end = std::chrono::steady_clock::now() + 30s;
    while (arrived.size() < count && std::chrono::steady_clock::now() < end) {
      io.run_one_for(50ms);
    }
    ASSERT_EQ(arrived.size(), count);
  }
  // Puts the segments that arrived together and checks each one's headers on the way.
  std::vector<std::byte> joined(const Header& original) {
    std::vector<std::byte> payload;
    for (std::size_t i = 0; i < arrived.size(); ++i) {
      const auto message = decode(arrived[i]);
      Header expected = original;
      expected.type = with_tp(original.type);
      EXPECT_EQ(message->header, expected);
      const auto segment = decode_tp(*message);
      EXPECT_TRUE(segment);
      EXPECT_EQ(segment->header.offset, payload.size());
      EXPECT_EQ(segment->header.more, i + 1 < arrived.size());
      payload.insert(payload.end(), segment->slice.begin(), segment->slice.end());
    }
    return payload;
  }
  Message arrival(std::size_t i) { return *decode(arrived.at(i)); }
  // What arrived of one message.
  std::vector<std::byte> payload_of(SessionId session) {
    std::vector<std::byte> payload;
    for (const auto& datagram : arrived) {
      const auto message = decode(datagram);
      if (message->header.session == session) {
        const auto segment = decode_tp(*message);
        EXPECT_TRUE(segment);
        EXPECT_EQ(segment->header.offset, payload.size());
        payload.insert(payload.end(), segment->slice.begin(), segment->slice.end());
      }
    }
    return payload;
  }

  boost::asio::io_context io;
  UdpSocket socket{io, {.local = {IpAddress::v4(127, 0, 0, 1), 0}}};
  UdpSocket receiver{io, {.local = {IpAddress::v4(127, 0, 0, 2), 0}}};
  MessageSender sender{io, socket, 1 << 20};
  std::vector<std::vector<std::byte>> arrived;
};

}  // namespace trestle::someip::message_sender_test
