#include <gmock/gmock.h>

#include <algorithm>

#include <array>
#include <cstdio>

#include "test/dds_adapter/dds_test.hpp"

namespace trestle::dds {
namespace {

using test::Inbox;
using HostilePeers = test::DdsTest;

/// A process that a pipe of ours feeds; it ends with this object.
class PeerProcess {
 public:
  explicit PeerProcess(const std::string& command) : input_{popen(command.c_str(), "we")} {}
  ~PeerProcess() {
    if (input_ != nullptr) {
      pclose(input_);
    }
  }
  PeerProcess(const PeerProcess&) = delete;
  PeerProcess& operator=(const PeerProcess&) = delete;

 private:
  std::FILE* input_;
};

// Without type_object_guard.cpp this ends the process, in Fast DDS 2.x.
TEST_F(HostilePeers, MayDescribeTheirTypesWithoutHarm) {
  Inbox<Event> events;
  Participant participant{config([&](const Event& event) { events.put(event); })};
  const Reader reader = participant.create_reader("rt/outers", "Other", {}, [](const Sample&) {});
  {
    const PeerProcess peer{TYPE_OBJECT_PEER " " + std::to_string(domain_.id()) + " >/dev/null"};
    ASSERT_TRUE(events.wait([](const auto& all) {
      return std::ranges::any_of(all, [](const Event& event) {
        return event.kind == Event::Kind::incompatible_type && event.detail == "Outer";
      });
    }));
  }
  // The thread that learns of this would have met its end after the event above.
  ASSERT_TRUE(events.wait([](const auto& all) {
    return std::ranges::any_of(all, [](const Event& event) { return event.kind == Event::Kind::peer_lost; });
  }));
}

}  // namespace
}  // namespace trestle::dds
