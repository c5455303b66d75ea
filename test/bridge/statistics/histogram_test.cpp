#include "bridge/statistics/histogram.hpp"

#include <gmock/gmock.h>

namespace trestle::statistics {
namespace {

using testing::ElementsAre;
using Bucket = Histogram::Bucket;

TEST(Histogram, IsEmptyAtFirst) {
  const Histogram latencies;
  EXPECT_EQ(latencies.count(), 0);
  EXPECT_EQ(latencies.min(), 0);
  EXPECT_EQ(latencies.max(), 0);
  EXPECT_EQ(latencies.mean(), 0);
  EXPECT_EQ(latencies.percentile(50), 0);
  EXPECT_THAT(latencies.buckets(), ElementsAre());
}

TEST(Histogram, GivesTheNearestRankOfSmallValuesExactly) {
  Histogram latencies;
  for (int value = 1; value <= 1000; ++value) {
    latencies.add(value);
  }
  EXPECT_EQ(latencies.count(), 1000);
  EXPECT_EQ(latencies.min(), 1);
  EXPECT_EQ(latencies.max(), 1000);
  EXPECT_DOUBLE_EQ(latencies.mean(), 500.5);
  EXPECT_EQ(latencies.percentile(0), 1);
  EXPECT_EQ(latencies.percentile(50), 500);
  EXPECT_EQ(latencies.percentile(99), 990);
  EXPECT_EQ(latencies.percentile(99.9), 999);
  EXPECT_EQ(latencies.percentile(99.95), 1000);
  EXPECT_EQ(latencies.percentile(100), 1000);
}

TEST(Histogram, HasBucketsThatDoubleInWidthFromTwoThousandFortyEightOn) {
  Histogram latencies;
  for (const int value : {2047, 2048, 2049, 2050, 4095, 4096, 4099, 4100}) {
    latencies.add(value);
  }
  EXPECT_THAT(latencies.buckets(), ElementsAre(Bucket{2047, 1}, Bucket{2049, 2}, Bucket{2051, 1},
                                               Bucket{4095, 1}, Bucket{4099, 2}, Bucket{4103, 1}));
}

TEST(Histogram, IsRightToAThousandthAtAllSizes) {
  for (std::int64_t value = 3; value < Histogram::largest; value = value * 7 / 4) {
    Histogram latencies;
    latencies.add(value);
    latencies.add(Histogram::largest);  // or else the value itself would be the answer, as the largest one
    const std::int64_t found = latencies.percentile(50);
    EXPECT_GE(found, value);
    EXPECT_LE(static_cast<double>(found - value), 0.001 * static_cast<double>(value));
  }
}

TEST(Histogram, IsRightToAnEighthWhenItIsCoarse) {
  for (std::int64_t value = 3; value < Histogram::largest; value = value * 7 / 4) {
    Histogram latencies{Histogram::coarse};
    latencies.add(value);
    latencies.add(Histogram::largest);
    EXPECT_GE(latencies.percentile(50), value);
    EXPECT_LE(latencies.percentile(50), value + value / 8);
  }
}

TEST(Histogram, NeverAnswersMoreThanTheLargestValue) {
  Histogram latencies;
  latencies.add(1'000'000'001);
  EXPECT_EQ(latencies.percentile(50), 1'000'000'001);
}

TEST(Histogram, TakesWhatIsOutOfRangeForTheNearestValueInIt) {
  Histogram latencies;
  latencies.add(-5);
  latencies.add(INT64_MAX);
  EXPECT_EQ(latencies.min(), 0);
  EXPECT_EQ(latencies.max(), Histogram::largest);
  EXPECT_EQ(latencies.count(), 2);
}

}  // namespace
}  // namespace trestle::statistics
