#include "bridge/generate/capture_model.hpp"

#include <gmock/gmock.h>

namespace trestle::generate {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

std::string capture(const std::string& name) {
  return TRESTLE_CAPTURES "/" + name;
}

template <typename Element>
std::vector<std::string> names(const std::vector<Element>& elements) {
  std::vector<std::string> names;
  for (const Element& element : elements) {
    names.push_back(element.name);
  }
  return names;
}

TEST(ReadCapture, FindsServicesMembersAndEndpoints) {
  const describe::Reading reading = read_capture(capture("field_getter_setter_notifier.pcap"));
  ASSERT_THAT(reading.problems, IsEmpty());
  ASSERT_THAT(reading.model.services, SizeIs(1));
  const describe::Service& service = reading.model.services.front();
  EXPECT_EQ(service.name, "service_1234");
  EXPECT_THAT(names(service.methods),
              ElementsAre("method_0010", "method_0011", "method_0012", "method_0013"));
  EXPECT_THAT(names(service.events), ElementsAre("event_8010", "event_8011"));
  ASSERT_THAT(reading.model.instances, SizeIs(1));
  EXPECT_TRUE(reading.model.instances.front().address);
  EXPECT_TRUE(reading.model.instances.front().udp_port);
}

TEST(ReadCapture, PutsSegmentsTogether) {
  const describe::Reading reading = read_capture(capture("tp_event_1mib_plus.pcap"));
  ASSERT_THAT(reading.model.services, SizeIs(1));
  ASSERT_THAT(reading.model.services.front().events, SizeIs(1));
  EXPECT_GT(reading.model.services.front().events.front().observed_bytes, 1U << 20U);
}

TEST(ReadCapture, KnowsWhatHasNoAnswer) {
  const describe::Reading reading = read_capture(capture("fire_and_forget_udp_tcp.pcap"));
  ASSERT_FALSE(reading.model.services.empty());
  bool forgets = false;
  for (const describe::Method& method : reading.model.services.front().methods) {
    forgets = forgets || method.fire_and_forget;
  }
  EXPECT_TRUE(forgets);
}

TEST(ReadCapture, SaysThatThereIsNoCapture) {
  const describe::Reading reading = read_capture("/nowhere/at/all.pcap");
  ASSERT_THAT(reading.problems, SizeIs(1));
  EXPECT_EQ(reading.problems.front().file, "/nowhere/at/all.pcap");
  EXPECT_FALSE(reading.ok());
}

}  // namespace
}  // namespace trestle::generate
