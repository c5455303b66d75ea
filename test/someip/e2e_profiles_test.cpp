// The bytes of each profile, from the examples of AUTOSAR's E2E Protocol Specification: Data of zeros, Data
// IDs 0x123, 0x1234, 0x0a0b0c0d or the list 1 to 16. Two open implementations assert the same bytes: the
// Python package autosar-e2e (profiles 1, 2, 4 to 7) and the Rust crate of that name (4 to 8, 4m, 7m, 11,
// 22). For profiles 44 and 44m, whose bytes are those of 4 and 4m, the examples of 4 and 4m stand. Those of
// 8m were made with Python's struct and a CRC bit by bit, which also makes the example of 8.
#include <gmock/gmock.h>

#include <ostream>

#include "someip/core/e2e/checker.hpp"
#include "someip/core/e2e/protector.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"

namespace trestle::someip::e2e::e2e_profiles_test {
namespace {

using test::covers;
using test::hex;
using test::to_hex;

constexpr std::array<std::uint8_t, 16> ids_1_to_16{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};

Profile1 profile1(DataIdMode mode) {
  return {.data_id = 0x123,
          .data_id_mode = mode,
          .data_bits = 64,
          .crc_offset_bits = 0,
          .counter_offset_bits = 8,
          .data_id_nibble_offset_bits = 12};
}
Profile11 profile11(DataIdMode mode, std::uint32_t offset_bits, std::uint32_t data_bits) {
  return {.data_id = 0x123,
          .data_id_mode = mode,
          .data_bits = data_bits,
          .crc_offset_bits = offset_bits,
          .counter_offset_bits = offset_bits + 8,
          .data_id_nibble_offset_bits = offset_bits + 12};
}
constexpr Profile4 profile4_at(std::uint32_t offset_bits) {
  return {.data_id = 0x0a0b0c0d, .offset_bits = offset_bits};
}
constexpr Profile7 profile7_at(std::uint32_t offset_bits) {
  return {.data_id = 0x0a0b0c0d, .offset_bits = offset_bits};
}
constexpr MethodInfo request{.source_id = 0x123456};
constexpr MethodInfo response{.response = true, .source_id = 0x123456};
constexpr MethodInfo error_response{.response = true, .error = true, .source_id = 0x123456};

struct Example {
  const char* name;
  Config config;
  std::vector<const char*> messages;  ///< what protect() makes of zeros, one after another
  MethodInfo method{};
  friend void PrintTo(const Example& example, std::ostream* out) { *out << example.name; }
};

std::vector<Example> examples() {
  return {
      {"P01BothBytes", profile1(DataIdMode::both), {"cc00000000000000", "9101000000000000"}},
      {"P01Alternating", profile1(DataIdMode::alternating), {"ce00000000000000", "0201000000000000"}},
      {"P01Low", profile1(DataIdMode::low), {"ce00000000000000", "9301000000000000"}},
      {"P01Nibble", profile1(DataIdMode::nibble), {"2a10000000000000", "7711000000000000"}},
      {"P02", Profile2{.data_bits = 64, .offset_bits = 0}, {"4501000000000000"}},
      {"P04", profile4_at(0), {"001000000a0b0c0d862b055600000000", "001000010a0b0c0da58e680700000000"}},
      {"P04AtOffset64",
       profile4_at(64),
       {"0000000000000000001800000a0b0c0d69d7502e00000000",
        "0000000000000000001800010a0b0c0d4a723d7f00000000"}},
      {"P05",
       Profile5{.data_id = 0x1234, .data_bits = 64, .offset_bits = 0},
       {"1cca000000000000", "cf8d010000000000"}},
      {"P05AtOffset64",
       Profile5{.data_id = 0x1234, .data_bits = 128},
       {"00000000000000002891000000000000", "0000000000000000fbd6010000000000"}},
      {"P06", Profile6{.data_id = 0x1234, .offset_bits = 0}, {"b155000800000000", "f4f5000801000000"}},
      {"P06AtOffset64",
       Profile6{.data_id = 0x1234},
       {"00000000000000004eb7001000000000", "00000000000000000b17001001000000"}},
      {"P07",
       profile7_at(0),
       {"1fb2e737fcedbcd900000018000000000a0b0c0d00000000",
        "7bde7268b8e9bc2700000018000000010a0b0c0d00000000"}},
      {"P07AtOffset64",
       profile7_at(64),
       {"000000000000000017f7c817323865a800000020000000000a0b0c0d00000000",
        "0000000000000000739b5d48763c655600000020000000010a0b0c0d00000000"}},
      {"P08", Profile8{profile7_at(0)}, {"41494e5200000014000000000a0b0c0d00000000"}},
      {"P08AtOffset64",
       Profile8{profile7_at(64)},
       {"0000000000000000e891e5a80000001c000000000a0b0c0d00000000"}},
      {"P04mRequest", Profile4m{profile4_at(0)}, {"001400000a0b0c0dae674ca00012345600000000"}, request},
      {"P04mResponse", Profile4m{profile4_at(0)}, {"001400000a0b0c0d852576194012345600000000"}, response},
      {"P04mError", Profile4m{profile4_at(0)}, {"001400000a0b0c0d2345570f5012345600000000"}, error_response},
      {"P07mRequest",
       Profile7m{profile7_at(0)},
       {"ae96a7d0a50175940000001c000000000a0b0c0d0012345600000000"},
       request},
      {"P07mResponse",
       Profile7m{profile7_at(0)},
       {"a62d6486e83f2caf0000001c000000000a0b0c0d4012345600000000"},
       response},
      {"P07mError",
       Profile7m{profile7_at(0)},
       {"09d9e80c473432020000001c000000000a0b0c0d5012345600000000"},
       error_response},
      {"P08mRequest",
       Profile8m{profile7_at(0)},
       {"6df05eba00000018000000000a0b0c0d0012345600000000"},
       request},
      {"P08mResponse",
       Profile8m{profile7_at(0)},
       {"46b2640300000018000000000a0b0c0d4012345600000000"},
       response},
      {"P08mError",
       Profile8m{profile7_at(0)},
       {"e0d2451500000018000000000a0b0c0d5012345600000000"},
       error_response},
      {"P11BothBytes", profile11(DataIdMode::both, 0, 64), {"cc00000000000000", "9101000000000000"}},
      {"P11Nibble", profile11(DataIdMode::nibble, 0, 64), {"2a10000000000000", "7711000000000000"}},
      {"P11NibbleAtOffset64", profile11(DataIdMode::nibble, 64, 128), {"00000000000000007d10000000000000"}},
      {"P11NibbleBehindTheHeaderOfSomeip",  // where it is unless told otherwise
       Profile11{.data_id = 0x123, .data_id_mode = DataIdMode::nibble, .data_bits = 128},
       {"00000000000000007d10000000000000"}},
      {"P22",
       Profile22{.data_id_list = ids_1_to_16, .data_bits = 64, .offset_bits = 0},
       {"1b01000000000000", "9802000000000000", "3103000000000000", "0d04000000000000", "1805000000000000",
        "9b06000000000000", "6507000000000000", "0808000000000000", "1d09000000000000", "9e0a000000000000",
        "370b000000000000", "0b0c000000000000", "1e0d000000000000", "9d0e000000000000", "cd0f000000000000",
        "0e00000000000000"}},
      {"P22AtOffset64",
       Profile22{.data_id_list = ids_1_to_16, .data_bits = 128},
       {"00000000000000001401000000000000"}},
      {"P44", Profile44{profile4_at(0)}, {"001000000a0b0c0d862b055600000000"}},
      {"P44mRequest", Profile44m{profile4_at(0)}, {"001400000a0b0c0dae674ca00012345600000000"}, request},
  };
}

class E2eProfile : public testing::TestWithParam<Example> {};

INSTANTIATE_TEST_SUITE_P(Autosar, E2eProfile, testing::ValuesIn(examples()),
                         [](const auto& example) { return example.param.name; });

MethodExpectation expecting(const MethodInfo& method) {
  return {.response = method.response, .error = method.error, .source_id = method.source_id};
}

TEST_P(E2eProfile, ProtectsAsTheSpecificationShows) {
  covers({"feat_req_someip_102", "feat_req_someip_103"});
  auto protector = Protector::create(GetParam().config);
  ASSERT_TRUE(protector);
  for (const char* expected : GetParam().messages) {
    std::vector<std::byte> data(hex(expected).size());
    ASSERT_TRUE(protector->protect(data, GetParam().method));
    EXPECT_EQ(to_hex(data), expected);
  }
}

TEST_P(E2eProfile, ChecksWhatTheSpecificationShows) {
  auto checker = Checker::create(GetParam().config);
  ASSERT_TRUE(checker);
  for (const char* message : GetParam().messages) {
    const CheckResult result = checker->check(hex(message), expecting(GetParam().method));
    EXPECT_EQ(result.fault, Fault::none) << message;
    EXPECT_THAT(result.status, testing::AnyOf(CheckStatus::ok, CheckStatus::wrong_sequence)) << message;
  }
}

TEST_P(E2eProfile, FindsEveryFlippedBit) {
  auto checker = Checker::create(GetParam().config);
  ASSERT_TRUE(checker);
  const auto good = hex(GetParam().messages.front());
  for (std::size_t bit = 0; bit < good.size() * 8; ++bit) {
    auto bad = good;
    bad[bit / 8] ^= std::byte{1} << (bit % 8);
    EXPECT_EQ(checker->check(bad, expecting(GetParam().method)).status, CheckStatus::error) << "bit " << bit;
  }
}

TEST_P(E2eProfile, GivesTheSameForDataInTwoPieces) {
  const auto expected = hex(GetParam().messages.front());
  const std::size_t header_at = make_layout(GetParam().config)->header_at();
  for (std::size_t cut = 0; cut <= expected.size(); ++cut) {
    SCOPED_TRACE(cut);
    auto protector = Protector::create(GetParam().config);
    auto checker = Checker::create(GetParam().config);
    std::vector<std::byte> data(expected.size());
    const auto done =
        protector->protect(ByteView{data}.first(cut), ByteSpan{data}.subspan(cut), GetParam().method);
    const CheckResult checked = checker->check(ByteView{expected}.first(cut), ByteView{expected}.subspan(cut),
                                               expecting(GetParam().method));
    if (cut <= header_at) {
      EXPECT_TRUE(done);
      EXPECT_EQ(to_hex(data), to_hex(expected));
      EXPECT_EQ(checked.fault, Fault::none);
    } else {
      EXPECT_EQ(done.error(), ProtectError::header_in_front);
      EXPECT_EQ(data, std::vector<std::byte>(expected.size()));
      EXPECT_EQ(checked.fault, Fault::header_in_front);
    }
  }
}

TEST_P(E2eProfile, RefusesDataThatIsTooShortAndLeavesItAlone) {
  auto protector = Protector::create(GetParam().config);
  auto checker = Checker::create(GetParam().config);
  ASSERT_TRUE(protector && checker);
  const std::size_t needed = make_layout(GetParam().config)->min_bytes;
  const std::uint32_t counter = protector->next_counter();
  for (std::size_t size = 0; size < needed; ++size) {
    const std::vector<std::byte> before(size, std::byte{0x5a});
    auto data = before;
    EXPECT_EQ(protector->protect(data).error(), ProtectError::too_short) << size;
    EXPECT_EQ(data, before);
    EXPECT_EQ(checker->check(data).fault, Fault::data_length) << size;
  }
  EXPECT_EQ(protector->next_counter(), counter);
}

TEST(E2eProtector, RefusesDataThatIsTooLong) {
  auto fixed = Protector::create(Profile5{.data_id = 1, .data_bits = 88});
  ASSERT_TRUE(fixed);
  std::vector<std::byte> data(12, std::byte{0x5a});
  EXPECT_EQ(fixed->protect(data).error(), ProtectError::too_long);
  EXPECT_EQ(data, std::vector<std::byte>(12, std::byte{0x5a}));

  auto ranged = Protector::create(Profile4{.data_id = 1, .max_data_bits = 160});
  auto checker = Checker::create(Profile4{.data_id = 1, .max_data_bits = 160});
  ASSERT_TRUE(ranged && checker);
  std::vector<std::byte> room(21);
  EXPECT_EQ(ranged->protect(room).error(), ProtectError::too_long);
  EXPECT_EQ(checker->check(room).fault, Fault::data_length);
  EXPECT_TRUE(ranged->protect(ByteSpan{room}.first(20)));
}

TEST(E2eProtector, RefusesASourceIdOfMoreThan28Bits) {
  auto protector = Protector::create(Profile4m{});
  ASSERT_TRUE(protector);
  std::vector<std::byte> data(24);
  EXPECT_EQ(protector->protect(data, {.source_id = 0x10000000}).error(), ProtectError::source_id);
  EXPECT_TRUE(protector->protect(data, {.source_id = 0x0fffffff}));

  auto without = Protector::create(Profile4{});
  ASSERT_TRUE(without);
  EXPECT_TRUE(without->protect(data, {.source_id = 0xffffffff})) << "not sent, so not judged";
}

TEST(E2eProtector, LeavesTheOtherNibbleToTheUser) {
  auto protector = Protector::create(profile1(DataIdMode::both));
  ASSERT_TRUE(protector);
  auto data = hex("00a5000000000000");
  ASSERT_TRUE(protector->protect(data));
  EXPECT_EQ(to_hex(ByteView{data}.subspan(1)), "a0000000000000");
}

TEST(E2eProfile1, AlternatesBetweenTheBytesOfTheDataId) {
  // 0x0123: as mode `low` with Data ID 0x23 where the counter is even, with 0x01 where it is odd.
  auto alternating = Protector::create(profile1(DataIdMode::alternating));
  ASSERT_TRUE(alternating);
  for (std::uint32_t counter = 0; counter < 15; ++counter) {
    Profile1 of_one_byte = profile1(DataIdMode::low);
    of_one_byte.data_id = counter % 2 == 0 ? 0x23 : 0x01;
    auto low = Protector::create(of_one_byte);
    ASSERT_TRUE(low);
    low->resume(counter);
    std::array<std::byte, 8> expected{};
    ASSERT_TRUE(low->protect(expected));
    std::array<std::byte, 8> data{};
    ASSERT_TRUE(alternating->protect(data));
    EXPECT_EQ(to_hex(data), to_hex(expected)) << counter;
  }
}

TEST(E2eProfile5, SendsTheCrcHighByteFirstIfConfigured) {
  auto protector = Protector::create(
      Profile5{.data_id = 0x1234, .data_bits = 64, .offset_bits = 0, .crc_order = std::endian::big});
  ASSERT_TRUE(protector);
  std::vector<std::byte> data(8);
  ASSERT_TRUE(protector->protect(data));
  EXPECT_EQ(to_hex(data), "ca1c000000000000");
}

/// A message of profile 4 with a good CRC but another field wrong.
std::vector<std::byte> resealed(std::vector<std::byte> data, std::size_t at, std::byte value) {
  data[at] = value;
  const auto layout = make_layout(profile4_at(0));
  write_field(layout->crc, data, 0, checksum(*layout, {}, data, 0));
  return data;
}

TEST(E2eChecker, NamesTheFieldThatIsWrong) {
  auto checker = Checker::create(profile4_at(0));
  ASSERT_TRUE(checker);
  const auto good = hex("001000000a0b0c0d862b055600000000");
  EXPECT_EQ(checker->check(resealed(good, 15, std::byte{1})).fault, Fault::none);
  EXPECT_EQ(checker->check(resealed(good, 1, std::byte{0x11})).fault, Fault::length_field);
  EXPECT_EQ(checker->check(resealed(good, 7, std::byte{0x0e})).fault, Fault::data_id);
  EXPECT_EQ(checker->check(hex("001000000a0b0c0d862b055600000001")).fault, Fault::crc);
}

TEST(E2eChecker, TellsAnswersToOthersFromItsOwn) {
  auto server = Checker::create(Profile4m{profile4_at(0)});
  auto client = Checker::create(Profile4m{profile4_at(0)});
  ASSERT_TRUE(server && client);
  const auto asked = hex("001400000a0b0c0dae674ca00012345600000000");
  const CheckResult at_server = server->check(asked);
  EXPECT_EQ(at_server.status, CheckStatus::ok);
  EXPECT_EQ(at_server.source_id, 0x123456U);

  const auto answered = hex("001400000a0b0c0d852576194012345600000000");
  EXPECT_EQ(client->check(answered, {.response = true, .source_id = 0x123457}).fault, Fault::source_id);
  EXPECT_EQ(client->check(answered, {.response = true, .error = true}).fault, Fault::message_result);
  EXPECT_EQ(client->check(answered, {.response = false}).fault, Fault::message_type);
  EXPECT_EQ(client->check(answered, {.response = true, .source_id = 0x123456}).status, CheckStatus::ok);
}

TEST(E2eChecker, RefusesMessageTypesAndResultsThatAreNotDefined) {
  const auto layout = make_layout(Profile4m{profile4_at(0)});
  const auto check = [&](unsigned type, unsigned result, const MethodExpectation& expected) {
    auto data = hex("001400000a0b0c0d000000000012345600000000");
    data[12] |= static_cast<std::byte>((type << 6U) | (result << 4U));
    write_field(layout->crc, data, 0, checksum(*layout, {}, data, 0));
    return Checker::create(Profile4m{profile4_at(0)})->check(data, expected).fault;
  };
  EXPECT_EQ(check(0, 0, {}), Fault::none);
  EXPECT_EQ(check(1, 1, {.response = true, .error = true}), Fault::none);
  EXPECT_EQ(check(2, 0, {}), Fault::message_type);
  EXPECT_EQ(check(3, 0, {.response = true}), Fault::message_type);
  EXPECT_EQ(check(0, 2, {}), Fault::message_result);
  EXPECT_EQ(check(1, 3, {.response = true, .error = true}), Fault::message_result);
}

TEST(E2eProfile1, MayHaveTheNibbleOfTheDataIdAnywhere) {
  Profile1 profile{.data_id = 0x123,
                   .data_id_mode = DataIdMode::nibble,
                   .data_bits = 80,
                   .crc_offset_bits = 64,
                   .counter_offset_bits = 72,
                   .data_id_nibble_offset_bits = 8};
  auto protector = Protector::create(profile);
  ASSERT_TRUE(protector);
  std::vector<std::byte> data(10);
  EXPECT_EQ(protector->protect(ByteView{data}.first(2), ByteSpan{data}.subspan(2)).error(),
            ProtectError::header_in_front);
  ASSERT_TRUE(protector->protect(ByteView{data}.first(1), ByteSpan{data}.subspan(1)));
  EXPECT_EQ(to_hex(ByteView{data}.first(8)), "0001000000000000");

  profile.data_id_nibble_offset_bits = 84;
  EXPECT_EQ(Protector::create(profile).error().field, "data_bits");
}

TEST(E2eProfile1, CountsTheBytesOfItsHeader) {
  Profile1 profile{.data_id = 0x123,
                   .data_id_mode = DataIdMode::nibble,
                   .data_bits = 88,
                   .crc_offset_bits = 64,
                   .counter_offset_bits = 72,
                   .data_id_nibble_offset_bits = 76};
  EXPECT_EQ(make_layout(profile)->header_bytes(), 2U);  // the nibble shares the byte of the counter
  profile.data_id_nibble_offset_bits = 80;
  EXPECT_EQ(make_layout(profile)->header_bytes(), 3U);
  profile.data_id_nibble_offset_bits = 8;  // with something else in between
  EXPECT_EQ(make_layout(profile)->header_bytes(), std::nullopt);
}

TEST(E2eChecker, ComparesTheNibbleOfTheDataId) {
  // The CRC of nibble mode has only the low byte of the Data ID in it, and the nibble as part of the Data.
  auto other = profile1(DataIdMode::nibble);
  other.data_id = 0x223;
  auto protector = Protector::create(other);
  auto checker = Checker::create(profile1(DataIdMode::nibble));
  ASSERT_TRUE(protector && checker);
  std::vector<std::byte> data(8);
  ASSERT_TRUE(protector->protect(data));
  EXPECT_EQ(checker->check(data).fault, Fault::data_id);
}

TEST(E2eChecker, RefusesTheCounterThatProfiles1And11DoNotHave) {
  auto layout = make_layout(profile11(DataIdMode::both, 0, 64));
  auto checker = Checker::create(profile11(DataIdMode::both, 0, 64));
  ASSERT_TRUE(layout && checker);
  auto data = hex("000f000000000000");
  write_field(layout->crc, data, 0, checksum(*layout, {}, data, 15));
  EXPECT_EQ(checker->check(data).fault, Fault::counter);
}

/// The field that create() complains about, or "".
std::string_view broken(const Config& config) {
  const auto protector = Protector::create(config);
  const auto checker = Checker::create(config);
  EXPECT_EQ(protector.has_value(), checker.has_value());
  return protector ? std::string_view{} : protector.error().field;
}

TEST(E2eConfig, NamesTheFieldThatCannotBe) {
  EXPECT_EQ(broken(Profile4{}), "");
  EXPECT_EQ(broken(Profile4{.offset_bits = 12}), "offset_bits");
  EXPECT_EQ(broken(Profile4{.offset_bits = 0xfffffff8}), "offset_bits");
  EXPECT_EQ(broken(Profile4{.min_data_bits = 152}), "min_data_bits");  // 8 + 12 bytes are needed
  EXPECT_EQ(broken(Profile4{.min_data_bits = 160}), "");
  EXPECT_EQ(broken(Profile4{.min_data_bits = 161}), "min_data_bits");
  EXPECT_EQ(broken(Profile4{.max_data_bits = 152}), "max_data_bits");
  EXPECT_EQ(broken(Profile4{.max_data_bits = 65535 * 8}), "");
  EXPECT_EQ(broken(Profile4{.max_data_bits = 65536 * 8}), "max_data_bits");
  EXPECT_EQ(broken(Profile4{.min_data_bits = 800, .max_data_bits = 400}), "max_data_bits");
  EXPECT_EQ(broken(Profile4{.max_delta_counter = 0}), "max_delta_counter");
  EXPECT_EQ(broken(Profile4{.max_delta_counter = 65534}), "");
  EXPECT_EQ(broken(Profile4{.max_delta_counter = 65535}), "max_delta_counter");
  EXPECT_EQ(broken(Profile4m{Profile4{.max_data_bits = 184}}), "max_data_bits");  // 8 + 16 bytes are needed
  EXPECT_EQ(broken(Profile7{.max_data_bits = 216}), "max_data_bits");
  EXPECT_EQ(broken(Profile8{Profile7{.max_data_bits = 192}}), "");
  EXPECT_EQ(broken(Profile6{.max_delta_counter = 255}), "max_delta_counter");
  EXPECT_EQ(broken(Profile6{.max_data_bits = 65535 * 8}), "");
  EXPECT_EQ(broken(Profile6{.max_data_bits = 65536 * 8}), "max_data_bits");
}

TEST(E2eConfig, NamesTheFieldThatCannotBeInTheShortProfiles) {
  EXPECT_EQ(broken(Profile1{}), "data_bits");
  EXPECT_EQ(broken(Profile1{.data_bits = 80}), "");
  EXPECT_EQ(broken(Profile1{.data_bits = 248}), "data_bits");
  EXPECT_EQ(broken(Profile1{.data_bits = 84}), "data_bits");
  EXPECT_EQ(broken(Profile1{.data_bits = 80, .crc_offset_bits = 4}), "crc_offset_bits");
  EXPECT_EQ(broken(Profile1{.data_bits = 80, .counter_offset_bits = 66}), "counter_offset_bits");
  EXPECT_EQ(broken(Profile1{.data_bits = 80, .counter_offset_bits = 68}),
            "counter_offset_bits");  // the CRC's byte
  EXPECT_EQ(broken(Profile1{.data_bits = 80, .counter_offset_bits = 74}),
            "counter_offset_bits");  // no nibble, though beside the CRC
  EXPECT_EQ(broken(Profile1{.data_bits = 80, .counter_offset_bits = 0x1000000}), "counter_offset_bits");
  EXPECT_EQ(
      broken(Profile1{.data_id_mode = DataIdMode::nibble, .data_bits = 80, .data_id_nibble_offset_bits = 72}),
      "data_id_nibble_offset_bits");                                                   // the counter
  EXPECT_EQ(broken(Profile1{.data_bits = 80, .data_id_nibble_offset_bits = 72}), "");  // not used
  EXPECT_EQ(broken(Profile1{.data_id_mode = static_cast<DataIdMode>(9), .data_bits = 80}), "data_id_mode");
  EXPECT_EQ(broken(Profile1{.data_bits = 80, .sequence = {.max_delta_counter_init = 15}}),
            "max_delta_counter_init");
  EXPECT_EQ(broken(Profile1{.data_bits = 80, .sequence = {.max_no_new_or_repeated_data = 15}}),
            "max_no_new_or_repeated_data");
  EXPECT_EQ(broken(Profile2{.data_bits = 80, .sequence = {.max_no_new_or_repeated_data = 15}}), "");
  EXPECT_EQ(broken(Profile2{.data_bits = 80, .sequence = {.sync_counter_init = 16}}), "sync_counter_init");
  EXPECT_EQ(broken(Profile2{.data_bits = 72}), "data_bits");
  EXPECT_EQ(broken(Profile2{.data_bits = 4096 * 8}), "");
  EXPECT_EQ(broken(Profile2{.data_bits = 4097 * 8}), "data_bits");
  EXPECT_EQ(broken(Profile22{.data_bits = 4096 * 8}), "");
  EXPECT_EQ(broken(Profile22{.data_bits = 4097 * 8}), "data_bits");
  EXPECT_EQ(broken(Profile5{.data_bits = 4096 * 8}), "");
  EXPECT_EQ(broken(Profile5{.data_bits = 4097 * 8}), "data_bits");
  EXPECT_EQ(broken(Profile5{.data_bits = 80}), "data_bits");
  EXPECT_EQ(broken(Profile11{.data_id_mode = DataIdMode::low, .data_bits = 80}), "data_id_mode");
  EXPECT_EQ(broken(Profile11{.data_bits = 80, .max_delta_counter = 14}), "max_delta_counter");
  EXPECT_EQ(broken(Profile22{.data_bits = 80, .offset_bits = 3}), "offset_bits");
}

}  // namespace
}  // namespace trestle::someip::e2e::e2e_profiles_test
