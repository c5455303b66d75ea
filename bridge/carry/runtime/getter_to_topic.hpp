#pragma once
#include <optional>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/carry/runtime/e2e_status.hpp"
#include "bridge/carry/runtime/running_route.hpp"

namespace trestle::carry {

/// The getter of a field that a route is the notifier of: answered with the topic's last sample. On the
/// thread that runs the io_context.
class GetterToTopic final : public RunningRoute {
 public:
  /// @param route  which has a getter, and has described its service before.
  explicit GetterToTopic(const Route& route);

  void describe(std::vector<OfferedService>& services) override;
  void join_someip(const ServiceOffers& offers) override { offer_ = &offers.of(service_, instance_); }
  void join_dds() override {}
  void stop() override {}

  [[nodiscard]] CounterGroup counters() const override;
  void append_diagnoses(std::vector<Diagnosis>& diagnoses, bool all) const override;
  [[nodiscard]] bool has_checks() const override { return e2e_.has_value(); }
  void on_change(const std::function<void()>& changed) override;

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
