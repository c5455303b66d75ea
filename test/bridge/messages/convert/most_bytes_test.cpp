// How large a message can be: what a receiver needs no more room for.
#include "bridge/messages/convert/most_bytes.hpp"

#include "bridge/messages/convert/service_plans.hpp"
#include "someip/wire/tp.hpp"
#include "test/bridge/messages/convert/support.hpp"

namespace trestle::test::most_bytes_test {
namespace {

using namespace messages;

std::optional<std::size_t> most(std::string_view msg, const someip::PayloadRules& rules = {}) {
  return most_someip_bytes(plan_of(tree_of(msg), rules).program());
}

TEST(MostBytes, OfNumbersAreTheirSizes) {
  EXPECT_EQ(most("bool data"), 1U);
  EXPECT_EQ(most("uint8 a\nfloat64 b\nbool[7] c\nuint16[5] d"), 1U + 8 + 7 + 10);
  EXPECT_EQ(most_someip_bytes(plan_of(builtin("geometry_msgs/msg/Twist")).program()), 48U);
  EXPECT_EQ(most_someip_bytes(plan_of(builtin("geometry_msgs/msg/PoseWithCovariance")).program()),
            56U + 36 * 8);
}

TEST(MostBytes, OfBoundedTextsHaveRoomForAnyEncoding) {
  for (const auto encoding : {someip::StringEncoding::utf8, someip::StringEncoding::utf16le}) {
    const auto plan = plan_of(tree_of("string<=10 text"), {.string_encoding = encoding});
    const auto bound = most_someip_bytes(plan.program());
    ASSERT_TRUE(bound);
    EXPECT_LT(*bound, 100U);
    ConversionScratch scratch;
    const auto cdr = hex("00010000 0b000000 30313233343536373839 00");
    const auto payload = plan.cdr_to_someip(cdr, scratch);
    ASSERT_TRUE(payload);
    EXPECT_LE(payload->bytes, *bound);
  }
}

TEST(MostBytes, AreNotKnownWhereThereIsNoBound) {
  EXPECT_EQ(most("string text"), std::nullopt);
  EXPECT_EQ(most("uint8[] data"), std::nullopt);
  EXPECT_EQ(most("string[3] texts"), std::nullopt);
  EXPECT_EQ(most_someip_bytes(plan_of(builtin("sensor_msgs/msg/PointCloud2")).program()), std::nullopt);
  EXPECT_EQ(most("uint8 a", {.struct_length = someip::FieldWidth::bits32}), std::nullopt)
      << "others may have more in the struct";
}

// feat_req_someipcompat_1199: what is beyond the bound may be there, and is skipped.
TEST(MostBytes, OfBoundedArraysAreKnownWhereLongerOnesAreAnError) {
  EXPECT_EQ(most("uint32[<=10] data"), std::nullopt);
  const auto bound = most("uint32[<=10] data", {.cut_longer_arrays = false});
  ASSERT_TRUE(bound);
  EXPECT_GE(*bound, 44U);
  EXPECT_LT(*bound, 60U);
  EXPECT_EQ(most("uint8[<=4294967295] data", {.cut_longer_arrays = false}), std::nullopt);
}

TEST(MostBytes, OfRequestsAreThoseOfTheirTypes) {
  TypeLibrary library;
  const auto set_bool = library.resolve_service("std_srvs/srv/SetBool");
  ASSERT_TRUE(set_bool);
  const auto plans = compile_service(*set_bool, {});
  ASSERT_TRUE(plans);
  EXPECT_EQ(plans->request.most_bytes(), 1U);
  EXPECT_EQ(plans->response.most_bytes(), std::nullopt) << "it has a text";
  const auto trigger = library.resolve_service("std_srvs/srv/Trigger");
  ASSERT_TRUE(trigger);
  EXPECT_EQ(compile_service(*trigger, {})->request.most_bytes(), 0U);
}

TEST(RoomToReceive, IsADatagramOrALittleMoreThanNeeded) {
  EXPECT_EQ(room_to_receive(0), someip::max_plain_payload_bytes);
  EXPECT_EQ(room_to_receive(1300), someip::max_plain_payload_bytes);
  EXPECT_GT(room_to_receive(5000), 5000U);
  EXPECT_LT(room_to_receive(5000), 7000U);
}

}  // namespace
}  // namespace trestle::test::most_bytes_test
