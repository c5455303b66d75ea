#pragma once
#include <memory>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/carry/runtime/route_context.hpp"
#include "bridge/carry/runtime/running_route.hpp"
#include "bridge/messages/convert/conversion_plan.hpp"

namespace trestle::carry {

/// Carries a DDS topic to a SOME/IP event. Samples arrive on threads of DDS and wait, at most as many as the
/// route's QoS depth, for the thread that runs the io_context; there they are converted and sent. A sample's
/// memory stays on loan from DDS until the last byte of it has been sent: nothing is copied on the way.
///
/// What other bridges brought to the topic from SOME/IP is not carried.
///
/// A subscriber who takes them more slowly than they come gets the newest, as many as the depth: what is
/// dropped is dropped for that subscriber alone.
class TopicToEvent final : public RunningRoute {
 public:
  /// @param context  outlives the route.
  /// @param user_data  of the reader.
  TopicToEvent(const RouteContext& context, const Route& route, messages::ConversionPlan plan,
               std::string user_data);
  ~TopicToEvent() override;
  TopicToEvent(const TopicToEvent&) = delete;
  TopicToEvent& operator=(const TopicToEvent&) = delete;

  void describe(ServiceOffers& offers) override;
  void join_dds() override;
  /// What waits or comes is counted as `stopped`.
  void stop() override;

  /// Where the quality of service is to be as published: asks for the least that the publishers offer.
  /// Until this has been called samples wait, as they may be those of a latched topic. To be called when
  /// publishers have come or gone.
  void follow(const PublishedQos& published) override;

  [[nodiscard]] CounterGroup counters() const override;
  /// OK while somebody publishes the topic.
  void append_diagnoses(std::vector<Diagnosis>& diagnoses, bool all) const override;

  [[nodiscard]] const std::string* awaited() const override;
  [[nodiscard]] std::uint64_t received() const override;
  [[nodiscard]] SilenceReason silence(const Surroundings& around) const override;

 private:
  /// Whether the topic has a publisher now.
  [[nodiscard]] bool published() const;

  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace trestle::carry
