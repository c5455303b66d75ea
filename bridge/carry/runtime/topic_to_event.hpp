#pragma once
#include <memory>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/carry/runtime/counters.hpp"
#include "bridge/carry/runtime/diagnostics.hpp"
#include "bridge/carry/runtime/published_qos.hpp"
#include "bridge/carry/runtime/report.hpp"
#include "bridge/carry/runtime/service_offer.hpp"
#include "bridge/carry/runtime/silence_reasons.hpp"
#include "bridge/messages/convert/conversion_plan.hpp"
#include "dds_adapter/participant.hpp"
#include "sd/net/node.hpp"

namespace trestle::carry {

/// Carries a DDS topic to a SOME/IP event. Samples arrive on threads of DDS and wait, at most as many as the
/// route's QoS depth, for the thread that runs the io_context; there they are converted and sent. A sample's
/// memory stays on loan from DDS until the last byte of it has been sent: nothing is copied on the way.
///
/// What other bridges brought to the topic from SOME/IP is not carried.
///
/// A subscriber who takes them more slowly than they come gets the newest, as many as the depth: what is
/// dropped is dropped for that subscriber alone.
class TopicToEvent {
 public:
  /// @param offer  the service of the route, on `node`; outlives the route.
  /// @param user_data  of the reader.
  /// @param address  of the bridge in SOME/IP.
  /// @throws dds::DdsError
  TopicToEvent(boost::asio::io_context& io, sd::Node& node, ServiceOffer& offer,
               dds::Participant& participant, const Route& route, messages::ConversionPlan plan,
               const std::string& user_data, const IpAddress& address, Report& report);
  ~TopicToEvent();
  TopicToEvent(const TopicToEvent&) = delete;
  TopicToEvent& operator=(const TopicToEvent&) = delete;

  /// From now on nothing is carried: what waits or comes is counted as `stopped`.
  void stop();

  /// Where the quality of service is to be as published: asks for the least that the publishers offer.
  /// Until this has been called samples wait, as they may be those of a latched topic. To be called when
  /// publishers have come or gone; on the thread that runs the io_context.
  void follow(const PublishedQos& published);

  /// Whether the topic has a publisher now.
  [[nodiscard]] bool published() const;

  [[nodiscard]] CounterGroup counters() const;
  [[nodiscard]] std::uint64_t received() const;
  /// OK while somebody publishes the topic.
  [[nodiscard]] Diagnosis state() const;
  /// Why nothing has come. @param writers  of the topic. @param participants  others in the domain.
  [[nodiscard]] SilenceReason silence(std::span<const dds::FoundWriter> writers,
                                      std::size_t participants) const;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace trestle::carry
