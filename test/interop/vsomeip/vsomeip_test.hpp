#pragma once
// What the tests with vsomeip share: Trestle's Node at one end of a cable, vsomeip in a process of its own at
// the other, and either in either role.
#include <gmock/gmock.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sd/net/node.hpp"
#include "test/covers.hpp"
#include "test/interop/peer_process.hpp"
#include "test/interop/suite_namespaces.hpp"
#include "test/interop/vsomeip/service.hpp"

namespace trestle::interop {

using sd::CallFault;
using sd::Node;
using someip::EventgroupId;
using someip::InstanceId;
using someip::Message;
using someip::MethodId;
using someip::ReturnCode;
using someip::ServiceId;
using test::covers;
using namespace std::chrono_literals;

inline std::vector<std::byte> to_bytes(const std::vector<std::uint8_t>& numbers) {
  const auto bytes = std::as_bytes(std::span{numbers});
  return {bytes.begin(), bytes.end()};
}

/// What vsomeip_peer prints of a payload, of an answer and of an event.
std::string described(std::size_t size);
std::string answer(std::uint16_t method, int code, std::size_t size);
std::string event(std::uint16_t id, std::size_t size);

/// Return codes of applications and of SOME/IP.
inline constexpr std::array<std::uint8_t, 8> some_errors{0x01, 0x04, 0x05, 0x06, 0x09, 0x20, 0x21, 0x5e};

/// An eventgroup, its event, and how vsomeip_peer subscribes to it.
struct Events {
  std::uint16_t group;
  std::uint16_t event;
  const char* how;
};
inline constexpr Events over_udp{group_udp, event_udp, "udp event"};
inline constexpr Events over_tcp{group_tcp, event_tcp, "tcp event"};
inline constexpr Events by_multicast{group_multicast, event_multicast, "udp event"};

class VsomeipTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite();
  void SetUp() override;
  void TearDown() override;
  /// Whether SetUp() has come to an end.
  [[nodiscard]] static bool ready() { return !IsSkipped() && !HasFatalFailure(); }

  /// @param role  "service" or "client", see vsomeip_peer.cpp.
  void start_peer(const std::string& role);
  /// A Node of ours that can be killed, see node_peer.cpp.
  void start_node_process();

  /// Lets all run until the condition is met, or a process ends by itself: whether it was met.
  template <typename Condition>
  [[nodiscard]] bool run_until(Condition condition, std::chrono::milliseconds limit = 60s) {
    const auto end = std::chrono::steady_clock::now() + limit;
    while (std::chrono::steady_clock::now() < end) {
      for (PeerProcess* one : {peer.get(), node_process.get()}) {
        if (one != nullptr) {
          one->read();
        }
      }
      if (condition()) {
        return true;
      }
      if ((peer && peer->ended()) || (node_process && node_process->ended())) {
        return false;
      }
      io.run_one_for(10ms);
    }
    return condition();
  }
  /// Waits until so many lines of vsomeip begin with this.
  [[nodiscard]] bool prints(const std::string& beginning, std::size_t times = 1) {
    return run_until([&] { return peer->count(beginning) >= times; });
  }

  [[nodiscard]] sd::NodeConfig node_config() const;
  void start_node(const sd::NodeConfig& config);
  void start_node() { start_node(node_config()); }

  bool v6 = false;                            ///< which addresses both have
  std::chrono::milliseconds our_cycle = 1s;   ///< between our offers
  std::chrono::milliseconds peer_cycle = 1s;  ///< between vsomeip's offers
  boost::asio::io_context io;
  std::unique_ptr<PeerProcess> peer;          ///< vsomeip
  std::unique_ptr<PeerProcess> node_process;  ///< our Node, where it is not `node`
  std::unique_ptr<Node> node;
  std::string log;  ///< of our node

 private:
  [[nodiscard]] std::string peer_config(bool serves) const;
  [[nodiscard]] std::string described_counters() const;

  static inline SuiteNamespaces namespaces;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> waiting_{io.get_executor()};
};

/// vsomeip serves, Trestle uses.
class VsomeipServes : public VsomeipTest {
 protected:
  void SetUp() override;
  void require();
  struct Outcome {
    std::optional<CallFault> fault;
    ReturnCode code{};
    std::vector<std::byte> payload;
  };
  Outcome call(std::uint16_t method, Transport transport, const std::vector<std::uint8_t>& payload,
               Duration timeout = 30s);
  /// Has it send an event with so many bytes.
  void emit_event(std::uint16_t event, std::uint32_t size);
  sd::SubscriptionId subscribe(std::uint16_t group, std::uint16_t event, bool tcp = false);

  sd::RequirementId required{};
  std::vector<std::vector<std::byte>> events;  ///< that came
};

/// Trestle serves, vsomeip uses.
class VsomeipUses : public VsomeipTest {
 protected:
  void SetUp() override;
  void serve();
  void tell_to_subscribe(std::uint16_t group, std::uint16_t event, const std::string& how);
  /// ... and waits until both sides agree on it.
  void subscribe(std::uint16_t group, std::uint16_t event, const std::string& how);
  void notify(std::uint16_t event, std::size_t size);

  sd::OfferHandle offer{};
};

}  // namespace trestle::interop
