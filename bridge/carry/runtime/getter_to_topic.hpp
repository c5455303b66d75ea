#pragma once
#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/carry/runtime/running_route.hpp"

namespace trestle::carry {

/// The getter of a field that a route is the notifier of: answered with the topic's last sample. On the
/// thread that runs the io_context.
class GetterToTopic final : public RunningRoute {
 public:
  /// @param route  which has a getter.
  explicit GetterToTopic(const Route& route) : RunningRoute{route.getter->e2e}, route_{route} {}

  void describe(ServiceOffers& offers) override;

  [[nodiscard]] CounterGroup counters() const override;
  void append_diagnoses(std::vector<Diagnosis>& diagnoses, bool all) const override;

 private:
  void on_request(const someip::Message& request, sd::Responder responder);

  const Route route_;
  const ServiceOffer* offer_ = nullptr;
  std::uint64_t received_ = 0;
  std::uint64_t answered_ = 0;
  std::uint64_t without_value_ = 0;
  std::uint64_t not_sent_ = 0;
};

}  // namespace trestle::carry
