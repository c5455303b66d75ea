#pragma once
#include <memory>
#include <optional>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/carry/runtime/bridge_mark.hpp"
#include "bridge/carry/runtime/conversion_log.hpp"
#include "bridge/carry/runtime/counters.hpp"
#include "bridge/carry/runtime/e2e_status.hpp"
#include "bridge/carry/runtime/service_work.hpp"
#include "bridge/carry/runtime/suspected_loop.hpp"
#include "bridge/messages/convert/service_plans.hpp"
#include "dds_adapter/service.hpp"
#include "sd/net/node.hpp"

namespace trestle::carry {

/// A ROS service as a method: requests of SOME/IP clients are converted, put to the ROS service, and answered
/// with what that answers. On the thread that runs the io_context. docs/services.md tells what becomes of
/// calls that go wrong.
class MethodToService {
 public:
  /// @param address  of the bridge in SOME/IP.
  MethodToService(boost::asio::io_context& io, const MethodRoute& method, messages::ServicePlans plans,
                  dds::ServiceConfig ros, const IpAddress& address);
  ~MethodToService();
  MethodToService(const MethodToService&) = delete;
  MethodToService& operator=(const MethodToService&) = delete;

  /// For the offer of the method's service, which must not outlive this object.
  [[nodiscard]] sd::MethodSpec spec();

  /// To be called before the first request comes, that is, before the io_context runs.
  /// @param ready_changed  is called when ready() is another.
  /// @throws dds::DdsError
  void open(dds::Participant& participant, std::function<void()> ready_changed);
  /// Whether the ROS service is there.
  [[nodiscard]] bool ready() const { return was_ready_; }
  /// Nothing is called any more.
  void stop();

  /// Its state, and that of the end-to-end protection, if there is any.
  void append_diagnoses(std::vector<Diagnosis>& diagnoses) const;
  /// Calls `changed` when one of them is another.
  void on_change(const std::function<void()>& changed);
  [[nodiscard]] CounterGroup counters() const;

 private:
  void work(dds::TimePoint now);
  void on_request(const someip::Message& request, sd::Responder responder);
  void on_reply(tl::expected<dds::ServiceMessage, dds::CallFault> reply, sd::Responder& responder);

  const MethodRoute method_;
  SuspectedLoop loop_;  ///< closed by a ROS server at the caller's host
  messages::ServicePlans plans_;
  const dds::ServiceConfig ros_;
  messages::ConversionScratch scratch_;
  ConversionLog log_;
  dds::Participant* participant_ = nullptr;
  Returns returns_;
  std::optional<E2eStatus> e2e_;
  std::shared_ptr<ServiceWork> work_;
  std::function<void()> ready_changed_;
  std::function<void()> changed_;
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
  std::optional<dds::ServiceClient> client_;  // last: it has the calls, which use the above
};

}  // namespace trestle::carry
