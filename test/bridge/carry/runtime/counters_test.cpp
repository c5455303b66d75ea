#include "bridge/carry/runtime/counters.hpp"

#include <gtest/gtest.h>

#include "bridge/carry/runtime/surroundings.hpp"

namespace trestle::carry::counters_test {
namespace {

using enum someip::CounterKind;

TEST(Counters, TellWhatIsLostFromWhatMayBe) {
  EXPECT_EQ(to_string({"route /a", {{"received", 0}, {"refused", 0, loss}, {"overwritten", 0, doubt}}}),
            "route /a: received 0");
  EXPECT_EQ(to_string({"route /a",
                       {{"overwritten", 3, doubt}, {"received", 2}, {"late", 1, loss}, {"no", 2, loss}}}),
            "route /a: received 2; lost: late 1, no 2; perhaps lost: overwritten 3");
  EXPECT_EQ(to_string({"TCP", {{"late", 1, loss}}}), "TCP: lost: late 1");
  EXPECT_EQ(to_string({"TCP", {{"late", 1, doubt}}}), "TCP: perhaps lost: late 1");
}

TEST(Counters, SumWhatHasEndedAndNotWhatWasOnceSo) {
  CounterGroup sum{"former routes", {{"received", 1}}};
  add(sum, {"route /a", {{"received", 2}, {"publishers", 3, now}, {"late", 4, loss}}});
  add(sum, {"route /b", {{"received", 5}, {"publishers", 6, now}, {"late", 7, loss}}});
  EXPECT_EQ(to_string(sum), "former routes: received 8; lost: late 11");
}

TEST(Counters, HaveLabelsForPrograms) {
  Route route;
  route.topic = "/a";
  route.service = someip::ServiceId{0x1234};
  route.event = someip::MethodId{0x8001};
  EXPECT_EQ(to_json({"route /a", {{"received", 2}}, labels_of(picture_of(route))}),
            R"({"event":"counters","group":"route /a","labels":{"topic":"/a","direction":"dds_to_someip",)"
            R"("service":"0x1234","instance":"0x0000","event":"0x8001"},"received":2})");
  MethodRoute method;
  method.ros_service = "/s";
  method.server = Server::ros;
  method.method = someip::MethodId{0x0001};
  EXPECT_EQ(
      to_json({"method", {}, labels_of(picture_of(method))}),
      R"({"event":"counters","group":"method","labels":{"ros_service":"/s","direction":"someip_to_dds",)"
      R"("service":"0x0000","instance":"0x0000","method":"0x0001"}})");
}

TEST(Counters, ComeAllInJson) {
  EXPECT_EQ(to_json({"a", {{"received", 2}, {"late", 0, loss}, {"overwritten", 3, doubt}}}),
            R"({"event":"counters","group":"a","received":2,"late":0,"overwritten":3})");
}

}  // namespace
}  // namespace trestle::carry::counters_test
