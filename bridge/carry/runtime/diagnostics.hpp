#pragma once
#include <chrono>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/carry/runtime/counters.hpp"
#include "bridge/carry/runtime/dds_side.hpp"
#include "bridge/carry/runtime/route_clock.hpp"

namespace trestle::carry {

/// A diagnostic_msgs/msg/DiagnosticStatus.
struct Diagnosis {
  enum class Level : std::uint8_t { ok, warn, error, stale };
  Level level = Level::ok;
  std::string name;
  std::string message;
  std::string hardware_id;
  std::vector<std::pair<std::string, std::string>> values;
};

/// What a diagnosis says of a route: "0x1234.0x0001 event 0x8001".
[[nodiscard]] std::string event_id(const Route& route);

/// The state of a method: OK while the server that answers its calls is there, otherwise WARN; its counters
/// are the values.
/// @param missing  what to say when they are not. @param at  what it is for SOME/IP.
[[nodiscard]] Diagnosis method_state(const CounterGroup& counters, bool is_there, const char* missing,
                                     const std::string& at);

/// The state of a route of a topic, likewise. Of its losses those are left out that there are none of: there
/// may be a thousand routes.
[[nodiscard]] Diagnosis route_state(const CounterGroup& counters, bool is_there, const char* missing,
                                    const Route& route);

/// A diagnostic_msgs/msg/DiagnosticArray as CDR, with its encapsulation header.
/// @param stamp  since 1970.
[[nodiscard]] std::vector<std::byte> diagnostic_array(std::chrono::nanoseconds stamp,
                                                      std::span<const Diagnosis> statuses);

/// Publishes what there is to say once a period, and when something has changed. On the thread that runs the
/// io_context.
class Diagnostics {
 public:
  static constexpr const char* type = "diagnostic_msgs/msg/DiagnosticArray";

  /// @param user_data  of the writer.
  /// @throws dds::DdsError
  Diagnostics(RouteClock& clock, DdsSide& dds, const DiagnosticsSettings& settings,
              const std::string& user_data, std::function<std::vector<Diagnosis>()> look);
  Diagnostics(const Diagnostics&) = delete;
  Diagnostics& operator=(const Diagnostics&) = delete;

  /// To be called when a state has changed: it is published soon, and together with others that change now.
  void changed();
  /// To be called, also after the end of this object, when one may have: it is published soon if a level or
  /// message is another than before.
  [[nodiscard]] std::function<void()> asker();

 private:
  using Said = std::vector<std::pair<std::string, std::string>>;
  void look_soon();
  void look();

  const Duration period_;
  std::function<std::vector<Diagnosis>()> look_;
  const std::unique_ptr<DdsWriter> writer_;
  const RouteClock& clock_;
  const std::unique_ptr<RouteTimer> next_look_;
  RouteClock::TimePoint last_{};
  RouteClock::TimePoint due_;  ///< when all is published again, whatever has changed
  bool has_changed_ = false;
  Said said_;  ///< names and messages, as they were published
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace trestle::carry
