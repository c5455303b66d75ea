#include "dds_adapter/client_places.hpp"

#include <gmock/gmock.h>

#include <string>

namespace trestle::dds::client_places_test {
namespace {

using detail::ClientPlaces;
using testing::ElementsAre;

GuidPrefix participant(char name) {
  return {static_cast<std::byte>(name)};
}

class ClientPlacesTest : public testing::Test {
 protected:
  /// Its name says who it is of. Gives what is left out, or nothing.
  std::string add(const std::string& one) { return places.add(participant(one[0]), one).value_or(""); }
  ClientPlaces<std::string> places{4};
};

TEST_F(ClientPlacesTest, AreAllOfWhoIsAlone) {
  for (const char* one : {"a1", "a2", "a3", "a4"}) {
    EXPECT_EQ(add(one), "");
  }
  EXPECT_EQ(add("a5"), "a5");
  EXPECT_THAT(places.take_all(), ElementsAre("a1", "a2", "a3", "a4"));
  EXPECT_THAT(places.take_all(), ElementsAre());
}

TEST_F(ClientPlacesTest, GiveWhoHasLessThePlaceOfTheLatestOfWhoHasMost) {
  for (const char* one : {"a1", "b1", "a2", "a3"}) {
    EXPECT_EQ(add(one), "");
  }
  EXPECT_EQ(add("c1"), "a3");
  EXPECT_EQ(add("a4"), "a4");
  EXPECT_EQ(add("c2"), "c2") << "then it would have as many as the other has now";
  EXPECT_THAT(places.take_all(), ElementsAre("a1", "b1", "a2", "c1"));
}

TEST_F(ClientPlacesTest, AreKeptByThoseWhoHaveOneEach) {
  for (const char* one : {"a1", "b1", "c1", "d1"}) {
    EXPECT_EQ(add(one), "");
  }
  EXPECT_EQ(add("e1"), "e1");
  EXPECT_EQ(add("a2"), "a2");
}

TEST_F(ClientPlacesTest, ForgetWhatIsErasedOrTaken) {
  for (const char* one : {"a1", "a2", "b1", "b2"}) {
    EXPECT_EQ(add(one), "");
  }
  places.erase_if([](const std::string& one) { return one[0] == 'a'; });
  EXPECT_EQ(add("b3"), "");
  EXPECT_EQ(add("b4"), "");
  EXPECT_EQ(add("b5"), "b5");
  EXPECT_EQ(add("a3"), "b4");
  EXPECT_THAT(places.take_all(), ElementsAre("b1", "b2", "b3", "a3"));
  EXPECT_EQ(add("b1"), "");
  EXPECT_EQ(places.all().size(), 1U);
}

TEST(ClientPlaces, OfWhichThereAreNoneLeaveEverythingOut) {
  ClientPlaces<int> none{0};
  EXPECT_EQ(none.add(participant('a'), 1), 1);
}

}  // namespace
}  // namespace trestle::dds::client_places_test
