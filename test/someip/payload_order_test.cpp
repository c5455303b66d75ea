// Parameters with a byte order of their own.
#include "someip/wire/payload_reader.hpp"
#include "someip/wire/payload_writer.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/someip/written.hpp"

namespace trestle::someip::payload_order_test {
namespace {
using std::endian;
using test::covers;
using test::hex;
using test::to_hex;
using test::written;

/// Numbers of all kinds in the order of the rules, in the other one, and again in that of the rules.
void write_orders(PayloadWriter& out, endian other) {
  out.u16(0x0102);
  const endian before = out.byte_order(other);
  out.u8(3);
  out.u16(0x0405);
  out.u32(0x06070809);
  out.u64(0x0a0b0c0d0e0f1011);
  out.i16(-2);
  out.i32(-2);
  out.i64(-2);
  out.f32(1.5F);
  out.f64(-2.25);
  EXPECT_EQ(out.byte_order(before), other);
  out.u32(0x12131415);
}

void read_orders(std::string_view bytes, const PayloadRules& rules, endian other) {
  const auto payload = hex(bytes);
  PayloadReader in{payload, rules};
  EXPECT_EQ(in.u16(), 0x0102);
  const endian before = in.byte_order(other);
  EXPECT_EQ(before, rules.byte_order);
  EXPECT_EQ(in.u8(), 3);
  EXPECT_EQ(in.u16(), 0x0405);
  EXPECT_EQ(in.u32(), 0x06070809U);
  EXPECT_EQ(in.u64(), 0x0a0b0c0d0e0f1011U);
  EXPECT_EQ(in.i16(), -2);
  EXPECT_EQ(in.i32(), -2);
  EXPECT_EQ(in.i64(), -2);
  EXPECT_EQ(in.f32(), 1.5F);
  EXPECT_EQ(in.f64(), -2.25);
  EXPECT_EQ(in.byte_order(before), other);
  EXPECT_EQ(in.u32(), 0x12131415U);
  EXPECT_FALSE(in.error());
  EXPECT_TRUE(in.at_end());
}

TEST(PayloadByteOrder, IsThatOfEachParameter) {
  covers({"feat_req_someip_224"});
  const std::string_view little_within_big =
      "0102 03 0504 09080706 11100f0e0d0c0b0a feff feffffff feffffffffffffff 0000c03f 00000000000002c0 "
      "12131415";
  EXPECT_EQ(written({}, [](PayloadWriter& out) { write_orders(out, endian::little); }),
            to_hex(hex(little_within_big)));
  read_orders(little_within_big, {}, endian::little);

  const PayloadRules little{.byte_order = endian::little};
  const std::string_view big_within_little =
      "0201 03 0405 06070809 0a0b0c0d0e0f1011 fffe fffffffe fffffffffffffffe 3fc00000 c002000000000000 "
      "15141312";
  EXPECT_EQ(written(little, [](PayloadWriter& out) { write_orders(out, endian::big); }),
            to_hex(hex(big_within_little)));
  read_orders(big_within_little, little, endian::big);
}

/// An array, a union and a tagged number in the other byte order than the rules'.
void expect_fields(const PayloadRules& rules, endian other, std::string_view bytes) {
  EXPECT_EQ(written(rules,
                    [&](PayloadWriter& out) {
                      const endian before = out.byte_order(other);
                      const auto array = out.begin_array();
                      out.u16(0x0102);
                      out.u16(0x0304);
                      out.end(array);
                      const auto choice = out.begin_union(5);
                      out.u16(0x0607);
                      out.end(choice);
                      out.string("hi");
                      out.tagged(DataId{8}).u16(0x090a);
                      out.byte_order(before);
                      out.tagged(DataId{11}).u16(0x0c0d);
                    }),
            to_hex(hex(bytes)));
  const auto payload = hex(bytes);
  PayloadReader in{payload, rules};
  const endian before = in.byte_order(other);
  auto array = in.begin_array();
  EXPECT_TRUE(in.more(array));
  EXPECT_EQ(in.u16(), 0x0102);
  EXPECT_TRUE(in.more(array));
  EXPECT_EQ(in.u16(), 0x0304);
  EXPECT_FALSE(in.more(array));
  in.end(array);
  const auto choice = in.begin_union(5);
  EXPECT_EQ(choice.type, 5U);
  EXPECT_EQ(in.u16(), 0x0607);
  in.end(choice.open);
  EXPECT_EQ(in.string({}), "hi");
  EXPECT_EQ(in.next_member(), DataId{8});
  EXPECT_EQ(in.u16(), 0x090a);
  in.byte_order(before);
  EXPECT_EQ(in.next_member(), DataId{11});
  EXPECT_EQ(in.u16(), 0x0c0d);
  EXPECT_FALSE(in.error());
  EXPECT_TRUE(in.at_end());
}

TEST(PayloadByteOrder, LeavesLengthAndTypeFieldsAndTagsAlone) {
  covers({"feat_req_someip_224", "feat_req_someip_675"});
  expect_fields({}, endian::little,
                "00000004 0201 0403  00000002 00000005 0706  00000006 efbbbf 6869 00  1008 0a09 100b 0c0d");
  expect_fields({.byte_order = endian::little}, endian::big,
                "00000004 0102 0304  00000002 00000005 0607  00000006 efbbbf 6869 00  1008 090a 100b 0d0c");
  PayloadRules as_payload = commonapi_rules;
  as_payload.byte_order = endian::little;
  expect_fields(as_payload, endian::big,
                "04000000 0102 0304  02000000 05000000 0607  06000000 efbbbf 6869 00  1008 090a 100b 0d0c");
}

}  // namespace
}  // namespace trestle::someip::payload_order_test
