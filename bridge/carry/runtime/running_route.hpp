#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bridge/carry/runtime/counters.hpp"
#include "bridge/carry/runtime/diagnostics.hpp"
#include "bridge/carry/runtime/offered_services.hpp"
#include "bridge/carry/runtime/published_qos.hpp"
#include "bridge/carry/runtime/service_offer.hpp"
#include "bridge/carry/runtime/silence_reasons.hpp"

namespace trestle::carry {

/// A route, method or getter of the configuration while it runs. Each kind has a file, named by what it does:
/// topic_to_event, event_to_topic, service_to_method, method_to_service, getter_to_topic. (Fields and actions
/// are made of these.) Made by make_routes(); then it joins SOME/IP, then DDS, before the io_context runs or
/// on its thread, on which all else happens, too.
class RunningRoute {
 public:
  RunningRoute() = default;
  virtual ~RunningRoute() = default;
  RunningRoute(const RunningRoute&) = delete;
  RunningRoute& operator=(const RunningRoute&) = delete;

  /// Adds what it offers in SOME/IP to the services of the bridge, whose offers must not be used after the
  /// end of the route.
  virtual void describe(std::vector<OfferedService>& /*services*/) {}
  /// Looks for what it uses in SOME/IP, and takes the offer of what it has described.
  /// @param offers  outlive the route.  @throws someip::NetError
  virtual void join_someip(const ServiceOffers& offers) = 0;
  /// Opens its ends in DDS.  @throws dds::DdsError
  virtual void join_dds() = 0;
  /// Nothing begins any more; what comes is not carried.
  virtual void stop() = 0;

  /// To be called when writers of others in DDS have come or gone, among which may be those of bridges.
  virtual void writers_changed() {}
  /// The same for who follows the publishers of its topic, with what they offer now.
  virtual void follow(const PublishedQos& /*published*/) {}

  [[nodiscard]] virtual CounterGroup counters() const = 0;
  /// Its state, and what the checks of its end-to-end protection have found.
  /// @param all  also states that are only told if that is wanted: there may be a thousand.
  virtual void append_diagnoses(std::vector<Diagnosis>& diagnoses, bool all) const = 0;
  /// Whether it has checks of end-to-end protection, which are told of also if no states are wanted.
  [[nodiscard]] virtual bool has_checks() const { return false; }
  /// Calls `changed` when what append_diagnoses() tells has another level.
  virtual void on_change(const std::function<void()>& /*changed*/) {}

  /// What is waited for, if a person should know when it does not come: the topic. Nothing: as it may.
  [[nodiscard]] virtual const std::string* awaited() const { return nullptr; }
  /// Messages that have come.
  [[nodiscard]] virtual std::uint64_t received() const { return 0; }
  /// Why nothing has come.
  [[nodiscard]] virtual SilenceReason silence(const Surroundings& /*around*/) const { return {}; }
};

}  // namespace trestle::carry
