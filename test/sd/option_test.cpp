#include "sd/wire/offer_options.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "test/bytes.hpp"
#include "test/covers.hpp"

namespace trestle::sd::option_test {
namespace {
using test::covers;
using test::hex;
using test::to_hex;
using testing::ElementsAre;
using testing::UnorderedElementsAre;

constexpr Endpoint server{IpAddress::v4(10, 0, 0, 1), 30509};
constexpr IpAddress v6_address{{0x20, 0x01, 0x0d, 0xb8, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x2a}, true};

std::string bytes_of(const EndpointOption& option) {
  const OwnedOption owned = option.encode();
  return to_hex(std::array{static_cast<std::byte>(owned.view().type)}) + " " + to_hex(owned.view().body);
}

TEST(EndpointOption, WritesTheBytesOfEachKind) {
  covers({"feat_req_someipsd_127", "feat_req_someipsd_129", "feat_req_someipsd_141", "feat_req_someipsd_140",
          "feat_req_someipsd_164", "feat_req_someipsd_723", "feat_req_someipsd_725", "feat_req_someipsd_734",
          "feat_req_someipsd_737", "feat_req_someipsd_739", "feat_req_someipsd_1085",
          "feat_req_someipsd_1087", "feat_req_someipsd_1096", "feat_req_someipsd_1101",
          "feat_req_someipsd_1103", "feat_req_someipsd_128", "feat_req_someipsd_724",
          "feat_req_someipsd_1086"});
  EXPECT_EQ(bytes_of({EndpointRole::unicast, server, Transport::udp}), "04 000a0000010011772d");
  EXPECT_EQ(bytes_of({EndpointRole::unicast, server, Transport::tcp}), "04 000a0000010006772d");
  EXPECT_EQ(bytes_of({EndpointRole::multicast, {IpAddress::v4(224, 225, 226, 233), 32344}}),
            "14 00e0e1e2e900117e58");
  EXPECT_EQ(bytes_of({EndpointRole::sd, {IpAddress::v4(192, 168, 0, 1), 30490}}), "24 00c0a800010011771a");
  EXPECT_EQ(bytes_of({EndpointRole::unicast, {v6_address, 30509}, Transport::tcp}),
            "06 0020010db800000000000000000000002a0006772d");
  EXPECT_EQ(bytes_of({EndpointRole::multicast, {v6_address, 1}}),
            "16 0020010db800000000000000000000002a00110001");
  EXPECT_EQ(bytes_of({EndpointRole::sd, {v6_address, 1}}), "26 0020010db800000000000000000000002a00110001");
}

TEST(EndpointOption, DecodesWhatOthersSent) {
  // Cut from recorded vsomeip traffic.
  const auto body = hex("00 e0e1e2e9 00 11 7e58");
  const auto option = EndpointOption::decode({OptionType::ipv4_multicast, body});
  ASSERT_TRUE(option);
  EXPECT_EQ(option->role, EndpointRole::multicast);
  EXPECT_EQ(option->endpoint, (Endpoint{IpAddress::v4(224, 225, 226, 233), 32344}));
  EXPECT_EQ(option->transport, Transport::udp);
}

TEST(EndpointOption, KeepsReservedBytesAndAnyProtocol) {
  const auto body = hex("80 0a000001 7f 99 772d");
  const auto option = EndpointOption::decode({OptionType::ipv4_endpoint, body});
  ASSERT_TRUE(option);
  EXPECT_EQ(option->flags, 0x80);
  EXPECT_EQ(option->reserved, 0x7f);
  EXPECT_EQ(option->transport, Transport{0x99});
  EXPECT_EQ(to_hex(option->encode().view().body), to_hex(body));
}

TEST(EndpointOption, RefusesEveryOtherLength) {
  covers({"feat_req_someipsd_102"});
  const std::vector<std::byte> body(300);
  for (std::size_t size = 0; size <= body.size(); ++size) {
    const ByteView cut = ByteView{body}.first(size);
    EXPECT_EQ(EndpointOption::decode({OptionType::ipv4_endpoint, cut}).has_value(), size == 9) << size;
    EXPECT_EQ(EndpointOption::decode({OptionType::ipv6_endpoint, cut}).has_value(), size == 21) << size;
  }
  EXPECT_EQ(EndpointOption::decode({OptionType::ipv4_endpoint, ByteView{body}.first(8)}).error(),
            WireError::bad_option_length);
  EXPECT_EQ(EndpointOption::decode({OptionType::configuration, ByteView{body}.first(9)}).error(),
            WireError::bad_value);
}

TEST(LoadBalancingOption, GoesBothWays) {
  covers({"feat_req_someipsd_146", "feat_req_someipsd_175"});
  const auto body = hex("00 1234 5678");
  const auto option = LoadBalancingOption::decode({OptionType::load_balancing, body});
  ASSERT_TRUE(option);
  EXPECT_EQ(option->priority, 0x1234);
  EXPECT_EQ(option->weight, 0x5678);
  EXPECT_EQ(to_hex(option->encode().view().body), to_hex(body));
  EXPECT_EQ(LoadBalancingOption::decode({OptionType::load_balancing, ByteView{body}.first(4)}).error(),
            WireError::bad_option_length);
}

TEST(MacGroupcastOption, GoesBothWays) {
  covers({"feat_req_someipsd_1251", "feat_req_someipsd_1252", "feat_req_someipsd_1253",
          "feat_req_someipsd_1262"});
  // The example of IEEE 1722: a stream id of 6 + 2 bytes makes it 0x11 long.
  const auto body = hex("00 91e0f0000efe 22f0 0a1b2c3d4e5f0007");
  ASSERT_EQ(body.size(), 0x11U);
  const auto option = MacGroupcastOption::decode({OptionType::mac_groupcast, body});
  ASSERT_TRUE(option);
  EXPECT_THAT(option->address, ElementsAre(0x91, 0xe0, 0xf0, 0x00, 0x0e, 0xfe));
  EXPECT_EQ(option->protocol, 0x22f0);
  EXPECT_EQ(option->identifier_bytes, 8);
  EXPECT_THAT(option->identifier, ElementsAre(0x0a, 0x1b, 0x2c, 0x3d, 0x4e, 0x5f, 0x00, 0x07, 0, 0, 0, 0));
  EXPECT_EQ(option->encode().view().type, OptionType::mac_groupcast);
  EXPECT_EQ(to_hex(option->encode().view().body), to_hex(body));
}

TEST(MacGroupcastOption, HasAnIdentifierOfAnyLengthUpToItsLimit) {
  const auto none = hex("80 91e0f0000efe 22f0");
  const auto shortest = MacGroupcastOption::decode({OptionType::mac_groupcast, none});
  ASSERT_TRUE(shortest);
  EXPECT_EQ(shortest->identifier_bytes, 0);
  EXPECT_EQ(to_hex(shortest->encode().view().body), to_hex(none));
  EXPECT_EQ(MacGroupcastOption::decode({OptionType::mac_groupcast, ByteView{none}.first(8)}).error(),
            WireError::bad_option_length);
  const auto twelve = hex("00 91e0f0000efe 22f0 000102030405060708090a0b");
  const auto longest = MacGroupcastOption::decode({OptionType::mac_groupcast, twelve});
  ASSERT_TRUE(longest);
  EXPECT_EQ(to_hex(longest->encode().view().body), to_hex(twelve));
  const auto thirteen = hex("00 91e0f0000efe 22f0 000102030405060708090a0b0c");
  EXPECT_EQ(MacGroupcastOption::decode({OptionType::mac_groupcast, thirteen}).error(), WireError::no_room);
  EXPECT_EQ(MacGroupcastOption::decode({OptionType::load_balancing, twelve}).error(), WireError::bad_value);
}

template <std::size_t... i>
constexpr bool has_members(std::index_sequence<i...>) {
  return requires {
    OfferOptions{(static_cast<void>(i), std::nullopt)...};
  };
}

TEST(OfferOptions, VisitEachOfTheirMembers) {
  static_assert(has_members(std::make_index_sequence<offer_option_kinds>{}));
  static_assert(!has_members(std::make_index_sequence<offer_option_kinds + 1>{}));
  std::vector<OptionType> types;
  for_each_offer_option([&]<typename Kind>() { types.push_back(Kind::option_type); });
  EXPECT_THAT(types, UnorderedElementsAre(OptionType::load_balancing, OptionType::mac_groupcast));
  EXPECT_TRUE(std::ranges::all_of(types, is_known));
  OfferOptions options{.load_balancing = LoadBalancingOption{}, .mac_groupcast = MacGroupcastOption{}};
  types.clear();
  OfferOptions::for_each(options, [&](auto& option) {
    types.push_back(option->encode().view().type);
    option.reset();
  });
  // As they stand in an offer.
  EXPECT_THAT(types, ElementsAre(OptionType::mac_groupcast, OptionType::load_balancing));
  EXPECT_EQ(options, OfferOptions{});
}

std::vector<std::string> items_of(ConfigurationCursor& cursor) {
  std::vector<std::string> items;
  while (const auto item = cursor.next()) {
    items.push_back(std::string{item->key} + (item->value ? " -> " + std::string{*item->value} : " present"));
  }
  return items;
}

TEST(Configuration, GivesItemsInTheirOrder) {
  covers({"feat_req_someipsd_149", "feat_req_someipsd_150", "feat_req_someipsd_151", "feat_req_someipsd_152",
          "feat_req_someipsd_157", "feat_req_someipsd_159", "feat_req_someipsd_160", "feat_req_someipsd_217",
          "feat_req_someipsd_684", "feat_req_someipsd_144", "feat_req_someipsd_755"});
  // abc=x, def=123, flag (no value), e= (empty value), abc=y (the key again), k=a=b (value with '=').
  const auto body =
      hex("00 05 6162633d78 07 6465663d313233 04 666c6167 02 653d 05 6162633d79 05 6b3d613d62 00");
  ConfigurationCursor cursor{{OptionType::configuration, body}};
  EXPECT_THAT(items_of(cursor),
              ElementsAre("abc -> x", "def -> 123", "flag present", "e -> ", "abc -> y", "k -> a=b"));
  EXPECT_FALSE(cursor.error());
}

TEST(Configuration, IsWrittenAsItIsRead) {
  covers({"feat_req_someipsd_147"});
  std::array<std::byte, 17> room{};
  const std::array<ConfigurationItem, 2> items{{{"abc", "x"}, {"def", "123"}}};
  const auto option = encode_configuration(items, room);
  ASSERT_TRUE(option);
  EXPECT_EQ(to_hex(option->body), "00056162633d78076465663d31323300");
  EXPECT_EQ(encode_configuration(items, std::span{room}.first(15)).error(), WireError::no_room);
}

TEST(Configuration, CarriesTheNamesOfHostServiceAndInstance) {
  covers({"feat_req_someipsd_218", "feat_req_someipsd_755"});
  std::array<std::byte, 64> room{};
  const std::array<ConfigurationItem, 3> items{
      {{"hostname", "h"}, {"servicename", "s"}, {"instancename", "i"}}};
  const auto option = encode_configuration(items, room);
  ASSERT_TRUE(option);
  EXPECT_EQ(to_hex(option->body), to_hex(hex("00 0a 686f73746e616d653d68 0d 736572766963656e616d653d73"
                                             "0e 696e7374616e63656e616d653d69 00")));
  ConfigurationCursor cursor{*option};
  EXPECT_THAT(items_of(cursor), ElementsAre("hostname -> h", "servicename -> s", "instancename -> i"));
}

TEST(Configuration, IsNotWrittenWithABadKey) {
  std::array<std::byte, 300> room{};
  for (const char* key : {"", "=", "a=b", " ", "\x1f", "\x7f", "\xc3\xa4"}) {
    const std::array<ConfigurationItem, 1> items{{{key, std::nullopt}}};
    EXPECT_EQ(encode_configuration(items, room).error(), WireError::bad_value) << key;
  }
  const std::string long_value(252, 'x');
  const std::array<ConfigurationItem, 1> longest{{{"ab", long_value}}};
  EXPECT_TRUE(encode_configuration(longest, room));
  const std::array<ConfigurationItem, 1> too_long{{{"abc", long_value}}};
  EXPECT_EQ(encode_configuration(too_long, room).error(), WireError::bad_value);
}

struct BadConfiguration {
  const char* body;
  WireError error;
  std::size_t offset;
};

TEST(Configuration, StopsAtTheFirstFault) {
  covers({"feat_req_someipsd_158", "feat_req_someipsd_161", "feat_req_someipsd_162"});
  for (const auto& [bytes, error, offset] : {
           BadConfiguration{"", WireError::bad_option_length, 0},
           BadConfiguration{"00", WireError::bad_option_length, 1},              // no end mark
           BadConfiguration{"00 01 61", WireError::bad_option_length, 3},        // no end mark after an item
           BadConfiguration{"00 03 61 62", WireError::bad_option_length, 1},     // item beyond the option
           BadConfiguration{"00 01 61 00 00", WireError::bad_option_length, 3},  // bytes after the end mark
           BadConfiguration{"00 02 3d61 00", WireError::bad_value, 1},           // "=a"
           BadConfiguration{"00 01 20 00", WireError::bad_value, 1},             // a blank alone
           BadConfiguration{"00 01 0a 00", WireError::bad_value, 1},             // not printable
       }) {
    const auto body = hex(bytes);
    ConfigurationCursor cursor{{OptionType::configuration, body}};
    items_of(cursor);
    EXPECT_EQ(cursor.error(), error) << bytes;
    EXPECT_EQ(cursor.offset(), offset) << bytes;
    EXPECT_EQ(find_fault({OptionType::configuration, body}), error) << bytes;
  }
}

TEST(Option, IsJudgedByTheRulesOfItsType) {
  covers({"feat_req_someipsd_102", "feat_req_someipsd_790", "feat_req_someipsd_1253",
          "feat_req_someipsd_1251", "feat_req_someipsd_749"});
  const auto fault = [](std::uint8_t type, std::string_view bytes) {
    const auto body = hex(bytes);
    return find_fault({OptionType{type}, body});
  };
  EXPECT_EQ(fault(0x04, "00 0a000001 00 11 772d"), std::nullopt);
  EXPECT_EQ(fault(0x04, "00 0a000001 00 06 772d"), std::nullopt);
  EXPECT_EQ(fault(0x04, "00 0a000001 00 99 772d"), WireError::bad_value);  // neither TCP nor UDP
  EXPECT_EQ(fault(0x04, "00 0a000001 00 11 0000"), WireError::bad_value);  // port 0
  EXPECT_EQ(fault(0x04, "00 e0000001 00 11 772d"), WireError::bad_value);  // multicast address
  EXPECT_EQ(fault(0x14, "00 e0000001 00 11 772d"), std::nullopt);
  EXPECT_EQ(fault(0x14, "00 e0000001 00 06 772d"), WireError::bad_value);  // multicast over TCP
  EXPECT_EQ(fault(0x14, "00 0a000001 00 11 772d"), WireError::bad_value);  // unicast address
  EXPECT_EQ(fault(0x24, "00 0a000001 00 06 771a"), WireError::bad_value);  // SD over TCP
  EXPECT_EQ(fault(0x04, "00 0a000001 00 11 77"), WireError::bad_option_length);
  EXPECT_EQ(fault(0x02, "00 0001"), WireError::bad_option_length);
  EXPECT_EQ(fault(0x15, "00 91e0f0000001 22f0 0011223344556677"), std::nullopt);
  EXPECT_EQ(fault(0x15, "00 91e0f0000001 22"), WireError::bad_option_length);
  EXPECT_EQ(fault(0x77, "deadbeef"), std::nullopt);
  EXPECT_EQ(fault(0x77, ""), std::nullopt);
}

TEST(Option, SaysWhetherItMayBeDiscarded) {
  const auto body = hex("80 00");
  EXPECT_TRUE((Option{OptionType{0x77}, body}.discardable()));
  EXPECT_FALSE((Option{OptionType{0x77}, ByteView{body}.subspan(1)}.discardable()));
  EXPECT_FALSE((Option{OptionType{0x77}, {}}.discardable()));
}

}  // namespace
}  // namespace trestle::sd::option_test
