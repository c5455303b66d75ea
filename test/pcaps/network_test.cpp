#include "pcaps/network.hpp"

#include <gtest/gtest.h>

#include "test/bytes.hpp"
#include "test/pcaps/frames.hpp"

namespace trestle::pcaps::network_test {
namespace {
using test::ethernet_frame;
using test::hex;
using test::to_hex;

// 10.0.0.1:30490 -> 10.0.0.2:30491, UDP, payload cafe
const std::string ipv4_udp = "45000020 1234 0000 40 11 0000 0a000001 0a000002 7719 771b 000c 0000 cafebabe";
const std::string ethernet = "020000000002 020000000001 ";

std::string payload_of(const Frame& frame) {
  const auto packet = find_ip(frame);
  if (!packet) {
    return to_string(packet.error().fault);
  }
  if (!*packet) {
    return "no IP";
  }
  const auto datagram = parse_udp(**packet);
  return datagram ? to_hex(datagram->payload) : to_string(datagram.error().fault);
}

std::string payload_of(const std::string& digits, LinkType link = LinkType::ethernet) {
  const auto bytes = hex(digits);
  return payload_of(Frame{1, {}, link, bytes, bytes.size()});
}

TEST(Network, ReadsAddressesPortsAndPayload) {
  const auto bytes = hex(ethernet + "0800" + ipv4_udp);
  const auto packet = find_ip(ethernet_frame(bytes));
  ASSERT_TRUE(packet && *packet);
  EXPECT_EQ((*packet)->from, IpAddress::v4(10, 0, 0, 1));
  EXPECT_EQ((*packet)->to, IpAddress::v4(10, 0, 0, 2));
  EXPECT_EQ((*packet)->protocol, 17);
  const auto datagram = parse_udp(**packet);
  ASSERT_TRUE(datagram);
  EXPECT_EQ(datagram->from_port, 30489);
  EXPECT_EQ(datagram->to_port, 30491);
  EXPECT_EQ(to_hex(datagram->payload), "cafebabe");
  EXPECT_EQ(datagram->missing, 0U);
}

TEST(Network, ReadsEveryLinkType) {
  EXPECT_EQ(payload_of(ethernet + "0800" + ipv4_udp), "cafebabe");
  EXPECT_EQ(payload_of(ipv4_udp, LinkType::raw_ip), "cafebabe");
  EXPECT_EQ(payload_of("0000 0001 0006 020000000001 0000 0800" + ipv4_udp, LinkType::linux_sll), "cafebabe");
  EXPECT_EQ(payload_of("0800 0000 00000001 0001 00 06 0200000000010000" + ipv4_udp, LinkType::linux_sll2),
            "cafebabe");
  EXPECT_EQ(payload_of("00000002" + ipv4_udp, LinkType::null_loopback), "cafebabe");
  EXPECT_EQ(payload_of("02000000" + ipv4_udp, LinkType::null_loopback), "cafebabe");
}

// Frame control, duration, addresses, sequence control; then what `qos` says, and LLC.
std::string wlan(const std::string& control, const std::string& qos = "",
                 const std::string& sequence = "1000") {
  return control + "0000 020000000002 020000000001 020000000003" + sequence + qos + "aaaa03 000000 0800";
}

TEST(Network, ReadsWlan) {
  EXPECT_EQ(payload_of(wlan("0801") + ipv4_udp, LinkType::wlan), "cafebabe");
  EXPECT_EQ(payload_of(wlan("8802", "0000") + ipv4_udp, LinkType::wlan), "cafebabe");           // QoS
  EXPECT_EQ(payload_of(wlan("8882", "0000 00000000") + ipv4_udp, LinkType::wlan), "cafebabe");  // 802.11n
  EXPECT_EQ(payload_of(wlan("0803", "020000000004") + ipv4_udp, LinkType::wlan), "cafebabe");   // 4 addresses
  EXPECT_EQ(payload_of(wlan("0801") + ipv4_udp + "01020304", LinkType::wlan), "cafebabe");      // checksum
  EXPECT_EQ(payload_of(wlan("0841") + ipv4_udp, LinkType::wlan), "no IP");                      // encrypted
  EXPECT_EQ(payload_of(wlan("4801") + ipv4_udp, LinkType::wlan), "no IP");                      // no data
  EXPECT_EQ(payload_of(wlan("8000") + ipv4_udp, LinkType::wlan), "no IP");                      // a beacon
  EXPECT_EQ(payload_of(wlan("0805") + ipv4_udp, LinkType::wlan), "no IP");                      // in pieces
  EXPECT_EQ(payload_of(wlan("0801", "", "1100") + ipv4_udp, LinkType::wlan), "no IP");          // likewise
  EXPECT_EQ(payload_of(wlan("8801", "8000") + ipv4_udp, LinkType::wlan), "no IP");              // several
  EXPECT_EQ(payload_of("0801 0000 020000000002", LinkType::wlan), "link_header");
}

TEST(Network, ReadsWhatPerPacketInformationPrecedes) {
  EXPECT_EQ(payload_of("00 00 0800 69000000" + wlan("0801") + ipv4_udp, LinkType::ppi), "cafebabe");
  const std::string field = "0200 0400 01020304";
  EXPECT_EQ(payload_of("00 00 1000 69000000" + field + wlan("0801") + ipv4_udp, LinkType::ppi), "cafebabe");
  EXPECT_EQ(payload_of("00 00 1000 01000000" + field + ethernet + "8100 0049 0800" + ipv4_udp, LinkType::ppi),
            "cafebabe");
  EXPECT_EQ(payload_of("00 00 0800 65000000" + ipv4_udp, LinkType::ppi), "cafebabe");
  EXPECT_EQ(payload_of("00 00 0800 0c000000" + ipv4_udp, LinkType::ppi), "cafebabe");
  EXPECT_EQ(
      payload_of("00 00 0800 c0000000 00 00 0800 01000000" + ethernet + "0800" + ipv4_udp, LinkType::ppi),
      "no IP");  // in itself
  EXPECT_EQ(payload_of("00 00 0700 01000000" + ethernet + "0800" + ipv4_udp, LinkType::ppi), "link_header");
  EXPECT_EQ(payload_of("00 00 ff7f 01000000" + ethernet + "0800" + ipv4_udp, LinkType::ppi), "link_header");
  EXPECT_EQ(payload_of("00 00 08", LinkType::ppi), "link_header");
}

TEST(Network, PassesOverVlanTags) {
  EXPECT_EQ(payload_of(ethernet + "8100 0049 0800" + ipv4_udp), "cafebabe");
  EXPECT_EQ(payload_of(ethernet + "88a8 0001 8100 0002 0800" + ipv4_udp), "cafebabe");
}

TEST(Network, LeavesOtherTrafficAlone) {
  EXPECT_EQ(payload_of(ethernet + "0806 0001"), "no IP");
  EXPECT_EQ(payload_of(ethernet + "0026 4242030000"), "no IP");  // 802.3: a length, not a type
}

TEST(Network, PassesOverIpv4Options) {
  EXPECT_EQ(
      payload_of("46000024 1234 0000 40 11 0000 0a000001 0a000002 01010100 7719 771b 000c 0000 cafebabe",
                 LinkType::raw_ip),
      "cafebabe");
}

TEST(Network, IgnoresThePaddingOfShortFrames) {
  EXPECT_EQ(payload_of(ethernet + "0800" + ipv4_udp + "000000000000"), "cafebabe");
}

TEST(Network, PassesOverIpv6ExtensionHeaders) {
  const std::string addresses = "fe800000000000000000000000000001 ff020000000000000000000000000002";
  const std::string udp = "7719 771b 000c 0000 cafebabe";
  EXPECT_EQ(payload_of("60000000 000c 11 40" + addresses + udp, LinkType::raw_ip), "cafebabe");
  // hop-by-hop options (8 bytes), then destination options (16 bytes)
  EXPECT_EQ(payload_of("60000000 0024 00 40" + addresses +
                           "3c00 010400000000 1101 0000000000000000000000000000" + udp,
                       LinkType::raw_ip),
            "cafebabe");
  // a fragment header around a whole packet
  EXPECT_EQ(payload_of("60000000 0014 2c 40" + addresses + "1100 0000 12345678" + udp, LinkType::raw_ip),
            "cafebabe");
}

TEST(Network, NamesWhatIsDamaged) {
  EXPECT_EQ(payload_of("020000000002 0200"), "link_header");
  EXPECT_EQ(payload_of(ethernet + "8100 0049"), "link_header");
  EXPECT_EQ(payload_of(ethernet + "0800"), "ip_header");
  EXPECT_EQ(payload_of(ethernet + "0800 44000020 1234 0000 40 11 0000 0a000001 0a000002"), "ip_header");
  EXPECT_EQ(payload_of(ethernet + "0800 75000020 1234 0000 40 11 0000 0a000001 0a000002"), "ip_header");
  // total length: beyond the frame, and below the header
  EXPECT_EQ(payload_of("45000021 1234 0000 40 11 0000 0a000001 0a000002 7719 771b 000c 0000 cafebabe",
                       LinkType::raw_ip),
            "ip_length");
  EXPECT_EQ(payload_of("45000013 1234 0000 40 11 0000 0a000001 0a000002 7719 771b 000c 0000 cafebabe",
                       LinkType::raw_ip),
            "ip_length");
  // UDP length: beyond the packet, and below the header
  EXPECT_EQ(payload_of("45000020 1234 0000 40 11 0000 0a000001 0a000002 7719 771b 000d 0000 cafebabe",
                       LinkType::raw_ip),
            "udp_length");
  EXPECT_EQ(payload_of("45000020 1234 0000 40 11 0000 0a000001 0a000002 7719 771b 0007 0000 cafebabe",
                       LinkType::raw_ip),
            "udp_length");
  EXPECT_EQ(payload_of("4500001b 1234 0000 40 11 0000 0a000001 0a000002 7719 771b 000700", LinkType::raw_ip),
            "udp_header");
  // an extension header that ends beyond the packet
  EXPECT_EQ(payload_of("60000000 0008 00 40 fe800000000000000000000000000001 ff020000000000000000000000000002"
                       "11ff 010400000000",
                       LinkType::raw_ip),
            "ip_length");
}

TEST(Network, TellsWhatTheRecorderCutOff) {
  const auto bytes =
      hex(ethernet + "0800 45000020 1234 0000 40 11 0000 0a000001 0a000002 7719 771b 000c 0000 ca");
  const auto packet = find_ip(Frame{1, {}, LinkType::ethernet, bytes, bytes.size() + 3});
  ASSERT_TRUE(packet && *packet);
  const auto datagram = parse_udp(**packet);
  ASSERT_TRUE(datagram);
  EXPECT_EQ(to_hex(datagram->payload), "ca");
  EXPECT_EQ(datagram->missing, 3U);
}

TEST(Network, SurvivesEveryTruncation) {
  const auto bytes = hex(ethernet + "8100 0049 0800" + ipv4_udp);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const std::string result = payload_of(ethernet_frame(ByteView{bytes}.first(size)));
    EXPECT_NE(result, "cafebabe") << size;
    EXPECT_NE(result, "no IP") << size;
  }
}

TEST(Network, ReadsTcpFlagsAndPayloadBehindOptions) {
  const auto bytes =
      hex("45000030 1234 0000 40 06 0000 0a000001 0a000002"
          "7719 771b 0000002a 00000000 60 13 ffff 0000 0000 020405b4 cafebabe");
  const auto packet = find_ip(Frame{1, {}, LinkType::raw_ip, bytes, bytes.size()});
  ASSERT_TRUE(packet && *packet);
  const auto segment = parse_tcp(**packet);
  ASSERT_TRUE(segment);
  EXPECT_EQ(segment->sequence, 42U);
  EXPECT_TRUE(segment->syn);
  EXPECT_TRUE(segment->fin);
  EXPECT_FALSE(segment->rst);
  EXPECT_EQ(to_hex(segment->payload), "cafebabe");
}

}  // namespace
}  // namespace trestle::pcaps::network_test
