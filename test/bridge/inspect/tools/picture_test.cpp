// The tables of trestle watch.
#include "bridge/inspect/tools/picture.hpp"

#include <gtest/gtest.h>

#include "test/bytes.hpp"

namespace trestle::inspect::picture_test {
namespace {

using namespace std::chrono_literals;
using namespace trestle::test;

const TimePoint start = TimePoint{} + 1h;
const Endpoint group{IpAddress::v4(224, 244, 224, 245), 30490};

class PictureTest : public testing::Test {
 protected:
  /// Instance N of service 0x1111 is offered by 10.0.0.N.
  void offer(std::uint8_t n, TimePoint now) {
    auto datagram =
        hex("ffff8100 00000030 00000001 01010200 c0000000"
            "00000010 01000010 11110001 01000003 00000000"
            "0000000c 00090400 0a000005 0011772d");
    datagram[31] = std::byte{n};
    seen.on_sd_datagram(datagram, {IpAddress::v4(10, 0, 0, n), 30490}, group, now);
  }
  /// 10.0.0.N subscribes to eventgroup 4 of instance 1.
  void subscribe(std::uint8_t n, TimePoint now) {
    const auto datagram =
        hex("ffff8100 00000030 00000001 01010200 c0000000"
            "00000010 06000010 11110001 01000003 00000004"
            "0000000c 00090400 0a000009 00111234");
    seen.on_sd_datagram(datagram, {IpAddress::v4(10, 0, 0, n), 30490}, {IpAddress::v4(10, 0, 0, 1), 30490},
                        now);
  }
  /// An event of instance 1, 100 bytes.
  void event(std::uint16_t session, TimePoint now) {
    static constexpr std::array<std::byte, 84> payload{};
    seen.traffic().on_message({{.service = someip::ServiceId{0x1111},
                                .method = someip::MethodId{0x8001},
                                .session = someip::SessionId{session},
                                .type = someip::MessageType::notification},
                               payload},
                              {{IpAddress::v4(10, 0, 0, 5), 30509}, {IpAddress::v4(10, 0, 0, 9), 4660}},
                              Transport::udp, now);
  }
  [[nodiscard]] Picture picture(TimePoint now, bool live) const {
    return {.seen = seen, .where = "HERE", .since = start, .now = now, .live = live};
  }
  Watcher seen{30490, [](const std::vector<traffic::Sighting>&, TimePoint) {}};
};

TEST_F(PictureTest, HasServicesSubscriptionsAndTraffic) {
  offer(1, start);
  offer(2, start + 2s);
  subscribe(9, start + 2s);
  for (std::uint16_t n = 0; n < 30; ++n) {
    event(static_cast<std::uint16_t>(n < 29 ? n + 1 : n + 3), start + n * 100ms);
  }
  seen.on_time(start + 3s);
  EXPECT_EQ(
      screen_of(picture(start + 3s, true), {.columns = 120, .rows = 40}, {}),
      "\033[H"
      "SOME/IP at HERE: 1 service of 1 host, 1 subscription, 10.0 messages/s, 1.00 kB/s; 3 discovery messages"
      "\033[K\n"
      "\033[K\n"
      "SERVICE.INSTANCE  VERSION     OFFERED BY           FOR  LIFETIME      ENDPOINTS\033[K\n"
      "0x1111.0x0001     1.0         10.0.0.1             3 s  gone          udp 10.0.0.5:30509\033[K\n"
      "0x1111.0x0002     1.0         10.0.0.2             1 s  2 of 3 s      udp 10.0.0.5:30509\033[K\n"
      "\033[K\n"
      "SERVICE.INSTANCE  EVENTGROUP  SUBSCRIBER       STATE             FOR  LIFETIME      EVENTS GO "
      "TO\033[K\n"
      "0x1111.0x0001     0x0004      10.0.0.9         asked             1 s  2 of 3 s      udp 10.0.0.9:4660"
      "\033[K\n"
      "\033[K\n"
      "SERVICE.INSTANCE  TRAFFIC        PER SECOND    BYTES/S    IN ALL  NOTES             SERVER\033[K\n"
      "0x1111.0x0001     event 0x8001         10.0    1.00 kB        30  2 lost            udp 10.0.0.5:30509"
      "\033[K\n"
      "\033[J");
}

TEST_F(PictureTest, FitsTheWindow) {
  for (std::uint8_t n = 1; n <= 20; ++n) {
    offer(n, start);
  }
  subscribe(9, start);
  event(1, start);
  const std::string screen = screen_of(picture(start, true), {.columns = 30, .rows = 14}, {});
  EXPECT_EQ(std::ranges::count(screen, '\n'), 11);  // and the cursor stands below
  EXPECT_NE(screen.find("0x1111.0x0001     1.0"), std::string::npos);
  EXPECT_EQ(screen.find("0x1111.0x0002"), std::string::npos);
  EXPECT_NE(screen.find("... 19 more"), std::string::npos);
  EXPECT_NE(screen.find("0x1111.0x0001     0x0004"), std::string::npos);
  EXPECT_NE(screen.find("0x1111.0x0001     event 0x8001"), std::string::npos);
  EXPECT_EQ(screen.find("ENDPOINTS"), std::string::npos);
  EXPECT_LE(std::ranges::count(screen_of(picture(start, true), {.columns = 30, .rows = 2}, {}), '\n'), 1);
}

TEST_F(PictureTest, ShowsOnlyServicesWhereTrafficCannotBeSeen) {
  offer(1, start);
  Picture without = picture(start, false);
  without.traffic = false;
  EXPECT_EQ(text_of(without, {}),
            "SOME/IP at HERE: 1 service of 1 host; 1 discovery message\n"
            "\n"
            "SERVICE.INSTANCE  VERSION     OFFERED BY           FOR  LIFETIME      ENDPOINTS\n"
            "0x1111.0x0001     1.0         10.0.0.1             0 s  3 of 3 s      udp 10.0.0.5:30509\n");
}

TEST_F(PictureTest, IsOneObjectInJson) {
  offer(1, start);
  subscribe(9, start);
  event(1, start);
  event(2, start + 500ms);
  EXPECT_EQ(
      json_of(picture(start + 1s, false)),
      R"({"seen":"summary","where":"HERE","time":"1970-01-01T01:00:01.000Z","seconds":1.0,)"
      R"("services":[{"service":"0x1111","instance":"0x0001","major_version":1,"minor_version":0,)"
      R"("udp":"10.0.0.5:30509","peer":"10.0.0.1:30490","ttl":3,"since":"1970-01-01T01:00:00.000Z","gone":false}],)"
      R"("subscriptions":[{"service":"0x1111","instance":"0x0001","major_version":1,"eventgroup":"0x0004",)"
      R"("udp":"10.0.0.9:4660","peer":"10.0.0.9:30490","server":"10.0.0.1:30490","ttl":3,"state":"asked",)"
      R"("since":"1970-01-01T01:00:00.000Z","gone":false}],)"
      R"("traffic":[{"service":"0x1111","instance":"0x0001","event":"0x8001","server":"10.0.0.5:30509",)"
      R"("transport":"udp","messages_per_second":2.0,"bytes_per_second":200.0,"messages":2,"bytes":200,"lost":0}],)"
      R"("counters":{"discovery_messages":2,"messages":2,"malformed":0,"not_kept":0,"frames_missed":0}})");
}

}  // namespace
}  // namespace trestle::inspect::picture_test
