#include "bridge/carry/runtime/make_routes.hpp"

#include "bridge/carry/config/bridge_config.hpp"

namespace trestle::carry {
namespace {

using someip::ReturnCode;

/// The getter of a field that a route is the notifier of: answered with the topic's last sample. On the
/// thread that runs the io_context.
class GetterToTopic final : public RunningRoute {
 public:
  /// @param route  which has a getter.
  explicit GetterToTopic(const Route& route) : RunningRoute{route.getter->e2e}, route_{route} {}

  void describe(ServiceOffers& offers) override {
    ServiceOffer& offer = offers.of(route_);
    offer_ = &offer;
    offer.spec().methods.push_back(
        {.id = route_.getter->id,
         .handler = [this](const someip::Message& request,
                           sd::Responder responder) { on_request(request, std::move(responder)); },
         .kind = someip::MethodKind::request_response,
         .pacing = route_.tp});
    if (route_.getter->e2e) {
      offer.spec().e2e.push_back(served(route_.getter->id, *route_.getter->e2e, true));
    }
  }

  [[nodiscard]] CounterGroup counters() const override {
    using enum someip::CounterKind;
    CounterGroup group{"getter of " + route_.topic,
                       {{"received", received_},
                        {"answered", answered_},
                        {"without_value", without_value_, loss},
                        {"answers_not_sent", not_sent_, loss}},
                       labels_of(described())};
    append_e2e(group, e2e_);
    return group;
  }

  [[nodiscard]] RoutePicture picture(const Surroundings& /*around*/) const override {
    RoutePicture result = described();
    result.someip.offered = offer_->handle().has_value();
    result.received = received_;
    result.carried = answered_;
    return result;
  }

  void append_diagnoses(std::vector<Diagnosis>& diagnoses, bool /*all*/) const override {
    append_checks(diagnoses, "the getter of " + route_.topic,
                  called_id(route_.service, route_.instance, route_.getter->id));
  }

 private:
  /// What the configuration says of it.
  [[nodiscard]] RoutePicture described() const {
    RoutePicture result = picture_of(route_);
    result.kind = "getter_to_topic";
    result.member = value(route_.getter->id);
    return result;
  }

  // A getter is called with nothing [feat_req_someip_633]; what follows that, a newer client means.
  // [feat_req_someip_168]
  void on_request(const someip::Message& request, sd::Responder responder) {
    ++received_;
    if (const auto refused = refused_by(e2e_, request)) {
      responder.error(*refused);
      return;
    }
    const auto value = offer_->value(route_.event);
    if (!value) {
      ++without_value_;
      responder.error(ReturnCode::not_ready);
      return;
    }
    const ByteView bytes{*value};
    ++(responder.respond({&bytes, 1}, value) ? answered_ : not_sent_);
  }

  const Route route_;
  const ServiceOffer* offer_ = nullptr;
  std::uint64_t received_ = 0;
  std::uint64_t answered_ = 0;
  std::uint64_t without_value_ = 0;
  std::uint64_t not_sent_ = 0;
};

}  // namespace

void getter_to_topic(RouteMaker& maker) {
  maker.each(maker.config.routes, [](const Route& route) {
    return route.getter ? std::make_shared<GetterToTopic>(route) : nullptr;
  });
}

}  // namespace trestle::carry
