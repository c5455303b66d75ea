// Rates, losses and latencies of what goes by.
#include "bridge/inspect/tools/traffic_view.hpp"

#include <gtest/gtest.h>

#include "test/bytes.hpp"

namespace trestle::inspect::traffic_view_test {
namespace {

using namespace std::chrono_literals;
using namespace trestle::test;
using someip::MessageType;

const TimePoint start = TimePoint{} + 1h;
const Endpoint server{IpAddress::v4(10, 0, 0, 1), 30509};
const Endpoint client{IpAddress::v4(10, 0, 0, 2), 40000};
const Endpoint other_client{IpAddress::v4(10, 0, 0, 3), 40000};

class TrafficViewTest : public testing::Test {
 protected:
  /// A message of service 0x1111 with 84 bytes of payload, so 100 bytes in all.
  void pass(MessageType type, std::uint16_t method, std::uint16_t session, TimePoint now,
            const traffic::Flow& flow, someip::ReturnCode code = someip::ReturnCode::ok) {
    static constexpr std::array<std::byte, 84> payload{};
    view.on_message({{.service = someip::ServiceId{0x1111},
                      .method = someip::MethodId{method},
                      .client = someip::ClientId{7},
                      .session = someip::SessionId{session},
                      .type = type,
                      .return_code = code},
                     payload},
                    flow, Transport::udp, now);
  }
  void event(std::uint16_t method, std::uint16_t session, TimePoint now, const Endpoint& to = client) {
    pass(MessageType::notification, method, session, now, {server, to});
  }
  [[nodiscard]] const SeenTraffic& only() const { return view.rows().begin()->second; }
  TrafficView view{{.max_rows = 3, .max_calls = 2}};
};

TEST_F(TrafficViewTest, CountsTheMessagesAndBytesOfAnEvent) {
  for (std::uint16_t n = 0; n < 21; ++n) {
    event(0x8001, static_cast<std::uint16_t>(n + 1), start + n * 50ms);
  }
  ASSERT_EQ(view.rows().size(), 1U);
  EXPECT_TRUE(only().event);
  EXPECT_EQ(only().server, server);
  EXPECT_EQ(only().messages, 21U);
  EXPECT_EQ(only().bytes, 2100U);
  EXPECT_DOUBLE_EQ(only().mean().messages, 20.0);
  EXPECT_DOUBLE_EQ(only().mean().bytes, 2000.0);
  EXPECT_EQ(only().skipped, 0U);
  EXPECT_FALSE(only().median_latency());
}

TEST_F(TrafficViewTest, TellsTheRateOfTheLastFiveSeconds) {
  event(0x8001, 1, start);
  EXPECT_EQ(only().mean().messages, 0);                            // of one message there is none
  EXPECT_EQ(only().recent.per_second(start + 500ms).messages, 0);  // nor of less than a second
  for (std::uint16_t n = 1; n < 100; ++n) {
    event(0x8001, static_cast<std::uint16_t>(n + 1), start + n * 100ms);
  }
  EXPECT_DOUBLE_EQ(only().recent.per_second(start + 10s).messages, 10.0);
  EXPECT_DOUBLE_EQ(only().recent.per_second(start + 10s).bytes, 1000.0);
  EXPECT_DOUBLE_EQ(only().recent.per_second(start + 12s).messages, 6.0);  // silent for two of them
  EXPECT_EQ(only().recent.per_second(start + 15s).messages, 0);
  EXPECT_DOUBLE_EQ(view.recent().per_second(start + 10s).messages, 10.0);
}

TEST_F(TrafficViewTest, CountsSkippedSessionsAsLost) {
  event(0x8001, 0xfffe, start);
  event(0x8001, 0xffff, start);
  event(0x8001, 1, start);  // 0 is never used
  EXPECT_EQ(only().skipped, 0U);
  event(0x8001, 4, start);
  EXPECT_EQ(only().skipped, 2U);
  event(0x8001, 3, start);  // overtaken
  event(0x8001, 5, start);
  EXPECT_EQ(only().skipped, 2U);
  event(0x8001, 0x9000, start);  // too far ahead: begun anew
  event(0x8001, 1, start);
  event(0x8001, 2, start);
  EXPECT_EQ(only().skipped, 2U);
  event(0x8001, 0, start);  // without sessions
  event(0x8001, 0, start);
  EXPECT_EQ(only().skipped, 2U);
}

TEST_F(TrafficViewTest, TakesCopiesForSeveralReceiversForNoLoss) {
  for (std::uint16_t session = 1; session <= 5; ++session) {
    event(0x8001, session, start);
    event(0x8001, session, start, other_client);
  }
  EXPECT_EQ(only().messages, 10U);
  EXPECT_EQ(only().skipped, 0U);
}

// Some stacks count for each event, others for all events of a service, as vsomeip does.
TEST_F(TrafficViewTest, UnderstandsBothWaysToCountSessions) {
  for (std::uint16_t n = 0; n < 5; ++n) {
    event(0x8001, static_cast<std::uint16_t>(2 * n + 1), start);
    event(0x8002, static_cast<std::uint16_t>(2 * n + 2), start);
  }
  for (const auto& [key, row] : view.rows()) {
    EXPECT_EQ(row.skipped, 0U);
  }
  event(0x8001, 14, start);  // 11, 12 and 13 are missing
  EXPECT_EQ(only().skipped, 3U);
}

TEST_F(TrafficViewTest, MeasuresCalls) {
  const traffic::Flow there{client, server};
  const traffic::Flow back{server, client};
  for (std::uint16_t n = 1; n <= 5; ++n) {
    pass(MessageType::request, 0x21, n, start + n * 1s, there);
    pass(MessageType::response, 0x21, n, start + n * 1s + n * 10ms, back);
  }
  EXPECT_EQ(view.rows().size(), 1U);
  EXPECT_FALSE(only().event);
  EXPECT_EQ(only().server, server);
  EXPECT_EQ(only().messages, 5U);
  EXPECT_EQ(only().answers, 5U);
  EXPECT_EQ(only().errors, 0U);
  EXPECT_EQ(only().bytes, 1000U);
  EXPECT_EQ(only().median_latency(), 30ms);
  // An answer that nobody waits for, and errors.
  pass(MessageType::response, 0x21, 5, start + 9s, back);
  EXPECT_EQ(only().median_latency(), 30ms);
  pass(MessageType::error, 0x21, 6, start + 9s, back, someip::ReturnCode::not_ready);
  pass(MessageType::response, 0x21, 7, start + 9s, back, someip::ReturnCode::not_ok);
  EXPECT_EQ(only().errors, 2U);
}

TEST_F(TrafficViewTest, ForgetsTheOldestCallThatNobodyAnswers) {
  const traffic::Flow there{client, server};
  for (std::uint16_t n = 1; n <= 3; ++n) {
    pass(MessageType::request, 0x21, n, start, there);
  }
  pass(MessageType::response, 0x21, 1, start + 10ms, {server, client});
  EXPECT_FALSE(only().median_latency());
  pass(MessageType::response, 0x21, 3, start + 20ms, {server, client});
  EXPECT_EQ(only().median_latency(), 20ms);
}

TEST_F(TrafficViewTest, TakesSegmentsForTheMessageThatTheyMakeUp) {
  const auto segment = [&](const char* tp_header, const char* slice) {
    const auto payload = hex(std::string{tp_header} + slice);
    view.on_message({{.service = someip::ServiceId{0x1111},
                      .method = someip::MethodId{0x8001},
                      .session = someip::SessionId{1},
                      .type = MessageType::tp_notification},
                     payload},
                    {server, client}, Transport::udp, start);
  };
  const char* slice = "000102030405060708090a0b0c0d0e0f";
  segment("00000001", slice);
  EXPECT_EQ(only().messages, 0U);
  segment("00000010", slice);
  EXPECT_EQ(only().messages, 1U);
  EXPECT_EQ(only().bytes, 2 * 36U);
  segment("00000021", "00");  // more follow, but it is no multiple of 16 bytes
  EXPECT_EQ(only().bytes, 2 * 36U);
  EXPECT_EQ(view.counters().strange, 1U);
}

TEST_F(TrafficViewTest, IsNotFilledUp) {
  for (std::uint16_t id = 0x8001; id <= 0x8005; ++id) {
    event(id, 1, start + id * 1ms);
  }
  EXPECT_EQ(view.rows().size(), 3U);
  EXPECT_EQ(view.counters().not_kept, 2U);
  view.forget_idle(start + 0x8003 * 1ms);
  EXPECT_EQ(view.rows().size(), 1U);
  event(0x8005, 2, start + 1h);
  EXPECT_EQ(view.rows().size(), 2U);
  pass(MessageType{0x55}, 1, 1, start, {server, client});
  EXPECT_EQ(view.counters().strange, 1U);
}

}  // namespace
}  // namespace trestle::inspect::traffic_view_test
