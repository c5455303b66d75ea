#pragma once
#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <memory>
#include <string>
#include <vector>

#include "dds_adapter/ros_names.hpp"
#include "sd/net/handles.hpp"
#include "test/bridge/end_to_end/two_bridges.hpp"
#include "test/bytes.hpp"
#include "test/loopback.hpp"

namespace trestle::test {

using Bytes = std::vector<std::byte>;

inline constexpr const char* string_type = "std_msgs/msg/String";
// "hello" as the default wire rules have it: length, BOM, characters, zero.
inline const Bytes hello = hex("00000009 efbbbf 68656c6c6f 00");
inline const Bytes hello_cdr = hex("00010000 06000000 68656c6c6f 00");

/// A bridge, with SOME/IP stacks and a DDS participant as its neighbours.
class BridgeTest : public DdsTest {
 protected:
  /// @param lists  what the configuration has behind its head: "routes:\n  - ..."
  void start_bridge(const std::string& lists) {
    bridge_ = std::make_unique<RunningBridge>(bridge_head(1, domain_.id()) + lists);
  }
  /// As start_bridge(), but with one multicast offer, and later those that somebody asks for. Who has two
  /// before an answer, as where the machine stalls between them, subscribes anew, and by that gets initial
  /// events once more.
  void start_calm_bridge(const std::string& lists) {
    std::string head = bridge_head(1, domain_.id());
    const std::string often = "cyclic_offer_delay: 100 ms";
    head.replace(head.find(often), often.size(), "cyclic_offer_delay: 3600 s, repetitions_max: 0");
    bridge_ = std::make_unique<RunningBridge>(head + lists);
  }
  /// The same of a stack that the bridge's routes have to do with.
  static sd::NodeConfig calm(sd::NodeConfig config) {
    config.timing.repetitions_max = 0;
    config.timing.cyclic_offer_delay = std::chrono::hours{1};
    return config;
  }

  /// Of a stack that the bridge's routes have to do with.
  static sd::NodeConfig peer_config() {
    return {.address = own_address(2),
            .multicast = own_group(),
            .timing = {.initial_delay_min = Duration{0},
                       .initial_delay_max = 5ms,
                       .repetitions_base_delay = 10ms,
                       .cyclic_offer_delay = 100ms,
                       .ttl_s = 600}};
  }

  /// What the messages to this node came by, discovery left out: "udp", "tcp", "udp and tcp" or "".
  static std::string came_by(const sd::Node& node) {
    const std::uint64_t over_tcp = node.tcp_server_counters().streams.received.messages +
                                   node.tcp_client_counters().streams.received.messages;
    return std::string{node.counters().datagrams > 0 ? "udp" : ""} +
           (node.counters().datagrams > 0 && over_tcp > 0 ? " and " : "") + (over_tcp > 0 ? "tcp" : "");
  }

  [[nodiscard]] dds::Writer writer(const std::string& topic, const char* type = string_type,
                                   const dds::Qos& qos = {}) {
    return ros_.create_writer(dds::ros_topic_name(topic), dds::ros_type_name(type), qos);
  }
  [[nodiscard]] dds::Reader reader(const std::string& topic, const char* type, Inbox<Bytes>& into,
                                   const dds::Qos& qos = {}) {
    return ros_.create_reader(dds::ros_topic_name(topic), dds::ros_type_name(type), qos,
                              [&into](const dds::Sample& sample) { into.put(copy(sample.cdr())); });
  }

  /// Does what the neighbours have to do now.
  virtual void work() {
    io_.poll();
    io_.restart();
  }
  template <typename Condition>
  bool until(Condition condition) {
    return eventually([&] {
      work();
      return condition();
    });
  }
  bool until_counter(const std::string& group, const std::string& name, std::uint64_t value) {
    return until([&] { return bridge_->counter(group, name) == value; });
  }
  /// For what must not happen: 300 ms are long enough for several offers. Time in which the machine stalls
  /// does not count.
  void run_for(std::chrono::milliseconds time) {
    using Clock = std::chrono::steady_clock;
    for (Clock::duration left = time; left > 0s;) {
      const auto before = Clock::now();
      work();
      usleep(1000);
      left -= std::min<Clock::duration>(Clock::now() - before, 5ms);
    }
  }

  boost::asio::io_context io_{1};
  dds::Participant ros_{config()};
  std::unique_ptr<RunningBridge> bridge_;
};

}  // namespace trestle::test
