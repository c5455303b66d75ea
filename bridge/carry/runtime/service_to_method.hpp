#pragma once
#include <memory>
#include <optional>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/carry/runtime/bridge_mark.hpp"
#include "bridge/carry/runtime/conversion_log.hpp"
#include "bridge/carry/runtime/loop_guard.hpp"
#include "bridge/carry/runtime/loop_suspects.hpp"
#include "bridge/carry/runtime/route_context.hpp"
#include "bridge/carry/runtime/route_parts.hpp"
#include "bridge/carry/runtime/running_route.hpp"
#include "bridge/carry/runtime/service_work.hpp"

namespace trestle::carry {

/// A method as a ROS service: requests of ROS clients are converted, put to the SOME/IP service, and answered
/// with what that answers. The ROS service is there only while the SOME/IP service is; one by which another
/// bridge offers the very ROS service is none. On the thread that
/// runs the io_context. docs/services.md tells what becomes of calls that go wrong.
class ServiceToMethod final : public RunningRoute, private CallEnds {
 public:
  /// @param context  outlives the route.
  ServiceToMethod(const RouteContext& context, const MethodRoute& method, MethodParts parts);
  ~ServiceToMethod() override;
  ServiceToMethod(const ServiceToMethod&) = delete;
  ServiceToMethod& operator=(const ServiceToMethod&) = delete;

  /// Looks for the SOME/IP service; when it is there the ROS service begins.
  void join_someip() override;
  /// Nothing is called any more, and the ROS service ends.
  void stop() override;
  void writers_changed() override;

  [[nodiscard]] CounterGroup counters() const override;
  /// Its state is OK while the SOME/IP service is there.
  void append_diagnoses(std::vector<Diagnosis>& diagnoses, bool all) const override;

 private:
  /// The value that the field has, as its notifier tells; nothing: not known any more.
  void note_value(std::optional<ByteView> value);
  /// Whether the SOME/IP service is there, and with it the ROS service.
  [[nodiscard]] bool ready() const noexcept { return server_ != nullptr; }
  /// Has the ROS service begin or end, when the SOME/IP service has.
  void update();
  void update_soon();
  /// Looks for servers that are not ourselves by way of another bridge.
  [[nodiscard]] bool look_for_servers();
  /// The sender of a request, for the LoopGuard; nothing: one that may be part of a ring.
  [[nodiscard]] std::optional<std::uint64_t> sender_of(const dds::RequestId& id);
  void on_request(const dds::RequestId& id, const dds::ServiceMessage& request);
  void tell(const dds::RequestId& id, const std::vector<std::byte>& payload);
  void on_response(const Caller& caller, boost::system::error_code error,
                   const sd::Response& response) override;
  /// The server did not take a value: what it has is the answer.
  void on_refused(const dds::RequestId& id, ByteView wanted, const boost::system::error_code& why);
  [[nodiscard]] std::weak_ptr<CallEnds> ends();
  void ask_getter(const dds::RequestId& id, const std::string& refusal);
  /// What the getter says.
  void on_value(const Caller& caller, const boost::system::error_code& error, const sd::Response& value);
  void reply(const dds::RequestId& id, ByteView payload);
  /// Logs what went wrong, and has it answered where the type can say so.
  void fail(const dds::RequestId& id, const std::string& why, bool is_certain);
  void send(const dds::RequestId& id, std::span<const ByteView> sample);

  const RouteContext& context_;
  const MethodRoute method_;
  LoopSuspects suspects_;  ///< ROS clients
  messages::ServicePlans plans_;
  const dds::ServiceConfig ros_;
  messages::ConversionScratch scratch_;
  ConversionLog log_;
  const std::optional<FailureReply> failure_;
  std::optional<std::vector<std::byte>>
      value_;  ///< of the field, if it is a setter that has no getter to ask
  Returns returns_;
  std::optional<someip::InstanceId> chosen_;  ///< where not all servers may be called
  bool told_returns_ = false;
  std::vector<IpAddress> called_;  ///< where the servers are
  LoopGuard loop_;
  std::shared_ptr<ServiceWork> work_;
  dds::ServiceServerCounters past_;  ///< of servers that have ended
  std::uint64_t received_ = 0;
  std::uint64_t answered_ = 0;
  std::size_t outstanding_ = 0;
  std::uint64_t not_convertible_ = 0;
  std::uint64_t too_large_ = 0;
  std::uint64_t too_many_ = 0;
  std::uint64_t unavailable_ = 0;
  std::uint64_t timed_out_ = 0;
  std::uint64_t not_sent_ = 0;
  std::uint64_t errors_ = 0;
  std::uint64_t refused_ = 0;
  std::uint64_t failures_answered_ = 0;
  std::uint64_t answers_not_convertible_ = 0;
  std::uint64_t ended_ = 0;
  bool stopped_ = false;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
  std::unique_ptr<DdsServer> server_;
  std::unique_ptr<SomeipClient> proxy_;
};

}  // namespace trestle::carry
