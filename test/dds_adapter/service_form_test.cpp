#include "dds_adapter/service_form.hpp"

#include <gmock/gmock.h>

#include "test/bytes.hpp"

namespace trestle::dds::detail::service_form_test {
namespace {

using test::hex;
using test::to_hex;
using Bytes = std::vector<std::byte>;

// client 0x1122334455667788, number 5, then a body of 8 bytes.
const Bytes little = hex("00010000 8877665544332211 0500000000000000 2a00000000000000");
const Bytes big = hex("00000000 1122334455667788 0000000000000005 000000000000002a");

TEST(InlineHeader, IsReadInTheByteOrderOfTheMessage) {
  for (const Bytes& bytes : {little, big}) {
    const auto header = inline_header(bytes);
    ASSERT_TRUE(header);
    EXPECT_EQ(header->client, 0x1122334455667788U);
    EXPECT_EQ(header->number, 5);
  }
}

TEST(InlineHeader, IsNotThereInAShorterMessage) {
  EXPECT_TRUE(inline_header(hex("00010000 8877665544332211 0500000000000000")));
  EXPECT_FALSE(inline_header(hex("00010000 8877665544332211 05000000000000")));
  EXPECT_FALSE(inline_header(hex("00010000")));
}

TEST(InlineHeader, IsTakenOut) {
  EXPECT_EQ(to_hex(without_inline_header(little)), "000100002a00000000000000");
  EXPECT_EQ(to_hex(without_inline_header(hex("00010000 8877665544332211 0500000000000000"))), "00010000");
}

TEST(InlineHeader, IsPutInWhereverTheMessageIsCut) {
  const Bytes body = hex("00010000 2a00000000000000");
  for (std::size_t cut = 0; cut <= body.size(); ++cut) {
    const std::array<ByteView, 3> slices{ByteView{body}.first(cut), ByteView{}, ByteView{body}.subspan(cut)};
    const SlicesWithHeader whole{slices, {0x1122334455667788U, 5}};
    EXPECT_EQ(to_hex(joined(whole.slices())), to_hex(little)) << cut;
  }
  const Bytes other = hex("00000000 000000000000002a");
  const ByteView slice = other;
  EXPECT_EQ(to_hex(joined(SlicesWithHeader({&slice, 1}, {0x1122334455667788U, 5}).slices())), to_hex(big));
}

TEST(InlineHeader, LeavesWhatIsTooShortForAMessageAsItIs) {
  const Bytes stump = hex("0001");
  const ByteView slice = stump;
  EXPECT_EQ(to_hex(joined(SlicesWithHeader({&slice, 1}, {1, 2}).slices())), "0001");
}

TEST(RosForm, IsThatOfThePeerUnlessOneIsConfigured) {
  EXPECT_EQ(form_of(RosForm::automatic, Vendor::fast_dds), RosForm::fastrtps);
  EXPECT_EQ(form_of(RosForm::automatic, Vendor::cyclone_dds), RosForm::cyclonedds);
  EXPECT_EQ(form_of(RosForm::automatic, Vendor::other), RosForm::fastrtps);
  EXPECT_EQ(form_of(RosForm::fastrtps, Vendor::cyclone_dds), RosForm::fastrtps);
  EXPECT_EQ(form_of(RosForm::cyclonedds, Vendor::fast_dds), RosForm::cyclonedds);
}

}  // namespace
}  // namespace trestle::dds::detail::service_form_test
