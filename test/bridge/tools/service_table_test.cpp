// The screen of trestle watch.
#include "bridge/tools/service_table.hpp"

#include <gtest/gtest.h>

#include "test/bytes.hpp"

namespace trestle::bridge {
namespace {

using namespace std::chrono_literals;
using namespace trestle::test;

const TimePoint start = TimePoint{} + 1h;

/// Hears the offer of instance N of service 0x1111, from 10.0.0.N.
void hear_offer(NetworkView& view, std::uint8_t n, TimePoint now) {
  auto datagram =
      hex("ffff8100 00000030 00000001 01010200 c0000000"
          "00000010 01000010 11110001 01000003 00000000"
          "0000000c 00090400 0a000005 0011772d");
  datagram[31] = std::byte{n};
  std::vector<Sighting> sightings;
  view.on_datagram(datagram, {IpAddress::v4(10, 0, 0, n), 30490}, false, now, sightings);
  ASSERT_EQ(sightings.size(), 1U);
}

TEST(ServiceTable, HasARowForEachService) {
  NetworkView view{10};
  hear_offer(view, 1, start);
  hear_offer(view, 2, start + 2s);
  std::vector<Sighting> sightings;
  view.on_time(start + 3s, sightings);
  EXPECT_EQ(
      screen_of(view, "HERE", start + 3s, {.rows = 10, .columns = 100}, {}),
      "\033[H"
      "SOME/IP at HERE: 1 service of 1 host; 2 discovery messages\033[K\n"
      "\033[K\n"
      "SERVICE.INSTANCE  VERSION     OFFERED BY       OFFERS/S  LIFETIME      ENDPOINTS\033[K\n"
      "0x1111.0x0001     1.0         10.0.0.1                -  gone          udp 10.0.0.5:30509\033[K\n"
      "0x1111.0x0002     1.0         10.0.0.2                -  2 of 3 s      udp 10.0.0.5:30509\033[K\n"
      "\033[J");
}

TEST(ServiceTable, FitsTheWindow) {
  NetworkView view{20};
  for (std::uint8_t n = 1; n <= 9; ++n) {
    hear_offer(view, n, start);
  }
  const std::string screen = screen_of(view, "HERE", start, {.rows = 8, .columns = 30}, {});
  EXPECT_EQ(std::ranges::count(screen, '\n'), 7);  // the cursor stands on the eighth
  EXPECT_NE(screen.find("0x1111.0x0003"), std::string::npos);
  EXPECT_EQ(screen.find("0x1111.0x0004"), std::string::npos);
  EXPECT_NE(screen.find("... 6 more"), std::string::npos);
  EXPECT_EQ(screen.find("ENDPOINTS"), std::string::npos);
}

}  // namespace
}  // namespace trestle::bridge
