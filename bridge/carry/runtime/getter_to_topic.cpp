#include "bridge/carry/runtime/getter_to_topic.hpp"

#include "bridge/carry/runtime/pacing.hpp"

namespace trestle::carry {

using someip::ReturnCode;

void GetterToTopic::describe(ServiceOffers& offers) {
  ServiceOffer& offer = offers.of(route_);
  offer_ = &offer;
  offer.spec().methods.push_back(
      {.id = route_.getter->id,
       .handler = [this](const someip::Message& request,
                         sd::Responder responder) { on_request(request, std::move(responder)); },
       .kind = someip::MethodKind::request_response,
       .pacing = pacing_of(route_.tp)});
  if (route_.getter->e2e) {
    offer.spec().e2e.push_back(served(route_.getter->id, *route_.getter->e2e, true));
  }
}

// A getter is called with nothing [feat_req_someip_633]; what follows that, a newer client means.
// [feat_req_someip_168]
void GetterToTopic::on_request(const someip::Message& request, sd::Responder responder) {
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

void GetterToTopic::append_diagnoses(std::vector<Diagnosis>& diagnoses, bool /*all*/) const {
  append_checks(diagnoses, "the getter of " + route_.topic,
                called_id(route_.service, route_.instance, route_.getter->id));
}

CounterGroup GetterToTopic::counters() const {
  using enum Counter::Kind;
  CounterGroup group{"getter of " + route_.topic,
                     {{"received", received_},
                      {"answered", answered_},
                      {"without_value", without_value_, loss},
                      {"answers_not_sent", not_sent_, loss}}};
  append_e2e(group, e2e_);
  return group;
}

}  // namespace trestle::carry
