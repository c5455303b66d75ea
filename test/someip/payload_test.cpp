#include <array>
#include <optional>
#include <string>

#include "someip/wire/payload_reader.hpp"
#include "someip/wire/payload_writer.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/someip/written.hpp"

namespace trestle::someip::payload_test {
namespace {
using test::covers;
using test::hex;
using test::to_hex;
using test::written;

TEST(PayloadWriter, WritesBasicTypesInBothByteOrders) {
  covers({"feat_req_someip_682", "feat_req_someip_172", "feat_req_someip_230", "feat_req_someip_652",
          "feat_req_someip_574", "feat_req_someip_817", "feat_req_someip_169", "feat_req_someip_575",
          "feat_req_someip_623"});
  const auto write = [](PayloadWriter& out) {
    out.boolean(true);
    out.u8(0xfe);
    out.u16(0x1234);
    out.u32(0x12345678);
    out.u64(0x0123456789abcdef);
    out.i8(-2);
    out.i16(-2);
    out.i32(-2);
    out.i64(-2);
    out.f32(1.5F);
    out.f64(-2.25);
  };
  EXPECT_EQ(written({}, write),
            "01fe1234123456780123456789abcdeffefffefffffffefffffffffffffffe3fc00000c002000000000000");
  EXPECT_EQ(written({.byte_order = std::endian::little}, write),
            "01fe341278563412efcdab8967452301fefefffeffffff"
            "feffffffffffffff0000c03f00000000000002c0");
}

TEST(PayloadReader, ReadsBasicTypesInBothByteOrders) {
  covers({"feat_req_someip_682", "feat_req_someip_623"});
  const auto check = [](std::string_view bytes, std::endian order) {
    const auto payload = hex(bytes);
    PayloadReader in{payload, {.byte_order = order}};
    EXPECT_TRUE(in.boolean());
    EXPECT_EQ(in.u8(), 0xfe);
    EXPECT_EQ(in.u16(), 0x1234);
    EXPECT_EQ(in.u32(), 0x12345678U);
    EXPECT_EQ(in.u64(), 0x0123456789abcdefU);
    EXPECT_EQ(in.i8(), -2);
    EXPECT_EQ(in.i16(), -2);
    EXPECT_EQ(in.i32(), -2);
    EXPECT_EQ(in.i64(), -2);
    EXPECT_EQ(in.f32(), 1.5F);
    EXPECT_EQ(in.f64(), -2.25);
    EXPECT_FALSE(in.error());
    EXPECT_EQ(in.position(), payload.size());
  };
  check("01fe1234123456780123456789abcdeffefffefffffffefffffffffffffffe3fc00000c002000000000000",
        std::endian::big);
  check("01fe341278563412efcdab8967452301fefefffefffffffeffffffffffffff0000c03f00000000000002c0",
        std::endian::little);
}

TEST(PayloadReader, LooksAtTheLowestBitOfABooleanOnly) {
  covers({"feat_req_someip_817"});
  const auto payload = hex("00 01 02 03 fe ff");
  PayloadReader in{payload};
  EXPECT_FALSE(in.boolean());
  EXPECT_TRUE(in.boolean());
  EXPECT_FALSE(in.boolean());
  EXPECT_TRUE(in.boolean());
  EXPECT_FALSE(in.boolean());
  EXPECT_TRUE(in.boolean());
}

/// Little endian payloads of a number and of each kind of length and type field, written and read.
void expect_little_endian(PayloadRules rules, std::string_view bytes) {
  rules.byte_order = std::endian::little;
  rules.array_length = rules.struct_length = rules.union_type = FieldWidth::bits16;
  rules.fixed_array_length = FieldWidth::bits32;
  EXPECT_EQ(written(rules,
                    [](PayloadWriter& out) {
                      const auto all = out.begin_struct();
                      out.u32(0x12345678);
                      const auto array = out.begin_array();
                      out.u16(0x1234);
                      out.end(array);
                      const auto pair = out.begin_fixed_array();
                      out.u8(1);
                      out.u8(2);
                      out.end(pair);
                      out.string("hi");
                      const auto choice = out.begin_union(3);
                      out.u16(0x5678);
                      out.end(choice);
                      out.end(all);
                    }),
            to_hex(hex(bytes)));
  const auto payload = hex(bytes);
  PayloadReader in{payload, rules};
  std::array<char, 8> room{};
  const auto all = in.begin_struct();
  EXPECT_EQ(in.u32(), 0x12345678U);
  auto array = in.begin_array();
  EXPECT_TRUE(in.more(array));
  EXPECT_EQ(in.u16(), 0x1234);
  EXPECT_FALSE(in.more(array));
  in.end(array);
  const auto pair = in.begin_fixed_array();
  EXPECT_EQ(in.u8(), 1);
  EXPECT_EQ(in.u8(), 2);
  in.end(pair);
  EXPECT_EQ(in.string(room), "hi");
  const auto choice = in.begin_union(3);
  EXPECT_EQ(choice.type, 3U);
  EXPECT_EQ(in.u16(), 0x5678);
  in.end(choice.open);
  in.end(all);
  EXPECT_FALSE(in.error());
  EXPECT_EQ(in.position(), payload.size());
}

TEST(Payload, HasLengthAndTypeFieldsInNetworkByteOrderAlways) {
  covers({"feat_req_someip_675"});
  expect_little_endian({},
                       "0020"                     // struct: 32 bytes follow
                       "78563412"                 // a number, as the payload
                       "0002 3412"                // array
                       "00000002 0102"            // array of fixed size
                       "00000006 efbbbf 6869 00"  // string
                       "00000002 0003 7856");     // union: length, type, a number
}

TEST(Payload, HasLengthAndTypeFieldsInItsOwnByteOrderForCommonApi) {
  expect_little_endian(commonapi_rules,
                       "2000"
                       "78563412"
                       "0200 3412"
                       "02000000 0102"
                       "06000000 efbbbf 6869 00"
                       "02000000 0300 7856");
}

TEST(PayloadReader, RefusesLengthsInTheWrongByteOrder) {
  covers({"feat_req_someip_675"});
  const auto error = [](PayloadRules rules, std::string_view bytes) {
    rules.byte_order = std::endian::little;
    const auto payload = hex(bytes);
    PayloadReader in{payload, rules};
    static_cast<void>(in.byte_array());
    return in.error();
  };
  EXPECT_EQ(error({}, "00000002 0102"), std::nullopt);
  EXPECT_EQ(error({}, "02000000 0102"), WireError::truncated);
  EXPECT_EQ(error(commonapi_rules, "02000000 0102"), std::nullopt);
  EXPECT_EQ(error(commonapi_rules, "00000002 0102"), WireError::truncated);
}

TEST(PayloadWriter, GivesEachDimensionOfAnArrayItsLength) {
  covers({"feat_req_someip_254", "feat_req_someip_257", "feat_req_someip_259", "feat_req_someip_621"});
  EXPECT_EQ(written({.array_length = FieldWidth::bits16},
                    [](auto& out) {
                      const auto rows = out.begin_array();
                      for (const int columns : {2, 0, 1}) {
                        const auto row = out.begin_array();
                        for (int i = 0; i < columns; ++i) {
                          out.u16(0xabcd);
                        }
                        out.end(row);
                      }
                      out.end(rows);
                    }),
            "000c"
            "0004abcdabcd"
            "0000"
            "0002abcd");
  EXPECT_EQ(written({}, [](auto& out) { out.byte_array(hex("010203")); }), "00000003010203");
  EXPECT_EQ(written({.fixed_array_length = FieldWidth::bits8},
                    [](auto& out) {
                      const auto array = out.begin_fixed_array();
                      out.u16(1);
                      out.u16(2);
                      out.end(array);
                    }),
            "0400010002");
}

TEST(PayloadWriter, WritesArraysOfFixedSizeRowAfterRow) {
  covers({"feat_req_someip_241", "feat_req_someip_243", "feat_req_someip_246"});
  const std::array<std::array<std::uint16_t, 3>, 2> rows{
      {{0x0a0b, 0x1a1b, 0x2a2b}, {0x3a3b, 0x4a4b, 0x5a5b}}};
  EXPECT_EQ(written({},
                    [&](auto& out) {
                      const auto outer = out.begin_fixed_array();
                      for (const auto& row : rows) {
                        const auto inner = out.begin_fixed_array();
                        for (const std::uint16_t number : row) {
                          out.u16(number);
                        }
                        out.end(inner);
                      }
                      out.end(outer);
                      out.u8(0x77);
                    }),
            "0a0b1a1b2a2b"
            "3a3b4a4b5a5b"
            "77");
  const auto payload = hex("0a0b1a1b2a2b 3a3b4a4b5a5b 77");
  PayloadReader in{payload};
  const auto outer = in.begin_fixed_array();
  for (const auto& row : rows) {
    const auto inner = in.begin_fixed_array();
    for (const std::uint16_t number : row) {
      EXPECT_EQ(in.u16(), number);
    }
    in.end(inner);
  }
  in.end(outer);
  EXPECT_EQ(in.u8(), 0x77);
  EXPECT_FALSE(in.error());
}

TEST(PayloadWriter, WritesAnOptionalElementAsAnArrayOfOneOrNone) {
  covers({"feat_req_someip_252"});
  const auto write = [](std::optional<std::uint16_t> value) {
    return [value](PayloadWriter& out) {
      const auto optional = out.begin_array();
      if (value) {
        out.u16(*value);
      }
      out.end(optional);
      out.u8(0x77);
    };
  };
  EXPECT_EQ(written({}, write(0x1234)), "00000002123477");
  EXPECT_EQ(written({}, write({})), "0000000077");
  const auto payload = hex("00000002 1234  00000000  77");
  PayloadReader in{payload};
  auto present = in.begin_array();
  ASSERT_TRUE(in.more(present));
  EXPECT_EQ(in.u16(), 0x1234);
  EXPECT_FALSE(in.more(present));
  in.end(present);
  auto absent = in.begin_array();
  EXPECT_FALSE(in.more(absent));
  in.end(absent);
  EXPECT_EQ(in.u8(), 0x77);
  EXPECT_FALSE(in.error());
}

TEST(PayloadWriter, CarriesEnumerationsAndBitFieldsAsTheNumbersThatTheyAre) {
  covers({"feat_req_someip_689"});
  enum class Gear : std::uint8_t { park = 0, drive = 1 };
  EXPECT_EQ(written({},
                    [](auto& out) {
                      out.u8(static_cast<std::uint8_t>(Gear::drive));
                      out.u8(0b1000'0001);
                      out.u16(0b1000'0000'0000'0001);
                      out.u32(0x8000'0001);
                    }),
            "0181800180000001");
  const auto payload = hex("01 81 8001 80000001");
  PayloadReader in{payload};
  EXPECT_EQ(static_cast<Gear>(in.u8()), Gear::drive);
  EXPECT_EQ(in.u8(), 0b1000'0001);
  EXPECT_EQ(in.u16(), 0b1000'0000'0000'0001);
  EXPECT_EQ(in.u32(), 0x8000'0001U);
  EXPECT_FALSE(in.error());
}

TEST(PayloadReader, RefusesArraysWhoseLengthDoesNotFit) {
  covers({"feat_req_someip_254"});
  const auto sum = [](std::string_view bytes) {
    const auto payload = hex(bytes);
    PayloadReader in{payload};
    auto array = in.begin_array();
    unsigned result = 0;
    while (in.more(array)) {
      result += in.u16();
    }
    in.end(array);
    return in.error() ? std::string{"!"} + to_string(*in.error()) : std::to_string(result);
  };
  EXPECT_EQ(sum("00000004 0001 0002"), "3");
  EXPECT_EQ(sum("00000000"), "0");
  EXPECT_EQ(sum("00000003 0001 0002"), "!bad_length") << "no multiple of the element";
  EXPECT_EQ(sum("00000005 0001 0002"), "!truncated") << "beyond the payload";
  EXPECT_EQ(sum("ffffffff 0001 0002"), "!truncated");
  EXPECT_EQ(sum("000000"), "!truncated");
}

TEST(PayloadReader, RefusesAnInnerLengthBeyondTheOuter) {
  const auto payload = hex("00000006 00000004 0102 0304");
  PayloadReader in{payload};
  const auto outer = in.begin_array();
  EXPECT_EQ(in.byte_array().size(), 0U);
  EXPECT_EQ(in.error(), WireError::bad_length);
  in.end(outer);
  EXPECT_EQ(in.u8(), 0) << "nothing is read after a failure";
}

TEST(PayloadReader, DoesNotLoopOverElementsThatTakeNoBytes) {
  const auto payload = hex("00000002 0102");
  PayloadReader in{payload};
  auto array = in.begin_array();
  int rounds = 0;
  while (in.more(array)) {
    ++rounds;
  }
  EXPECT_EQ(rounds, 1);
  EXPECT_EQ(in.error(), WireError::bad_length);
}

TEST(PayloadWriter, WritesNoLengthOfAStructUnlessTold) {
  covers({"feat_req_someip_602"});
  EXPECT_EQ(written({},
                    [](PayloadWriter& out) {
                      const auto point = out.begin_struct();
                      out.u8(7);
                      out.u16(0x0102);
                      out.end(point);
                    }),
            "070102");
  const auto payload = hex("07 0102");
  PayloadReader in{payload};
  const auto point = in.begin_struct();
  EXPECT_EQ(in.u8(), 7);
  EXPECT_EQ(in.u16(), 0x0102);
  in.end(point);
  EXPECT_FALSE(in.error());
}

TEST(PayloadReader, SkipsWhatANewerInterfaceAppendedToAStruct) {
  covers({"feat_req_someip_600", "feat_req_someip_601", "feat_req_someipcompat_1199"});
  const PayloadRules rules{.struct_length = FieldWidth::bits8};
  const auto payload = hex("06 07 01020304 99  55");
  PayloadReader in{payload, rules};
  const auto header = in.begin_struct();
  EXPECT_EQ(in.u8(), 7);
  const std::size_t rest = in.rest(header);
  EXPECT_EQ(in.u32(), 0x01020304U);
  EXPECT_EQ(rest, in.rest(header) + 4);
  in.end(header);
  EXPECT_EQ(in.u8(), 0x55);
  EXPECT_FALSE(in.error());
  const auto too_short = hex("03 07 01020304");
  PayloadReader strict{too_short, rules};
  const auto open = strict.begin_struct();
  strict.u8();
  EXPECT_EQ(strict.u32(), 0U);
  strict.end(open);
  EXPECT_EQ(strict.error(), WireError::bad_length);
}

TEST(PayloadWriter, WritesUnionsInBothOrders) {
  covers({"feat_req_someip_264", "feat_req_someip_573", "feat_req_someip_566", "feat_req_someip_565",
          "feat_req_someip_272", "feat_req_someip_273", "feat_req_someip_563", "feat_req_someip_564"});
  const auto write = [](PayloadWriter& out) {
    const auto choice = out.begin_union(2);
    out.u32(6);
    out.end(choice);
  };
  EXPECT_EQ(written({}, write),
            "00000004"
            "00000002"
            "00000006");
  EXPECT_EQ(written({.union_length = FieldWidth::bits8, .union_type = FieldWidth::bits16}, write),
            "04"
            "0002"
            "00000006");
  EXPECT_EQ(
      written(
          {.union_length = FieldWidth::bits8, .union_type = FieldWidth::bits16, .union_length_first = false},
          write),
      "0002"
      "04"
      "00000006");
  EXPECT_EQ(written({.union_type = FieldWidth::bits8}, [](auto& out) { out.end(out.begin_union(256)); }),
            "!bad_union_type");
}

TEST(PayloadWriter, PadsUnionsWithoutLengthToTheLongestMember) {
  covers({"feat_req_someip_571", "feat_req_someip_572", "feat_req_someip_583"});
  const PayloadRules rules{.union_length = FieldWidth::none, .union_type = FieldWidth::bits8};
  const auto write = [](std::size_t longest) {
    return [longest](PayloadWriter& out) {
      const auto choice = out.begin_union(1, longest);
      out.u16(0x1234);
      out.end(choice);
      out.u8(0x55);
    };
  };
  EXPECT_EQ(written(rules, write(4)),
            "01"
            "12340000"
            "55");
  EXPECT_EQ(written(rules, write(2)), "01123455");
  EXPECT_EQ(written(rules, write(1)), "!bad_length");
  const auto payload = hex("01 12340000 55");
  PayloadReader in{payload, rules};
  const auto choice = in.begin_union(2, 4);
  EXPECT_EQ(choice.type, 1U);
  EXPECT_EQ(in.u16(), 0x1234);
  in.end(choice.open);
  EXPECT_EQ(in.u8(), 0x55);
  EXPECT_FALSE(in.error());
}

TEST(PayloadReader, SkipsTheSpecificationsUnionPadding) {
  covers({"feat_req_someip_274", "feat_req_someip_273", "feat_req_someip_263"});
  // The example of the specification: a union of uint8 and uint16, both padded to 32 bits.
  const auto payload = hex("00000004 00000001 aa 000000  00000004 00000002 bbcc 0000  55");
  PayloadReader in{payload};
  const auto first = in.begin_union(2);
  EXPECT_EQ(first.type, 1U);
  EXPECT_EQ(in.u8(), 0xaa);
  in.end(first.open);
  const auto second = in.begin_union(2);
  EXPECT_EQ(second.type, 2U);
  EXPECT_EQ(in.u16(), 0xbbcc);
  in.end(second.open);
  EXPECT_EQ(in.u8(), 0x55);
  EXPECT_FALSE(in.error());
  for (const auto* const bad : {"00000001 00000000 05", "00000001 00000003 05"}) {
    const auto bytes = hex(bad);
    PayloadReader refusing{bytes};
    EXPECT_EQ(refusing.begin_union(2).type, 0U);
    EXPECT_EQ(refusing.error(), WireError::bad_union_type);
    EXPECT_EQ(refusing.position(), 0U);
  }
}

TEST(PayloadWriter, AlignsWhatFollowsAnElementOfVariableLength) {
  covers({"feat_req_someip_711", "feat_req_someip_239"});
  const PayloadRules rules{.alignment = 4};
  const auto write = [](PayloadWriter& out) {
    out.u8(1);  // of fixed size: what follows is not aligned
    const auto names = out.begin_array();
    out.string("ab");
    out.string("c");
    out.end(names);
    out.u32(0x12345678);
    out.byte_array(hex("99"));
  };
  // Byte 5 + 10 = 15: one zero after the first string; byte 16 + 9 = 25: three after the second, which the
  // array counts: 11 + 12 = 0x17. Byte 28 + 4 + 5 = 37: three after the last.
  EXPECT_EQ(written(rules, write),
            "01"
            "00000017"
            "00000006efbbbf616200"
            "00"
            "00000005efbbbf6300"
            "000000"
            "12345678"
            "0000000199"
            "000000");
}

TEST(PayloadReader, FindsWhatFollowsAnElementOfVariableLengthWhereverItsPaddingIsCounted) {
  covers({"feat_req_someip_711", "feat_req_someip_239"});
  const auto check = [](std::string_view bytes) {
    const auto payload = hex(bytes);
    PayloadReader in{payload, {.alignment = 4}};
    EXPECT_EQ(in.u8(), 1);
    auto names = in.begin_array();
    ASSERT_TRUE(in.more(names));
    EXPECT_EQ(in.string({}), "ab");
    ASSERT_TRUE(in.more(names));
    EXPECT_EQ(in.string({}), "c");
    EXPECT_FALSE(in.more(names));
    in.end(names);
    EXPECT_EQ(in.u32(), 0x12345678U);
    EXPECT_EQ(to_hex(in.byte_array()), "99");
    EXPECT_FALSE(in.error());
  };
  // Counted by the array, as we write it; and after it, with none at the end, as others may.
  check("01 00000017 00000006efbbbf616200 00 00000005efbbbf6300 000000 12345678 00000001 99 000000");
  check("01 00000014 00000006efbbbf616200 00 00000005efbbbf6300 000000 12345678 00000001 99");
}

TEST(PayloadWriter, AlignsNothingToZeroBytes) {
  EXPECT_EQ(written({.alignment = 0}, [](auto& out) { out.byte_array(hex("aa")); }), "00000001aa");
  const auto payload = hex("00000001aa");
  PayloadReader in{payload, {.alignment = 0}};
  EXPECT_EQ(to_hex(in.byte_array()), "aa");
  EXPECT_FALSE(in.error());
}

TEST(PayloadWriter, CountsTheHeaderWhenItAligns) {
  covers({"feat_req_someip_711"});
  // To 32 bytes: the payload begins at byte 16 of the message, so its byte 16 is the first multiple.
  EXPECT_EQ(written({.alignment = 32},
                    [](auto& out) {
                      out.byte_array(hex("aa"));
                      out.u8(0xbb);
                    }),
            "00000001aa"
            "0000000000000000000000"
            "bb");
}

TEST(PayloadWriter, WritesNothingBeyondItsRoom) {
  std::array<std::byte, 16> all{};
  all.fill(std::byte{0xee});
  for (std::size_t size = 0; size < 13; ++size) {
    PayloadWriter out{ByteSpan{all}.first(size)};
    out.u8(7);
    out.string("hi");
    out.u16(1);
    EXPECT_EQ(out.finish().error(), WireError::no_room) << size;
    EXPECT_EQ(all[size], std::byte{0xee}) << size;
  }
  PayloadWriter out{ByteSpan{all}.first(13)};
  out.u8(7);
  out.string("hi");
  out.u16(1);
  EXPECT_EQ(to_hex(*out.finish()), "0700000006efbbbf6869000001");
}

TEST(PayloadReader, FailsCleanlyAtEveryTruncation) {
  covers({"feat_req_someip_168", "feat_req_someipcompat_1198"});
  // uint8, string "hi", array of two struct{uint8, union{uint8, uint16}}, and a parameter it does not know
  const auto whole =
      hex("07 00000006efbbbf686900 00000015 01 00000001 00000001 aa 02 00000002 00000002 bbcc");
  const auto read = [](ByteView payload) {
    PayloadReader in{payload};
    in.u8();
    static_cast<void>(in.string({}));
    auto array = in.begin_array();
    while (in.more(array)) {
      const auto element = in.begin_struct();
      in.u8();
      const auto choice = in.begin_union(2);
      if (choice.type == 1) {
        in.u8();
      } else {
        in.u16();
      }
      in.end(choice.open);
      in.end(element);
    }
    in.end(array);
    return in.error();
  };
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_EQ(read(ByteView{whole}.first(size)), WireError::truncated) << size;
  }
  EXPECT_EQ(read(whole), std::nullopt);
  auto longer = whole;
  longer.push_back(std::byte{0x99});
  EXPECT_EQ(read(longer), std::nullopt) << "parameters that are not known are left alone";
}

}  // namespace
}  // namespace trestle::someip::payload_test
