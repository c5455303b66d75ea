#pragma once
#include <gmock/gmock.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bridge/carry/runtime/make_routes.hpp"
#include "test/bridge/carry/runtime/fake_sides.hpp"
#include "test/bridge/carry/runtime/virtual_clock.hpp"
#include "test/bytes.hpp"

namespace trestle::test {

// "hello" as the default wire rules have it: length, BOM, characters, zero. And as CDR.
inline const Bytes hello = hex("00000009 efbbbf 68656c6c6f 00");
inline const Bytes hello_cdr = hex("00010000 06000000 68656c6c6f 00");
/// Neither of the two: a string that is longer than what there is.
inline const Bytes wrong = hex("000100ff ff000000");

/// A route between networks that are not there.
class RouteTest : public testing::Test {
 protected:
  static carry::Route route(carry::Direction direction) {
    carry::Route result;
    result.topic = "/talk";
    result.type = "std_msgs/msg/String";
    result.direction = direction;
    result.service = someip::ServiceId{0x1234};
    result.instance = someip::InstanceId{1};
    result.eventgroup = someip::EventgroupId{1};
    result.event = someip::MethodId{0x8001};
    result.qos.depth = 2;
    return result;
  }
  static carry::MethodRoute method(carry::Server server) {
    carry::MethodRoute result;
    result.ros_service = "/set";
    result.type = "std_srvs/srv/SetBool";
    result.server = server;
    result.service = someip::ServiceId{0x1234};
    result.instance = someip::InstanceId{1};
    result.method = someip::MethodId{0x21};
    result.max_calls = 2;
    if (server == carry::Server::ros) {
      result.transport = Transport::udp;
    }
    return result;
  }

  void start() {
    routes_.emplace(make_routes(context_, config_, types_), config_);
    routes_->join_someip(someip_);
    routes_->join_dds();
    routes_->update_offers();
    work();
  }
  /// Lets time pass, with all that the thread of the io_context has to do meanwhile.
  void pass(std::chrono::nanoseconds time) {
    clock_.pass(time, [this] {
      io_.restart();
      io_.poll();
    });
  }
  /// What is to be done now.
  void work() { pass({}); }
  /// The service is offered and withdrawn a thousand times, and in the end it is there.
  void flap(std::chrono::nanoseconds pause) {
    for (int i = 0; i < 1001; ++i) {
      someip_.service_comes_or_goes(i % 2 == 0);
      pass(pause);
    }
  }
  /// The route that begins there in the list.
  [[nodiscard]] carry::RunningRoute& route_at(std::size_t index) const {
    return *(routes_->begin() + static_cast<std::ptrdiff_t>(index))->route;
  }
  [[nodiscard]] std::uint64_t count(const std::string& name, std::size_t index = 0) const {
    const std::vector<carry::Counter> all = route_at(index).counters().counters;
    const auto found = std::ranges::find(all, name, [](const carry::Counter& one) { return one.name; });
    return found == all.end() ? 0xdead : found->count;
  }
  /// What is said of its state, and whether it is OK.
  [[nodiscard]] std::string state(std::size_t index = 0) const {
    std::vector<carry::Diagnosis> all;
    route_at(index).append_diagnoses(all, true);
    return (all.front().level == carry::Diagnosis::Level::ok ? "OK: " : "WARN: ") + all.front().message;
  }

  boost::asio::io_context io_{1};
  VirtualClock clock_;
  carry::Report report_;
  FakeSomeip someip_;
  FakeDds dds_;
  carry::FieldValues values_;
  carry::RouteContext context_{.io = io_,
                               .clock = clock_,
                               .report = report_,
                               .address = IpAddress::v4(10, 0, 0, 1),
                               .someip = &someip_,
                               .dds = &dds_,
                               .values = &values_};
  messages::TypeLibrary types_;
  carry::BridgeConfig config_;
  std::optional<carry::Routes> routes_;
};

}  // namespace trestle::test
