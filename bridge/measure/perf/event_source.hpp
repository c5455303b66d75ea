#pragma once
#include <memory>

#include "bridge/measure/perf/perf_service.hpp"
#include "sd/net/node.hpp"

namespace trestle::measure::perf {

/// Sends events as an EventPlan says. On the Node's thread, as the Node.
class EventSource {
 public:
  /// The Node outlives it.
  EventSource(sd::Node& node, sd::OfferHandle offer);
  ~EventSource();
  EventSource(const EventSource&) = delete;
  EventSource& operator=(const EventSource&) = delete;

  /// Starts anew, from sequence number 1.
  /// @return false, and nothing has changed: nobody has subscribed to the event.
  bool start(const EventPlan& plan);
  void stop();
  void acknowledge(std::uint64_t sequence);

  [[nodiscard]] std::uint64_t events() const noexcept;
  [[nodiscard]] std::uint64_t dropped() const noexcept;

 private:
  struct State;
  std::shared_ptr<State> state_;  ///< also held by events that wait to be sent
};

}  // namespace trestle::measure::perf
