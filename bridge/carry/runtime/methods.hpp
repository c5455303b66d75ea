#pragma once
#include <memory>
#include <vector>

#include "bridge/carry/runtime/failure_reply.hpp"
#include "bridge/carry/runtime/method_to_service.hpp"
#include "bridge/carry/runtime/offered_services.hpp"
#include "bridge/carry/runtime/service_offer.hpp"
#include "bridge/carry/runtime/service_to_method.hpp"
#include "bridge/messages/types/type_library.hpp"

namespace trestle::carry {

/// All methods of a bridge, in both directions.
class Methods {
 public:
  /// Compiles the conversions.
  /// @param config  outlives this object, until join_dds() returns.
  /// @throws std::runtime_error  with the place in the configuration.
  Methods(const BridgeConfig& config, messages::TypeLibrary& types);

  /// Looks for the services whose methods are called, and adds the methods that are offered to `services`.
  /// @param node  outlives this object.
  void join_someip(boost::asio::io_context& io, sd::Node& node, std::vector<OfferedService>& services);

  /// The setter that wants to know which values the notifier of this route tells; nothing if none does.
  [[nodiscard]] ServiceToMethod* setter_beside(const Route& notifier) const;

  /// Opens the ROS side.
  /// @param participant  outlives this object, as do the offers.
  /// @throws std::runtime_error  as above.
  void join_dds(dds::Participant& participant, const std::vector<std::unique_ptr<ServiceOffer>>& offers);

  /// To be called when writers of others in DDS have come or gone, among which may be those of bridges.
  void bridges_changed();

  /// Nothing is carried any more.
  void stop();

  void append_counters(std::vector<CounterGroup>& groups) const;
  /// The state of each, and what the checks of end-to-end protection have found.
  void append_diagnoses(std::vector<Diagnosis>& diagnoses) const;
  /// Calls `changed` when the state of one has.
  void on_change(const std::function<void()>& changed);

 private:
  const BridgeConfig& config_;
  struct Compiled {
    messages::ServicePlans plans;
    dds::ServiceConfig ros;
    std::optional<FailureReply> failure{};  ///< server: someip
  };
  static Compiled compile(const MethodRoute& method, messages::TypeLibrary& types);

  std::vector<Compiled> compiled_;  ///< all methods, until they are used
  std::vector<std::unique_ptr<MethodToService>> to_ros_;
  std::vector<std::unique_ptr<ServiceToMethod>> to_someip_;
};

}  // namespace trestle::carry
