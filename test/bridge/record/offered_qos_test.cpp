#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridge/record/offered_qos.hpp"

namespace trestle::record {
namespace offered_qos_test {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(OfferedQos, IsReadAgain) {
  const std::vector<dds::Qos> writers{{.reliable = true, .transient_local = true},
                                      {.reliable = false, .deadline = 100ms, .lifespan = 1s}};
  EXPECT_EQ(writers_of(offered_qos(writers)), writers);
}

// As ros2 bag of Jazzy writes it.
TEST(OfferedQos, IsReadInWords) {
  EXPECT_THAT(
      writers_of("- history: keep_last\n  depth: 5\n  reliability: best_effort\n  durability: volatile\n"
                 "  deadline:\n    sec: 9223372036\n    nsec: 854775807\n  liveliness: automatic\n"),
      ElementsAre(dds::Qos{.reliable = false, .depth = 5}));
  EXPECT_THAT(writers_of("- {history: keep_all, reliability: reliable, durability: transient_local}"),
              ElementsAre(dds::Qos{.transient_local = true, .keep_all = true}));
}

TEST(OfferedQos, IsNothingWhereItCannotBeRead) {
  EXPECT_THAT(writers_of(""), IsEmpty());
  EXPECT_THAT(writers_of("- ["), IsEmpty());
  EXPECT_THAT(writers_of("- 1\n- 2"), IsEmpty());
  EXPECT_THAT(writers_of("{reliability: 1}"), IsEmpty());
  EXPECT_THAT(writers_of("- depth: -1"), ElementsAre(dds::Qos{}));
  EXPECT_THAT(writers_of(std::string(60'000, '[')), IsEmpty());
  EXPECT_THAT(writers_of(std::string(70'000, ' ')), IsEmpty());
}

TEST(OfferedQos, AWriterOffersTheMost) {
  EXPECT_EQ(most_of(std::vector<dds::Qos>{}), dds::Qos{});
  EXPECT_EQ(most_of(std::vector<dds::Qos>{{.reliable = false},
                                          {.reliable = true, .transient_local = true, .depth = 20}}),
            (dds::Qos{.reliable = true, .transient_local = true, .depth = 20}));
  EXPECT_EQ(most_of(std::vector<dds::Qos>{{.reliable = false, .depth = 3}}),
            (dds::Qos{.reliable = false, .depth = 3}));
}

TEST(OfferedQos, AReaderAsksForTheLeast) {
  EXPECT_FALSE(least_of(std::vector<dds::Qos>{{.reliable = true}, {.reliable = false}}).reliable);
  EXPECT_TRUE(least_of(std::vector<dds::Qos>{{.reliable = true, .transient_local = true}}).transient_local);
  EXPECT_FALSE(least_of(std::vector<dds::Qos>{{.transient_local = true}, {}}).transient_local);
  EXPECT_FALSE(least_of(std::vector<dds::Qos>{}).transient_local);
}

}  // namespace offered_qos_test
}  // namespace trestle::record
