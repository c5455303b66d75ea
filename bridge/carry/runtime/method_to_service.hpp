#pragma once
#include <memory>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/carry/runtime/bridge_mark.hpp"
#include "bridge/carry/runtime/call_shares.hpp"
#include "bridge/carry/runtime/conversion_log.hpp"
#include "bridge/carry/runtime/route_context.hpp"
#include "bridge/carry/runtime/route_parts.hpp"
#include "bridge/carry/runtime/running_route.hpp"
#include "bridge/carry/runtime/service_work.hpp"
#include "bridge/carry/runtime/suspected_loop.hpp"

namespace trestle::carry {

/// A ROS service as a method: requests of SOME/IP clients are converted, put to the ROS service, and answered
/// with what that answers. On the thread that runs the io_context. docs/services.md tells what becomes of
/// calls that go wrong.
class MethodToService final : public RunningRoute {
 public:
  /// @param context  outlives the route.
  MethodToService(const RouteContext& context, const MethodRoute& method, MethodParts parts);
  ~MethodToService() override;
  MethodToService(const MethodToService&) = delete;
  MethodToService& operator=(const MethodToService&) = delete;

  void describe(ServiceOffers& offers) override;
  void join_dds() override;
  void stop() override;

  [[nodiscard]] CounterGroup counters() const override;
  /// Its state is OK while the ROS service is there.
  void append_diagnoses(std::vector<Diagnosis>& diagnoses, bool all) const override;

 private:
  [[nodiscard]] sd::MethodSpec spec();
  void work(dds::TimePoint now);
  void on_request(const someip::Message& request, sd::Responder responder);
  void on_reply(tl::expected<dds::ServiceMessage, dds::CallFault> reply, sd::Responder& responder);

  const RouteContext& context_;
  const MethodRoute method_;
  SuspectedLoop loop_;  ///< closed by a ROS server at the caller's host
  messages::ServicePlans plans_;
  const dds::ServiceConfig ros_;
  messages::ConversionScratch scratch_;
  ConversionLog log_;
  ServiceOffer* offer_ = nullptr;
  Returns returns_;
  std::shared_ptr<ServiceWork> work_;
  bool was_ready_ = false;
  std::uint64_t returned_ = 0;
  std::uint64_t received_ = 0;
  std::uint64_t answered_ = 0;
  std::uint64_t in_flight_ = 0;
  std::uint64_t not_convertible_ = 0;
  std::uint64_t too_large_ = 0;
  std::uint64_t answers_not_convertible_ = 0;
  std::uint64_t answers_too_large_ = 0;
  std::uint64_t answers_not_sent_ = 0;
  std::uint64_t over_share_ = 0;
  CallShares shares_;
  std::unique_ptr<DdsClient> client_;  // last: it has the calls, which use the above
};

}  // namespace trestle::carry
