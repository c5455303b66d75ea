#pragma once
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "bridge/carry/runtime/bridge_mark.hpp"
#include "bridge/carry/runtime/published_qos.hpp"
#include "bridge/carry/runtime/route_clock.hpp"

namespace trestle::carry {

/// Tells routes what the publishers of their topics offer, by one look at all of them, and not more often
/// than it is worth. On the thread that runs the io_context.
class PublisherWatch {
 public:
  explicit PublisherWatch(RouteClock& clock) : clock_{clock}, next_look_{clock.timer([this] { look(); })} {}
  PublisherWatch(const PublisherWatch&) = delete;
  PublisherWatch& operator=(const PublisherWatch&) = delete;

  /// @param topic, type  their DDS names. @param mark  of the route. @param tell  is called at each look.
  void add(std::string topic, std::string type, BridgeMark mark,
           std::function<void(const PublishedQos&)> tell) {
    told_.emplace(std::pair{std::move(topic), std::move(type)}, Told{std::move(mark), std::move(tell), {}});
  }
  /// Looks. @param dds  outlives this object.
  void open(const DdsSide& dds);
  /// To be called when writers have come or gone.
  void changed();
  void stop();

 private:
  void look();

  struct Told {
    BridgeMark mark;
    std::function<void(const PublishedQos&)> tell;
    PublishedQos published;
  };
  std::map<std::pair<std::string, std::string>, Told> told_;
  const DdsSide* dds_ = nullptr;
  const RouteClock& clock_;
  RouteClock::TimePoint last_{};
  const std::unique_ptr<RouteTimer> next_look_;
};

}  // namespace trestle::carry
