#pragma once
#include <functional>
#include <memory>
#include <optional>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/carry/runtime/bridge_mark.hpp"
#include "bridge/carry/runtime/conversion_log.hpp"
#include "bridge/carry/runtime/counters.hpp"
#include "bridge/carry/runtime/e2e_status.hpp"
#include "bridge/carry/runtime/report.hpp"
#include "bridge/carry/runtime/silence_reasons.hpp"
#include "bridge/carry/runtime/suspected_loop.hpp"
#include "bridge/messages/convert/conversion_plan.hpp"
#include "dds_adapter/participant.hpp"
#include "sd/net/node.hpp"

namespace trestle::carry {

/// Carries a SOME/IP event to a DDS topic, on the thread that runs the io_context: the reassembled payload is
/// converted where it lies and written to DDS, which copies it once. As the route's presence says, it writes
/// to the topic only while the service is offered, and subscribes only while somebody reads. What another
/// bridge takes from the very topic is not written there again. Where somebody at the sender's host reads the
/// topic who does not say that he is a bridge, what comes again and again is put on trial: LoopGuard.
class EventToTopic {
 public:
  /// Opens sockets on `node`; subscribes, or looks for the service.  @throws someip::NetError
  /// @param node  outlives the route.
  EventToTopic(sd::Node& node, const Route& route, const sd::SubscribeSpec& subscription,
               messages::ConversionPlan plan, Report& report);
  EventToTopic(const EventToTopic&) = delete;
  EventToTopic& operator=(const EventToTopic&) = delete;

  /// To be called before the first event comes, that is, before the io_context runs.
  /// @param participant  outlives the route.
  /// @param user_data  of the writer.
  /// @param address  of the bridge in SOME/IP.
  /// @throws dds::DdsError
  void open(dds::Participant& participant, const std::string& user_data, const IpAddress& address);
  /// Calls `changed` when the state of the end-to-end protection has.
  void on_e2e_change(std::function<void()> changed) {
    if (e2e_) {
      e2e_->on_change(std::move(changed));
    }
  }
  /// Calls `told` with each payload that comes, and with nothing when it is not known any more whether that
  /// is still the value.
  void on_value(std::function<void(std::optional<ByteView> payload)> told) { on_value_ = std::move(told); }
  /// Of the end-to-end protection; nothing without.
  [[nodiscard]] std::optional<Diagnosis> diagnosis() const;
  /// OK while it is subscribed, or need not be as nobody reads.
  [[nodiscard]] Diagnosis state() const;
  /// To be called when the topic's readers have come or gone.
  void readers_changed() { settle(); }
  /// To be called when those may be ends of other bridges.
  void bridges_changed();
  /// Nothing begins or ends any more.
  void stop() { stopped_ = true; }

  [[nodiscard]] CounterGroup counters() const;
  [[nodiscard]] std::uint64_t received() const noexcept { return received_; }
  /// Why nothing has come. @param offers  of the service, as in SomeipSilence; likewise `other_interface`.
  [[nodiscard]] SilenceReason silence(std::span<const sd::SeenOffer> offers,
                                      const std::string& other_interface) const;

 private:
  void carry(const someip::Message& event, const Endpoint& from);
  /// Whether the event was on the topic before.
  [[nodiscard]] bool comes_back(const Endpoint& from);
  void subscribe();
  void settle_soon();
  void settle();
  void make_writer();
  void drop_writer();
  [[nodiscard]] sd::SubscriptionFaults faults() const;
  [[nodiscard]] std::uint64_t bridges() const;

  sd::Node& node_;
  const sd::SubscribeSpec subscription_spec_;
  const Route route_;
  messages::ConversionPlan plan_;
  messages::ConversionScratch scratch_;
  Report& report_;
  ConversionLog log_;
  dds::Participant* participant_ = nullptr;
  std::string user_data_;
  BridgeMark mark_;
  std::optional<Returns> returns_;
  std::vector<IpAddress> told_returns_;
  SuspectedLoop loop_;  ///< closed by who reads the topic and does not say that he is a bridge
  std::optional<dds::Writer> writer_;
  dds::WriterCounters past_writers_;
  std::optional<sd::RequirementId> requirement_;  ///< to write while the service is offered
  std::optional<sd::SubscriptionId> subscription_;
  sd::SubscriptionFaults past_faults_;  ///< of subscriptions that have ended
  std::shared_ptr<const void> port_;    ///< held while there is no subscription, if it has a number
  bool settling_soon_ = false;
  bool stopped_ = false;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
  std::optional<E2eStatus> e2e_;
  std::function<void(std::optional<ByteView>)> on_value_;
  std::uint64_t received_ = 0;
  std::uint64_t carried_ = 0;
  std::uint64_t carried_bytes_ = 0;
  std::uint64_t returned_ = 0;
  std::uint64_t no_reader_ = 0;
  std::uint64_t not_convertible_ = 0;
  std::uint64_t too_large_ = 0;
};

}  // namespace trestle::carry
