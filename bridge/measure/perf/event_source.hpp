#pragma once
#include <array>
#include <boost/asio/steady_timer.hpp>
#include <memory>
#include <vector>

#include "bridge/measure/perf/perf_service.hpp"
#include "sd/net/node.hpp"

namespace trestle::measure::perf {

/// Sends events as an EventPlan says. On the Node's thread, as the Node. In a shared_ptr, which events that
/// wait to be sent hold, too.
class EventSource : public std::enable_shared_from_this<EventSource> {
 public:
  /// The Node outlives it.
  EventSource(sd::Node& node, sd::OfferHandle offer);

  /// Starts anew, from sequence number 1.
  /// @return false, and nothing has changed: nobody has subscribed to the event.
  bool start(const EventPlan& plan);
  void stop();
  void acknowledge(std::uint64_t sequence);

  [[nodiscard]] std::uint64_t events() const noexcept { return events_; }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  struct Event;
  using Front = std::array<std::byte, min_event_bytes>;

  void fill(Front& front, TimePoint due_at) const;
  /// @param due_at  the time from which its latency counts.
  void send(TimePoint due_at);
  void on_sent(std::uint32_t of_round);
  [[nodiscard]] bool has_room() const;
  void pump();
  void pump_later();
  void watch();
  void look();

  sd::Node& node_;
  sd::OfferHandle offer_;
  EventPlan plan_{};
  std::shared_ptr<const std::vector<std::byte>> rest_;
  bool running_ = false;
  bool posted_ = false;
  std::uint32_t round_ = 0;  ///< of start()
  std::uint64_t events_ = 0;
  std::uint64_t dropped_ = 0;
  std::uint64_t acknowledged_ = 0;  ///< sequence number
  unsigned waiting_ = 0;
  Duration period_{};
  TimePoint due_;
  boost::asio::steady_timer due_timer_;
  std::uint64_t acknowledged_before_ = 0;
  std::uint64_t events_before_ = 0;
  boost::asio::steady_timer patience_timer_;
};

}  // namespace trestle::measure::perf
