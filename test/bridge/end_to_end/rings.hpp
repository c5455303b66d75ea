// Bridges that close a ring between DDS and SOME/IP.
#pragma once
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "test/bridge/end_to_end/services_end_to_end.hpp"

namespace trestle::test::rings_test {

inline constexpr dds::Qos latched{.reliable = true, .transient_local = true, .depth = 1};
inline constexpr auto a_while = 500ms;

inline std::string out(const std::string& topic, int service, const std::string& more = "") {
  return fmt::format(
      "  - {{topic: {}, type: std_msgs/msg/String, direction: dds_to_someip, service: {}, instance: 1, "
      "eventgroup: 1, event: 0x8001, port: {}{}}}\n",
      topic, service, 40000 + service, more);
}
inline std::string in(const std::string& topic, int service, const std::string& more = "") {
  return fmt::format(
      "  - {{topic: {}, type: std_msgs/msg/String, direction: someip_to_dds, service: {}, instance: 1, "
      "eventgroup: 1, event: 0x8001{}}}\n",
      topic, service, more);
}
inline std::string method(const std::string& server, int service) {
  return fmt::format(
      "  - {{ros_service: /actuate, type: std_srvs/srv/SetBool, server: {}, service: {}, instance: 1, "
      "method: 1{}}}\n",
      server, service, server == "ros" ? fmt::format(", port: {}", 40000 + service) : "");
}

/// What may go round in a ring since this was made. A machine that stalls takes its time for it.
class Rounds {
 public:
  /// Until the ring is found: so many in each second.
  [[nodiscard]] std::uint64_t before_found(std::uint64_t in_a_second) const {
    return in_a_second * (1 + static_cast<std::uint64_t>(seconds()));
  }
  /// When it has been found: 200 a second, and as a rule none.
  [[nodiscard]] std::uint64_t after_found() const { return 10 + static_cast<std::uint64_t>(200 * seconds()); }

 private:
  [[nodiscard]] double seconds() const {
    return std::chrono::duration<double>{std::chrono::steady_clock::now() - begin_}.count();
  }
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

/// Several bridges, and a ROS peer in the first domain.
class Rings : public ServicesEndToEnd {
 protected:
  RunningBridge& add(const std::string& lists) { return add(lists, domain_); }
  RunningBridge& add(const std::string& lists, const TestDomain& domain) {
    const auto host = static_cast<std::uint8_t>(bridges_.size() + 3);
    bridges_.push_back(std::make_unique<RunningBridge>(bridge_head(host, domain.id()) + lists));
    return *bridges_.back();
  }
  dds::Reader read(const std::string& topic, const dds::Qos& qos = {}) {
    return reader_elsewhere(topic, string_type, seen_, qos);
  }
  /// Of a participant of its own, as one does not hear itself.
  dds::Reader reader_elsewhere(const std::string& topic, const char* type, Inbox<Bytes>& into,
                               const dds::Qos& qos = {}) {
    return listener_.create_reader(dds::ros_topic_name(topic), dds::ros_type_name(type), qos,
                                   [&into](const dds::Sample& sample) { into.put(copy(sample.cdr())); });
  }
  /// Writes a String when so many readers are there, that of ours among them, and gives how often it comes.
  std::size_t copies_of(dds::Writer& writer, std::size_t readers) {
    EXPECT_TRUE(until([&] { return writer.matched() == readers; }));
    EXPECT_TRUE(writer.write(hello_cdr));
    EXPECT_TRUE(until([&] { return seen_.size() > 0; }));
    run_for(a_while);
    return seen_.take().size();
  }
  /// Writes Strings until the route of this bridge has refused one of another bridge's: how many. Some may be
  /// written before all have found each other.
  std::size_t write_until_bridged(dds::Writer& writer, RunningBridge& bridge, const std::string& topic) {
    EXPECT_TRUE(until([&] { return writer.matched() == 2; }));
    std::size_t written = 0;
    EXPECT_TRUE(until([&] {
      EXPECT_TRUE(writer.write(hello_cdr));
      ++written;
      run_for(50ms);
      return bridge.counter("route " + topic, "dds_from_bridge") > 0;
    }));
    run_for(a_while);
    return written;
  }
  /// Whether it knows so many ends of others on a topic.
  bool knows(RunningBridge& bridge, const std::string& topic, std::uint64_t others) {
    return until([&] { return bridge.counter("route " + topic, "bridges") == others; });
  }
  /// Whether it comes to have counted so many.
  bool counts(RunningBridge& bridge, const std::string& group, const std::string& name, std::uint64_t value) {
    return until([&] { return bridge.counter(group, name) == value; });
  }
  bool subscribed(RunningBridge& bridge, const std::string& topic) {
    return until([&] { return bridge.counter("route " + topic + " from SOME/IP", "subscribed") == 1; });
  }

  dds::Participant listener_{config()};
  std::vector<std::unique_ptr<RunningBridge>> bridges_;
  Inbox<Bytes> seen_;
};

}  // namespace trestle::test::rings_test
