#pragma once
#include <optional>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/carry/runtime/counters.hpp"
#include "bridge/carry/runtime/e2e_status.hpp"
#include "bridge/carry/runtime/offered_services.hpp"
#include "bridge/carry/runtime/service_offer.hpp"

namespace trestle::carry {

/// The getter of a field that a route is the notifier of: answered with the topic's last sample. On the
/// thread that runs the io_context.
class GetterToTopic {
 public:
  /// @param route  which has a getter.
  explicit GetterToTopic(const Route& route);
  GetterToTopic(const GetterToTopic&) = delete;
  GetterToTopic& operator=(const GetterToTopic&) = delete;

  /// Adds the getter to the service of the route, whose offer must not outlive this object.
  void join(std::vector<OfferedService>& services);
  /// To be called before the first request comes. @param offer  has the values; outlives this object.
  void open(const ServiceOffer& offer) { offer_ = &offer; }

  /// Of the end-to-end protection; nothing without.
  [[nodiscard]] E2eStatus* e2e() { return e2e_ ? &*e2e_ : nullptr; }
  [[nodiscard]] Diagnosis diagnosis() const;
  [[nodiscard]] CounterGroup counters() const;

 private:
  void on_request(const someip::Message& request, sd::Responder responder);

  const std::string topic_;
  const someip::ServiceId service_;
  const someip::InstanceId instance_;
  const someip::MethodId notifier_;
  const FieldGetter getter_;
  const someip::TpPacing pacing_;
  const ServiceOffer* offer_ = nullptr;
  std::optional<E2eStatus> e2e_;
  std::uint64_t received_ = 0;
  std::uint64_t answered_ = 0;
  std::uint64_t without_value_ = 0;
  std::uint64_t not_sent_ = 0;
};

}  // namespace trestle::carry
