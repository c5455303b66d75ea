#include "someip/core/tp_segmenter.hpp"

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "test/bytes.hpp"
#include "test/covers.hpp"

namespace trestle::someip::tp_segmenter_test {
namespace {
using test::covers;
using test::to_hex;
using testing::ElementsAre;

const Header cloud{.service = ServiceId{0x1234},
                   .method = MethodId{0x8001},
                   .session = SessionId{0x0007},
                   .interface_version = 1,
                   .type = MessageType::notification};

/// Each segment as its header in hexadecimal, "@offset" and "+bytes".
std::vector<std::string> segments_of(TpSegmenter segmenter) {
  std::vector<std::string> result;
  while (const auto segment = segmenter.next()) {
    result.push_back(to_hex(segment->header) + " @" + std::to_string(segment->offset) + " +" +
                     std::to_string(segment->bytes));
  }
  return result;
}

TEST(TpSegmenter, CutsAMessageIntoEqualSegmentsAndARest) {
  covers({"feat_req_someiptp_763", "feat_req_someiptp_765", "feat_req_someiptp_767", "feat_req_someiptp_770",
          "feat_req_someiptp_771", "feat_req_someiptp_773", "feat_req_someiptp_774", "feat_req_someiptp_777",
          "feat_req_someiptp_778", "feat_req_someiptp_779", "feat_req_someiptp_780"});
  // 5880 bytes: four segments of 1392 bytes and one of 312.
  EXPECT_THAT(segments_of(TpSegmenter{cloud, 5880}),
              ElementsAre("123480010000057c000000070101220000000001 @0 +1392",
                          "123480010000057c000000070101220000000571 @1392 +1392",
                          "123480010000057c000000070101220000000ae1 @2784 +1392",
                          "123480010000057c000000070101220000001051 @4176 +1392",
                          "12348001000001440000000701012200000015c0 @5568 +312"));
}

TEST(TpSegmenter, CountsItsSegments) {
  EXPECT_EQ(TpSegmenter(cloud, 0).size(), 1U);
  EXPECT_EQ(TpSegmenter(cloud, 1).size(), 1U);
  EXPECT_EQ(TpSegmenter(cloud, 1392).size(), 1U);
  EXPECT_EQ(TpSegmenter(cloud, 1393).size(), 2U);
  EXPECT_EQ(TpSegmenter(cloud, 4'194'304).size(), 3014U);
  EXPECT_EQ(segments_of(TpSegmenter{cloud, 4'194'304}).size(), 3014U);
}

TEST(TpSegmenter, EndsWithAFullSegmentWhenThePayloadIsAMultiple) {
  EXPECT_THAT(segments_of(TpSegmenter{cloud, 32, 16}),
              ElementsAre("123480010000001c000000070101220000000001 @0 +16",
                          "123480010000001c000000070101220000000010 @16 +16"));
}

TEST(TpSegmenter, MakesOneEmptySegmentOfAnEmptyPayload) {
  EXPECT_THAT(segments_of(TpSegmenter{cloud, 0}),
              ElementsAre("123480010000000c000000070101220000000000 @0 +0"));
}

TEST(TpSegmenter, ReachesTheLargestOffset) {
  // The largest payload that the original's Length field could say: 0xffffffff - 8.
  TpSegmenter segments{cloud, 0xfffffff7, 65472};
  std::optional<TpSegment> last;
  while (auto segment = segments.next()) {
    last = segment;
  }
  // 65600 x 65472 = 0xfffff000 bytes come before it, so 0xff7 are left; Length 0x1003 = 12 + 0xff7.
  EXPECT_EQ(segments.size(), 65601U);
  EXPECT_EQ(to_hex(last->header), "12348001000010030000000701012200fffff000");
  EXPECT_EQ(last->bytes, 0xff7U);
}

TEST(TpSegmenter, TellsHowFarItIs) {
  TpSegmenter segments{cloud, 20, 16};
  EXPECT_FALSE(segments.done());
  EXPECT_EQ(segments.offset(), 0U);
  EXPECT_TRUE(segments.next());
  EXPECT_FALSE(segments.done());
  EXPECT_EQ(segments.offset(), 16U);
  EXPECT_TRUE(segments.next());
  EXPECT_TRUE(segments.done());
  EXPECT_EQ(segments.offset(), 20U);
  EXPECT_FALSE(segments.next());
}

}  // namespace
}  // namespace trestle::someip::tp_segmenter_test
