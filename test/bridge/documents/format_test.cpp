#include "bridge/documents/format.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "bridge/messages/types/names.hpp"

namespace trestle::test::format_test {
namespace {

using namespace documents;
using namespace std::chrono_literals;

TEST(ConfigFormat, ReadsWholeNumbers) {
  EXPECT_EQ(read_whole("0"), 0U);
  EXPECT_EQ(read_whole("1234"), 1234U);
  EXPECT_EQ(read_whole("0x1234"), 0x1234U);
  EXPECT_EQ(read_whole("0XaF"), 0xafU);
  EXPECT_EQ(read_whole("0x0001"), 1U);
  EXPECT_EQ(read_whole("18446744073709551615"), std::numeric_limits<std::uint64_t>::max());
}

TEST(ConfigFormat, RefusesWhatIsNoWholeNumber) {
  // 010 is ten to some readers of YAML and eight to others.
  for (const char* text : {"", "0x", "-1", "+1", "1.0", "1e3", "1 ", " 1", "0x12g", "010", "00", "1_000",
                           "0b1", "18446744073709551616", "0x10000000000000000", "true"}) {
    EXPECT_FALSE(read_whole(text).has_value()) << '"' << text << '"';
  }
}

TEST(ConfigFormat, KeepsNumbersInRange) {
  const auto format = whole_number(2, 5);
  EXPECT_EQ(format.expected, "a whole number from 2 to 5");
  EXPECT_FALSE(format.read("1"));
  EXPECT_EQ(format.read("2"), 2U);
  EXPECT_EQ(format.read("5"), 5U);
  EXPECT_FALSE(format.read("6"));
  EXPECT_EQ(id_number(1, 0xfffe).expected, "an id from 0x0001 to 0xfffe");
}

TEST(ConfigFormat, ReadsTimes) {
  const auto format = duration(0s, 10s);
  EXPECT_EQ(format.read("0"), 0ns);
  EXPECT_EQ(format.read("30 ms"), 30ms);
  EXPECT_EQ(format.read("30ms"), 30ms);
  EXPECT_EQ(format.read("1.5 s"), 1500ms);
  EXPECT_EQ(format.read("250 us"), 250us);
  EXPECT_EQ(format.read("7 ns"), 7ns);
  EXPECT_EQ(format.read("10 s"), 10s);
  for (const char* text : {"", "5", "s", "ms", "10.1 s", "-1 s", "1 min", "1e1 s", "1..5 s", "1.5.2 s",
                           "inf s", "nan s", "0x10 ms", "1 s s", "1 S", ". s",
                           "99999999999999999999999999999999999999999999999999999999999999999 s"}) {
    EXPECT_FALSE(format.read(text).has_value()) << '"' << text << '"';
  }
}

TEST(ConfigFormat, ReadsSizes) {
  const auto format = byte_size(16, std::uint64_t{16} << 20U);
  EXPECT_EQ(format.read("16 MiB"), std::uint64_t{16} << 20U);
  EXPECT_EQ(format.read("1.5 KiB"), 1536U);
  EXPECT_EQ(format.read("64KiB"), 65536U);
  EXPECT_EQ(format.read("100 B"), 100U);
  EXPECT_EQ(format.read("100"), 100U);
  for (const char* text : {"", "15", "17 MiB", "0.01 KiB", "1 MB", "MiB", "-1 MiB", "1e9 GiB"}) {
    EXPECT_FALSE(format.read(text).has_value()) << '"' << text << '"';
  }
}

TEST(ConfigFormat, ReadsAddresses) {
  const auto format = ip_address();
  EXPECT_EQ(format.read("127.0.0.1"), IpAddress::v4(127, 0, 0, 1));
  const auto v6 = format.read("fe80::1");
  ASSERT_TRUE(v6.has_value());
  EXPECT_TRUE(v6->v6);
  EXPECT_EQ(v6->bytes[0], 0xfe);
  EXPECT_EQ(v6->bytes[15], 0x01);
  for (const char* text : {"", "localhost", "127.0.0", "127.0.0.256", "127.0.0.1:80", "127.1", "0.0.0.0",
                           "::", "fe80::1%eth0", "::ffff::1"}) {
    EXPECT_FALSE(format.read(text).has_value()) << '"' << text << '"';
  }
  EXPECT_FALSE(format.read(std::string_view{"127.0.0.1\0x", 11}).has_value());
}

TEST(ConfigFormat, WritesWhatItReads) {
  EXPECT_EQ(to_string(Duration{30ms}), "30 ms");
  EXPECT_EQ(to_string(Duration{1500ms}), "1.5 s");
  EXPECT_EQ(to_string(Duration{0}), "0 ns");
  EXPECT_EQ(bytes_to_string(std::uint64_t{16} << 20U), "16 MiB");
  EXPECT_EQ(bytes_to_string(100), "100 B");
}

TEST(RosNames, KnowsTopics) {
  for (const char* name : {"/a", "/points", "/sensing/lidar/top_1/points", "/_a", "/a__b"}) {
    EXPECT_TRUE(messages::is_topic_name(name)) << name;
  }
  for (const char* name :
       {"", "/", "a", "a/b", "/a/", "//a", "/a//b", "/1a", "/a/1", "/a-b", "/a b", "~/a", "/\xc3\xa4"}) {
    EXPECT_FALSE(messages::is_topic_name(name)) << name;
  }
  EXPECT_TRUE(messages::is_topic_name("/" + std::string(246, 'a')));
  EXPECT_FALSE(messages::is_topic_name("/" + std::string(247, 'a')));
}

TEST(RosNames, KnowsTypes) {
  EXPECT_TRUE(messages::is_type_name("sensor_msgs/msg/PointCloud2"));
  for (const char* name : {"", "PointCloud2", "sensor_msgs/PointCloud2", "sensor_msgs/srv/X", "a/msg/b/c",
                           "/msg/X", "a/msg/", "a/msg/1X", "a/msg/X[]", "a::msg::X"}) {
    EXPECT_FALSE(messages::is_type_name(name)) << name;
  }
}

}  // namespace
}  // namespace trestle::test::format_test
