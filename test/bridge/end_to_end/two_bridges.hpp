#pragma once
#include <future>
#include <memory>
#include <string>
#include <thread>

#include "bridge/carry/runtime/bridge.hpp"
#include "test/dds_adapter/dds_test.hpp"

namespace trestle::test {

/// A bridge that runs in a thread of its own, as one process would.
class RunningBridge {
 public:
  /// @param yaml  the configuration; must be good.
  explicit RunningBridge(const std::string& yaml);
  ~RunningBridge();
  RunningBridge(const RunningBridge&) = delete;
  RunningBridge& operator=(const RunningBridge&) = delete;

  [[nodiscard]] std::thread::id thread() const;
  [[nodiscard]] std::vector<carry::CounterGroup> counters();
  /// The counter `name` of the group whose name begins with `group`.
  [[nodiscard]] std::uint64_t counter(const std::string& group, const std::string& name);
  /// Keeps its thread from all else until the promise is kept or gone: what arrives meanwhile has to wait.
  [[nodiscard]] std::promise<void> busy();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The head of a bridge's configuration: loopback addresses of this process's own, and quick offers.
/// @param host    of its address, see own_address().
/// @param domain  of DDS.
[[nodiscard]] std::string bridge_head(std::uint8_t host, std::uint32_t domain);

/// One topic that crosses both bridges.
struct TestRoute {
  std::string topic;  ///< "/points"
  std::string type;
  bool from_a_to_b = true;
  std::string settings{};         ///< further lines of YAML for both ends, each indented by four blanks
  std::string server_settings{};  ///< and for the end that offers it
};

/// Two bridges on loopback addresses and DDS domains of this process's own, joined by SOME/IP.
class TwoBridges : public DdsTest {
 protected:
  /// Starts both.
  void start(const std::vector<TestRoute>& routes, const std::string& types_folder = "");

  /// Configuration of one end.
  [[nodiscard]] std::string yaml(bool end_a, const std::vector<TestRoute>& routes,
                                 const std::string& types_folder) const;

  [[nodiscard]] dds::Participant participant(std::uint32_t domain) const;

  /// Routes are events of one service instance; else each is a service.
  bool one_service_ = false;
  TestDomain domain_b_;
  /// Participants on either end's DDS domain.
  dds::Participant at_a_ = participant(domain_.id());
  dds::Participant at_b_ = participant(domain_b_.id());
  std::unique_ptr<RunningBridge> a_;
  std::unique_ptr<RunningBridge> b_;
};

}  // namespace trestle::test
