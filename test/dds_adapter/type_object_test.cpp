#include <gmock/gmock.h>

#include <algorithm>

#include "test/dds_adapter/dds_test.hpp"
#include "test/dds_adapter/peer_process.hpp"

namespace trestle::dds::type_object_test {
namespace {

using test::Inbox;
using test::PeerProcess;
using HostilePeers = test::DdsTest;

// Without type_object_guard.cpp this ends the process, in Fast DDS 2.x.
TEST_F(HostilePeers, MayDescribeTheirTypesWithoutHarm) {
  Inbox<Happening> events;
  Participant participant{config([&](const Happening& event) { events.put(event); })};
  const Reader reader = participant.create_reader("rt/outers", "Other", {}, [](const Sample&) {});
  {
    const PeerProcess peer{TYPE_OBJECT_PEER " " + std::to_string(domain_.id()) + " >/dev/null"};
    ASSERT_TRUE(events.wait([](const auto& all) {
      return std::ranges::any_of(all, [](const Happening& event) {
        return event.kind == Happening::Kind::incompatible_type && event.detail == "Outer";
      });
    }));
  }
  // The thread that learns of this would have met its end after the event above.
  ASSERT_TRUE(events.wait([](const auto& all) {
    return std::ranges::any_of(
        all, [](const Happening& event) { return event.kind == Happening::Kind::peer_lost; });
  }));
}

}  // namespace
}  // namespace trestle::dds::type_object_test
