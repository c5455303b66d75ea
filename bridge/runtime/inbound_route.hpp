#pragma once
#include <memory>
#include <optional>

#include "bridge/config/bridge_config.hpp"
#include "bridge/convert/conversion_plan.hpp"
#include "bridge/runtime/conversion_log.hpp"
#include "bridge/runtime/counters.hpp"
#include "bridge/runtime/report.hpp"
#include "dds_adapter/participant.hpp"
#include "sd/net/node.hpp"

namespace trestle::bridge {

/// Carries a SOME/IP event to a DDS topic, on the thread that runs the io_context: the reassembled payload is
/// converted where it lies and written to DDS, which copies it once.
class InboundRoute {
 public:
  /// Subscribes on `node`, which opens sockets.  @throws someip::NetError
  InboundRoute(sd::Node& node, const Route& route, const sd::SubscribeSpec& subscription, ConversionPlan plan,
               Report& report);
  InboundRoute(const InboundRoute&) = delete;
  InboundRoute& operator=(const InboundRoute&) = delete;

  /// To be called before the first event comes, that is, before the io_context runs.  @throws dds::DdsError
  void open(dds::Participant& participant);

  [[nodiscard]] CounterGroup counters() const;

 private:
  void carry(const someip::Message& event);

  const Route route_;
  ConversionPlan plan_;
  ConversionScratch scratch_;
  Report& report_;
  ConversionLog log_;
  std::optional<dds::Writer> writer_;
  std::uint64_t received_ = 0;
  std::uint64_t carried_ = 0;
  std::uint64_t carried_bytes_ = 0;
  std::uint64_t no_reader_ = 0;
  std::uint64_t not_convertible_ = 0;
  std::uint64_t too_large_ = 0;
};

}  // namespace trestle::bridge
