#include "pcaps/ip_fragments.hpp"

#include <gtest/gtest.h>

#include "test/bytes.hpp"

namespace trestle::pcaps::ip_fragments_test {
namespace {
using namespace std::chrono_literals;
using test::hex;
using test::to_hex;

struct Network {
  IpFragments fragments;
  Timestamp now{};

  /// The payload that is complete now, or "-", or the fault.
  std::string add(std::uint32_t id, std::uint32_t offset, bool more, const std::string& digits) {
    const auto bytes = hex(digits);
    IpPacket packet;
    packet.from = IpAddress::v4(10, 0, 0, 1);
    packet.to = IpAddress::v4(10, 0, 0, 2);
    packet.protocol = 17;
    packet.payload = bytes;
    packet.fragment = IpPacket::Fragment{id, offset, more};
    const auto whole = fragments.add(packet, now);
    return !whole ? to_string(whole.error().fault) : *whole ? to_hex((*whole)->payload) : "-";
  }
};

TEST(IpFragments, PutsFragmentsTogetherInAnyOrder) {
  Network network{IpFragments{{}}};
  EXPECT_EQ(network.add(7, 16, false, "3333"), "-");
  EXPECT_EQ(network.add(7, 0, true, "1111111111111111"), "-");
  EXPECT_EQ(network.add(7, 8, true, "2222222222222222"), "111111111111111122222222222222223333");
  EXPECT_EQ(network.fragments.incomplete(), 0U);
}

TEST(IpFragments, KeepsPacketsApart) {
  Network network{IpFragments{{}}};
  EXPECT_EQ(network.add(7, 0, true, "1111111111111111"), "-");
  EXPECT_EQ(network.add(8, 8, false, "44"), "-");
  EXPECT_EQ(network.add(7, 8, false, "22"), "111111111111111122");
  EXPECT_EQ(network.add(8, 0, true, "3333333333333333"), "333333333333333344");
}

TEST(IpFragments, KeepsTheFirstValueOfRepeatedBytes) {
  Network network{IpFragments{{}}};
  EXPECT_EQ(network.add(7, 0, true, "1111111111111111"), "-");
  EXPECT_EQ(network.add(7, 0, true, "9999999999999999"), "-");
  EXPECT_EQ(network.add(7, 8, false, "22"), "111111111111111122");
}

TEST(IpFragments, RefusesFragmentsThatCannotBe) {
  Network network{IpFragments{{}}};
  EXPECT_EQ(network.add(1, 0, true, "11111111111111"), "fragment");         // not the last, no multiple of 8
  EXPECT_EQ(network.add(2, 8, true, ""), "fragment");                       // empty
  EXPECT_EQ(network.add(3, 65528, false, "1111111111111111"), "fragment");  // ends beyond 65535
  EXPECT_EQ(network.add(4, 8, false, "22"), "-");
  EXPECT_EQ(network.add(4, 16, false, "22"), "fragment");  // a second, different end
  EXPECT_EQ(network.fragments.dropped(), 4U);
  EXPECT_EQ(network.fragments.incomplete(), 0U);
}

TEST(IpFragments, DropsTheOldestWhenThereAreTooMany) {
  Network network{IpFragments{{.max_packets = 2}}};
  EXPECT_EQ(network.add(1, 0, true, "1111111111111111"), "-");
  network.now += 1ms;
  EXPECT_EQ(network.add(2, 0, true, "2222222222222222"), "-");
  network.now += 1ms;
  EXPECT_EQ(network.add(3, 0, true, "3333333333333333"), "-");
  EXPECT_EQ(network.fragments.dropped(), 1U);
  EXPECT_EQ(network.add(2, 8, false, "ff"), "2222222222222222ff");
  EXPECT_EQ(network.add(1, 8, false, "ff"), "-");
}

TEST(IpFragments, ForgetsWhatIsTooOld) {
  Network network{IpFragments{{.max_age = 30s}}};
  EXPECT_EQ(network.add(1, 0, true, "1111111111111111"), "-");
  network.now += 31s;
  EXPECT_EQ(network.add(2, 0, true, "2222222222222222"), "-");
  EXPECT_EQ(network.fragments.dropped(), 1U);
  EXPECT_EQ(network.fragments.incomplete(), 1U);
}

}  // namespace
}  // namespace trestle::pcaps::ip_fragments_test
