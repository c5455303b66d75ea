// Tagged members (AUTOSAR's TLV): written, read in any order, skipped when unknown.
#include <array>
#include <optional>
#include <string>

#include "someip/wire/payload_reader.hpp"
#include "someip/wire/payload_writer.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/someip/written.hpp"

namespace trestle::someip::tagged_payload_test {
namespace {
using test::covers;
using test::hex;
using test::to_hex;
using test::written;

std::string compact(std::string_view digits) {
  return to_hex(hex(digits));
}

/// Reads with `read` and tells the error and where it stands; "at N" without one.
template <typename Read>
std::string outcome(std::string_view bytes, const PayloadRules& rules, Read read) {
  const auto payload = hex(bytes);
  PayloadReader in{payload, rules};
  read(in);
  return (in.error() ? std::string{to_string(*in.error())} + " at " : "at ") + std::to_string(in.position());
}

/// Strings without BOM and terminator, as the library has them that made the foreign bytes below.
PayloadRules plain_strings() {
  return {.string_bom = false, .string_terminator = false};
}

TEST(Tag, HasAReservedBitThreeBitsOfWireTypeAndTwelveOfDataId) {
  EXPECT_EQ(to_number({WireType::bits8, DataId{0}}), 0x0000);
  EXPECT_EQ(to_number({WireType::bits16, DataId{1}}), 0x1001);
  EXPECT_EQ(to_number({WireType::length32, DataId{0xfff}}), 0x7fff);
  EXPECT_EQ(to_tag(0x5003), (Tag{WireType::length8, DataId{3}}));
  EXPECT_EQ(to_tag(0xafff), (Tag{WireType::bits32, DataId{0xfff}})) << "the reserved bit is ignored";
}

// The bytes of the next three tests are those that serde_someip (a library in Rust) asserts in its own
// tests: github.com/MortronMeymo/serde_someip, serde_someip/src/ser.rs.

struct Sample {
  std::int16_t first = 0;
  std::uint32_t second = 0;
  std::string third;
  friend bool operator==(const Sample&, const Sample&) = default;
};

Sample read_sample(PayloadReader& in) {
  Sample sample;
  while (const auto id = in.next_member()) {
    if (*id == DataId{1}) {
      sample.first = in.i16();
    } else if (*id == DataId{2}) {
      sample.second = in.u32();
    } else if (*id == DataId{3}) {
      sample.third = to_hex(in.byte_array());
    }
  }
  return sample;
}

TEST(TaggedPayload, AgreesWithSerdeSomeip) {
  constexpr PayloadRules rules{.struct_length = FieldWidth::bits16, .smallest_tagged_length = true};
  const auto members = [](PayloadWriter& out) {
    out.tagged(DataId{1}).i16(-1);
    out.tagged(DataId{2}).u32(42);
    out.tagged(DataId{3}).byte_array(hex("010203"));
  };
  const auto structure = [&](PayloadWriter& out) {
    const auto open = out.begin_struct();
    members(out);
    out.end(open);
  };
  EXPECT_EQ(written(rules, members), compact("1001 ffff 2002 0000002a 5003 03 010203"));
  EXPECT_EQ(written(rules, structure), compact("0010 1001 ffff 2002 0000002a 5003 03 010203"));

  const auto payload = hex("0010 1001 ffff 2002 0000002a 5003 03 010203");
  PayloadReader in{payload, rules};
  const auto open = in.begin_struct();
  EXPECT_EQ(read_sample(in), (Sample{-1, 42, "010203"}));
  in.end(open);
  EXPECT_FALSE(in.error());
  EXPECT_EQ(in.position(), payload.size());
}

TEST(TaggedPayload, EndsWithItsStructAlsoWhenNobodyReadsTheLastMember) {
  const auto payload = hex("0004 1001 ffff 002a");
  PayloadReader in{payload, {.struct_length = FieldWidth::bits16}};
  const auto open = in.begin_struct();
  EXPECT_EQ(in.next_member(), DataId{1});
  EXPECT_EQ(in.next_member(), std::nullopt);
  EXPECT_EQ(in.next_member(), std::nullopt);
  in.end(open);
  EXPECT_EQ(in.u16(), 42);  // has no tag
  EXPECT_FALSE(in.error());
}

TEST(TaggedPayload, ChoosesTheSmallestLengthField) {
  constexpr PayloadRules rules{.struct_length = FieldWidth::bits32, .smallest_tagged_length = true};
  EXPECT_EQ(written(rules,
                    [](PayloadWriter& out) {
                      const auto open = out.begin_struct();
                      out.tagged(DataId{0}).byte_array(hex("01020304"));
                      out.end(open);
                    }),
            compact("00000007 5000 04 01020304"));
}

TEST(TaggedPayload, LeavesOptionalMembersOut) {
  covers({"feat_req_someip_252"});
  constexpr PayloadRules rules{.struct_length = FieldWidth::bits8};
  const auto write = [](std::optional<std::uint32_t> member) {
    return [member](PayloadWriter& out) {
      const auto open = out.begin_struct();
      if (member) {
        out.tagged(DataId{0}).u32(*member);
      }
      out.end(open);
    };
  };
  EXPECT_EQ(written(rules, write(42)), compact("06 2000 0000002a"));
  EXPECT_EQ(written(rules, write(std::nullopt)), compact("00"));
}

TEST(TaggedPayload, HasAWireTypeForEachNumber) {
  const auto write = [](PayloadWriter& out) {
    out.tagged(DataId{0x001}).boolean(true);
    out.tagged(DataId{0x002}).u8(0x12);
    out.tagged(DataId{0x003}).u16(0x1234);
    out.tagged(DataId{0x004}).f32(1.5F);
    out.tagged(DataId{0x123}).u64(0x0123456789abcdef);
    out.tagged(DataId{0xfff}).f64(-2.25);
  };
  EXPECT_EQ(written({}, write), compact("0001 01  0002 12  1003 1234  2004 3fc00000"
                                        "3123 0123456789abcdef  3fff c002000000000000"));
  // Numbers have the payload's byte order; tags are big endian always.
  EXPECT_EQ(written({.byte_order = std::endian::little}, write),
            compact("0001 01  0002 12  1003 3412  2004 0000c03f"
                    "3123 efcdab8967452301  3fff 00000000000002c0"));
}

/// One member of each kind that has a length field.
void write_containers(PayloadWriter& out) {
  out.tagged(DataId{1}).string("hi");
  out.tagged(DataId{2}).fixed_string("hi", 4);
  const auto array = out.tagged(DataId{3}).begin_array();
  out.u16(1);
  out.u16(2);
  out.end(array);
  const auto pair = out.tagged(DataId{4}).begin_fixed_array();
  out.u16(3);
  out.u16(4);
  out.end(pair);
  const auto part = out.tagged(DataId{5}).begin_struct();
  out.u8(5);
  out.end(part);
  const auto choice = out.tagged(DataId{6}).begin_union(2);
  out.u16(6);
  out.end(choice);
}

// Wire type 4 and the configured length field. That of a fixed string, a fixed array and a struct appears for
// the tag's sake, that of a union counts the type field of 4 bytes: else nobody could skip what he does not
// know.
constexpr std::string_view containers_configured =
    "4001 0002 6869"
    "4002 0004 68690000"
    "4003 0004 0001 0002"
    "4004 0004 0003 0004"
    "4005 0001 05"
    "4006 0006 00000002 0006";
// The same with wire type 5, which says that the length has 8 bits.
constexpr std::string_view containers_announced =
    "5001 02 6869"
    "5002 04 68690000"
    "5003 04 0001 0002"
    "5004 04 0003 0004"
    "5005 01 05"
    "5006 06 00000002 0006";

TEST(TaggedPayload, PutsALengthFieldBehindEachTagThatIsNoNumbers) {
  PayloadRules rules = plain_strings();
  rules.tagged_length = FieldWidth::bits16;
  EXPECT_EQ(written(rules, write_containers), compact(containers_configured));
  rules.smallest_tagged_length = true;
  EXPECT_EQ(written(rules, write_containers), compact(containers_announced));
  rules = plain_strings();
  rules.tagged_length = FieldWidth::none;
  EXPECT_EQ(written(rules, write_containers), "!bad_tag");
}

TEST(TaggedPayload, HasLengthAndTypeFieldsInNetworkByteOrderAlways) {
  covers({"feat_req_someip_675"});
  PayloadRules rules = plain_strings();
  rules.byte_order = std::endian::little;
  rules.tagged_length = FieldWidth::bits16;
  EXPECT_EQ(written(rules, write_containers), compact("4001 0002 6869"
                                                      "4002 0004 68690000"
                                                      "4003 0004 0100 0200"
                                                      "4004 0004 0300 0400"
                                                      "4005 0001 05"
                                                      "4006 0006 00000002 0600"));
  rules.length_fields_always_big = false;  // leaves the tags as they are
  EXPECT_EQ(written(rules, write_containers), compact("4001 0200 6869"
                                                      "4002 0400 68690000"
                                                      "4003 0400 0100 0200"
                                                      "4004 0400 0300 0400"
                                                      "4005 0100 05"
                                                      "4006 0600 02000000 0600"));
}

TEST(TaggedPayload, ReadsEveryWidthOfLengthField) {
  PayloadRules rules = plain_strings();
  rules.tagged_length = FieldWidth::bits16;
  const auto check = [&](std::string_view bytes) {
    SCOPED_TRACE(bytes);
    const auto payload = hex(bytes);
    PayloadReader in{payload, rules};
    std::array<char, 16> room{};
    EXPECT_EQ(in.next_member(), DataId{1});
    EXPECT_EQ(in.string(room), "hi");
    EXPECT_EQ(in.next_member(), DataId{2});
    EXPECT_EQ(in.fixed_string(4, room), "hi");
    EXPECT_EQ(in.next_member(), DataId{3});
    auto array = in.begin_array();
    EXPECT_TRUE(in.more(array));
    EXPECT_EQ(in.u16(), 1);
    EXPECT_TRUE(in.more(array));
    EXPECT_EQ(in.u16(), 2);
    EXPECT_FALSE(in.more(array));
    in.end(array);
    EXPECT_EQ(in.next_member(), DataId{4});
    const auto pair = in.begin_fixed_array();
    EXPECT_EQ(in.u16(), 3);
    EXPECT_EQ(in.u16(), 4);
    in.end(pair);
    EXPECT_EQ(in.next_member(), DataId{5});
    const auto part = in.begin_struct();
    EXPECT_EQ(in.u8(), 5);
    in.end(part);
    EXPECT_EQ(in.next_member(), DataId{6});
    const auto choice = in.begin_union(2);
    EXPECT_EQ(choice.type, 2U);
    EXPECT_EQ(in.u16(), 6);
    in.end(choice.open);
    EXPECT_EQ(in.next_member(), std::nullopt);
    EXPECT_FALSE(in.error());
    EXPECT_EQ(in.position(), payload.size());
  };
  check(containers_configured);
  check(containers_announced);
  // Senders may mix: wire types 6, 7, 5, 6, 7 and 4.
  check(
      "6001 0002 6869"
      "7002 00000004 68690000"
      "5003 04 0001 0002"
      "6004 0004 0003 0004"
      "7005 00000001 05"
      "4006 0006 00000002 0006");
}

TEST(TaggedPayload, GrowsTheLengthFieldWithTheContents) {
  PayloadRules rules = plain_strings();
  rules.smallest_tagged_length = true;
  const auto text_of = [&](std::size_t size) {
    return written(rules, [&](PayloadWriter& out) { out.tagged(DataId{1}).string(std::string(size, 'x')); })
        .substr(0, 12);
  };
  EXPECT_EQ(text_of(0), compact("5001 00"));
  EXPECT_EQ(text_of(255), compact("5001 ff 787878"));
  EXPECT_EQ(text_of(256), compact("6001 0100 7878"));
  std::vector<std::byte> room(70000);
  PayloadWriter out{room, rules};
  out.tagged(DataId{1}).string(std::string(65536, 'x'));
  out.tagged(DataId{2}).u8(9);
  const auto payload = out.finish();
  ASSERT_TRUE(payload);
  ASSERT_EQ(payload->size(), 2U + 4U + 65536U + 3U);
  EXPECT_EQ(to_hex(payload->first(8)), compact("7001 00010000 7878"));
  EXPECT_EQ(to_hex(payload->last(5)), compact("7878 0002 09"));
}

TEST(TaggedPayload, NestsTaggedStructs) {
  PayloadRules rules = plain_strings();
  rules.smallest_tagged_length = true;
  EXPECT_EQ(written(rules,
                    [](PayloadWriter& out) {
                      const auto outer = out.tagged(DataId{1}).begin_struct();
                      const auto inner = out.tagged(DataId{1}).begin_struct();
                      out.tagged(DataId{7}).string("abc");
                      out.end(inner);
                      out.tagged(DataId{2}).u8(0xff);
                      out.end(outer);
                      out.tagged(DataId{3}).u8(0xee);
                    }),
            // 3 characters; 2 + 1 + 3; 2 + 1 + 6 and 2 + 1
            compact("5001 0c  5001 06  5007 03 616263  0002 ff  0003 ee"));
}

TEST(TaggedPayload, TakesMembersInAnyOrderAndSkipsTheUnknown) {
  covers({"feat_req_someip_601", "feat_req_someipcompat_1198"});
  PayloadRules rules;
  rules.tagged_length = FieldWidth::bits16;
  // Members 3, 9 (of each wire type), 1 and 2, which are behind one another as above.
  const auto payload =
      hex("4003 0003 010203"
          "0009 01  1009 0102  2009 01020304  3009 0102030405060708"
          "4009 0002 0102  5009 01 01  6009 0000  7009 00000003 010203"
          "1001 ffff"
          "2002 0000002a");
  PayloadReader in{payload, rules};
  EXPECT_EQ(read_sample(in), (Sample{-1, 42, "010203"}));
  EXPECT_FALSE(in.error());
  EXPECT_EQ(in.position(), payload.size());
}

TEST(TaggedPayload, KeepsTheDefaultsOfMissingMembers) {
  covers({"feat_req_someipcompat_1200"});
  const auto payload = hex("2002 0000002a");
  PayloadReader in{payload};
  EXPECT_EQ(read_sample(in), (Sample{0, 42, ""}));
  EXPECT_FALSE(in.error());
}

TEST(TaggedPayload, RefusesWireTypesThatAreNotTheMembers) {
  const auto u16 = [](PayloadReader& in) {
    EXPECT_EQ(in.next_member(), DataId{1});
    EXPECT_EQ(in.u16(), 0);
  };
  EXPECT_EQ(outcome("0001 0102", {}, u16), "bad_tag at 2");
  EXPECT_EQ(outcome("2001 01020304", {}, u16), "bad_tag at 2");
  EXPECT_EQ(outcome("5001 02 0102", {}, u16), "bad_tag at 2");
  const auto array = [](PayloadReader& in) {
    EXPECT_EQ(in.next_member(), DataId{1});
    EXPECT_TRUE(in.byte_array().empty());
  };
  EXPECT_EQ(outcome("3001 0000000401020304", {}, array), "bad_tag at 2");
  EXPECT_EQ(outcome("4001 0000000401020304", {.tagged_length = FieldWidth::none}, array), "bad_tag at 2");
  const auto raw = [](PayloadReader& in) {
    EXPECT_EQ(in.next_member(), DataId{1});
    EXPECT_TRUE(in.bytes(1).empty());
  };
  EXPECT_EQ(outcome("0001 01", {}, raw), "bad_tag at 2");
}

TEST(TaggedPayload, RefusesTagsAndLengthsBeyondTheEnd) {
  const auto all = [](PayloadReader& in) {
    while (in.next_member()) {
    }
  };
  EXPECT_EQ(outcome("", {}, all), "at 0");
  EXPECT_EQ(outcome("10", {}, all), "truncated at 0");
  EXPECT_EQ(outcome("1001 01", {}, all), "truncated at 2");
  EXPECT_EQ(outcome("3001 01020304050607", {}, all), "truncated at 2");
  EXPECT_EQ(outcome("4001 000000", {}, all), "truncated at 2");
  EXPECT_EQ(outcome("4001 00000002 01", {}, all), "truncated at 2");
  EXPECT_EQ(outcome("5001 ff 01", {}, all), "truncated at 2");
  EXPECT_EQ(outcome("7001 ffffffff 01", {}, all), "truncated at 2");
  // Beyond what holds the member, though not beyond the payload.
  const auto within = [&](PayloadReader& in) {
    const auto open = in.begin_struct();
    all(in);
    in.end(open);
  };
  EXPECT_EQ(outcome("03 1001 01 0203", {.struct_length = FieldWidth::bits8}, within), "bad_length at 3");
  EXPECT_EQ(outcome("05 5001 03 0102 03", {.struct_length = FieldWidth::bits8}, within), "bad_length at 3");
  EXPECT_EQ(outcome("01 1001 01 0203", {.struct_length = FieldWidth::bits8}, within), "bad_length at 1");
}

TEST(TaggedPayload, RefusesToWriteWhatNobodyCouldSkip) {
  EXPECT_EQ(written({}, [](PayloadWriter& out) { out.tagged(DataId{0x1000}).u8(1); }), "!bad_tag");
  EXPECT_EQ(written({}, [](PayloadWriter& out) { out.tagged(DataId{1}).bytes(hex("01")); }), "!bad_tag");
  EXPECT_EQ(written({}, [](PayloadWriter& out) { out.tagged(DataId{1}).tagged(DataId{2}).u8(1); }),
            "!bad_tag");
  EXPECT_EQ(written({}, [](PayloadWriter& out) { out.tagged(DataId{1}); }), "!bad_tag");
  EXPECT_EQ(written({},
                    [](PayloadWriter& out) {
                      const auto open = out.begin_struct();
                      out.tagged(DataId{1});
                      out.end(open);
                    }),
            "!bad_tag");
  EXPECT_EQ(
      written({.tagged_length = FieldWidth::bits8},
              [](PayloadWriter& out) { out.tagged(DataId{1}).byte_array(std::vector<std::byte>(256)); }),
      "!bad_length");
}

TEST(TaggedPayload, ExcludesAlignment) {
  EXPECT_EQ(written({.alignment = 4}, [](PayloadWriter& out) { out.tagged(DataId{1}).u8(1); }), "!bad_tag");
  EXPECT_EQ(outcome("0001 01", {.alignment = 4}, [](PayloadReader& in) { EXPECT_FALSE(in.next_member()); }),
            "bad_tag at 0");
}

TEST(Union, MayBeEmptyWhereTheRulesSaySo) {
  covers({"feat_req_someip_273"});
  const auto write = [](PayloadWriter& out) {
    const auto open = out.begin_union(0);
    out.end(open);
  };
  EXPECT_EQ(written({}, write), "!bad_union_type");
  EXPECT_EQ(written({.union_null = true}, write), compact("00000000 00000000"));
  const auto read = [](PayloadReader& in) {
    const auto choice = in.begin_union(2);
    EXPECT_EQ(choice.type, 0U);
    in.end(choice.open);
  };
  EXPECT_EQ(outcome("00000000 00000000", {}, read), "bad_union_type at 0");
  EXPECT_EQ(outcome("00000000 00000000", {.union_null = true}, read), "at 8");
  EXPECT_EQ(outcome("00000002 00000000 ffff", {.union_null = true}, read), "at 10") << "padding is skipped";
  EXPECT_EQ(outcome("00000002 00000003 ffff", {.union_null = true}, read), "bad_union_type at 0");
}

TEST(PayloadReader, TellsWhereAnOlderMessageEnds) {
  covers({"feat_req_someipcompat_1200"});
  constexpr PayloadRules rules{.struct_length = FieldWidth::bits8};
  // A struct of one byte, then another; the interface has since got a second byte in the struct and a third
  // parameter.
  const auto payload = hex("01 07  08");
  PayloadReader in{payload, rules};
  const auto open = in.begin_struct();
  EXPECT_FALSE(in.at_end());
  EXPECT_EQ(in.u8(), 7);
  EXPECT_TRUE(in.at_end());
  in.end(open);
  EXPECT_FALSE(in.at_end());
  EXPECT_EQ(in.u8(), 8);
  EXPECT_TRUE(in.at_end());
  EXPECT_EQ(in.u8(), 0);
  EXPECT_FALSE(in.at_end()) << "after a failure";
}

TEST(PayloadReader, CutsLongerArraysUnlessTheRulesForbidIt) {
  covers({"feat_req_someipcompat_1199"});
  const auto two = [](PayloadReader& in) {
    auto array = in.begin_array();
    EXPECT_TRUE(in.more(array));
    EXPECT_EQ(in.u8(), 1);
    EXPECT_EQ(in.u8(), 2);
    in.end(array);
    EXPECT_EQ(in.u8(), in.error() ? 0 : 9);
  };
  EXPECT_EQ(outcome("00000004 01020304 09", {}, two), "at 9");
  EXPECT_EQ(outcome("00000004 01020304 09", {.cut_longer_arrays = false}, two), "bad_length at 6");
  const auto fixed = [](PayloadReader& in) {
    const auto array = in.begin_fixed_array();
    EXPECT_EQ(in.u8(), 1);
    in.end(array);
  };
  EXPECT_EQ(outcome("03 010203", {.fixed_array_length = FieldWidth::bits8}, fixed), "at 4");
  EXPECT_EQ(
      outcome("03 010203", {.fixed_array_length = FieldWidth::bits8, .cut_longer_arrays = false}, fixed),
      "bad_length at 2");
}

// Nothing but the bytes tells how many elements an array has: a reader would find none there.
TEST(PayloadWriter, RefusesAnElementOfAnArrayThatTakesNoBytes) {
  const auto outcome_of = [](const PayloadRules& rules, const auto& write) {
    std::array<std::byte, 64> room{};
    PayloadWriter out{room, rules};
    write(out);
    const auto payload = out.finish();
    return payload ? to_hex(*payload) : std::string{to_string(payload.error())};
  };
  const auto without_members = [](PayloadWriter& out) {
    const auto array = out.begin_array();
    const auto one = out.begin_struct();  // whose tagged members are all optional, and not there
    out.end(one);
    out.end(array);
  };
  EXPECT_EQ(outcome_of({}, without_members), "bad_length");
  EXPECT_EQ(outcome_of({.struct_length = FieldWidth::bits8}, without_members), "0000000100");
  const auto second = [](PayloadWriter& out) {
    const auto array = out.begin_array();
    const auto one = out.begin_struct();
    out.u8(7);
    out.end(one);
    const auto two = out.begin_fixed_array();
    const auto none = out.begin_struct();
    out.end(none);
    out.end(two);
    out.end(array);
  };
  EXPECT_EQ(outcome_of({}, second), "bad_length");
  const auto elsewhere = [](PayloadWriter& out) {
    const auto none = out.begin_struct();
    out.end(none);
    const auto fixed = out.begin_fixed_array();  // the interface says how many
    out.end(out.begin_struct());
    out.end(out.begin_struct());
    out.end(fixed);
    const auto array = out.begin_array();
    const auto one = out.begin_struct();
    out.end(out.begin_struct());  // a member, beside which there are others
    out.u8(7);
    out.end(one);
    out.end(out.begin_array());
    out.end(array);
    out.end(out.begin_struct());
  };
  EXPECT_EQ(outcome_of({}, elsewhere),
            "00000005"
            "07"
            "00000000");
}

}  // namespace
}  // namespace trestle::someip::tagged_payload_test
