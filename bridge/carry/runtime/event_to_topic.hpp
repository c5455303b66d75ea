#pragma once
#include <functional>
#include <memory>
#include <optional>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/carry/runtime/bridge_mark.hpp"
#include "bridge/carry/runtime/conversion_log.hpp"
#include "bridge/carry/runtime/route_context.hpp"
#include "bridge/carry/runtime/running_route.hpp"
#include "bridge/carry/runtime/suspected_loop.hpp"
#include "bridge/messages/convert/conversion_plan.hpp"

namespace trestle::carry {

/// Carries a SOME/IP event to a DDS topic, on the thread that runs the io_context: the reassembled payload is
/// converted where it lies and written to DDS, which copies it once. As the route's presence says, it writes
/// to the topic only while the service is offered, and subscribes only while somebody reads. What another
/// bridge takes from the very topic is not written there again. Where somebody at the sender's host reads the
/// topic who does not say that he is a bridge, what comes again and again is put on trial: LoopGuard.
class EventToTopic final : public RunningRoute {
 public:
  /// @param context  outlives the route.
  /// @param user_data  of the writer.
  EventToTopic(const RouteContext& context, const Route& route, const sd::SubscribeSpec& subscription,
               messages::ConversionPlan plan, std::string user_data);

  /// Subscribes, or looks for the service.
  void join_someip() override;
  void join_dds() override;
  void stop() override { stopped_ = true; }

  [[nodiscard]] CounterGroup counters() const override;
  /// Its state is OK while it is subscribed, or need not be as nobody reads.
  void append_diagnoses(std::vector<Diagnosis>& diagnoses, bool all) const override;

  [[nodiscard]] const std::string* awaited() const override { return &route_.topic; }
  [[nodiscard]] std::uint64_t received() const override { return received_; }
  [[nodiscard]] SilenceReason silence(const Surroundings& around) const override;

 private:
  void bridges_changed();
  void carry(const someip::Message& event, const Endpoint& from);
  /// Whether the event was on the topic before.
  [[nodiscard]] bool comes_back(const Endpoint& from);
  void subscribe();
  void update_soon();
  void update();
  void make_writer();
  void drop_writer();
  [[nodiscard]] sd::SubscriptionFaults faults() const;
  [[nodiscard]] std::uint64_t bridges() const;

  const RouteContext& context_;
  const sd::SubscribeSpec subscription_spec_;
  const Route route_;
  messages::ConversionPlan plan_;
  messages::ConversionScratch scratch_;
  ConversionLog log_;
  const std::string user_data_;
  const BridgeMark mark_;
  Returns returns_;
  std::vector<IpAddress> told_returns_;
  SuspectedLoop loop_;  ///< closed by who reads the topic and does not say that he is a bridge
  std::unique_ptr<DdsWriter> writer_;
  dds::WriterCounters past_writers_;
  std::optional<sd::RequirementId> requirement_;  ///< to write while the service is offered
  std::optional<sd::SubscriptionId> subscription_;
  sd::SubscriptionFaults past_faults_;  ///< of subscriptions that have ended
  std::shared_ptr<const void> port_;    ///< held while there is no subscription, if it has a number
  bool updating_soon_ = false;
  bool stopped_ = false;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
  FieldValues::Told on_value_;  ///< of each payload
  std::uint64_t received_ = 0;
  std::uint64_t carried_ = 0;
  std::uint64_t carried_bytes_ = 0;
  std::uint64_t returned_ = 0;
  std::uint64_t no_reader_ = 0;
  std::uint64_t not_convertible_ = 0;
  std::uint64_t too_large_ = 0;
};

}  // namespace trestle::carry
