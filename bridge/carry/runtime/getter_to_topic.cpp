#include "bridge/carry/runtime/getter_to_topic.hpp"

#include <algorithm>

#include "bridge/carry/runtime/pacing.hpp"

namespace trestle::carry {

using someip::ReturnCode;

GetterToTopic::GetterToTopic(const Route& route)
    : topic_{route.topic},
      service_{route.service},
      instance_{route.instance},
      notifier_{route.event},
      getter_{*route.getter},
      pacing_{pacing_of(route.tp)} {
  if (getter_.e2e) {
    e2e_.emplace(getter_.e2e->pass_failed);
  }
}

void GetterToTopic::describe(std::vector<OfferedService>& services) {
  const auto service = std::ranges::find_if(services, [this](const OfferedService& one) {
    return one.spec.service == service_ && one.spec.instance == instance_;
  });
  service->spec.methods.push_back(
      {.id = getter_.id,
       .handler = [this](const someip::Message& request,
                         sd::Responder responder) { on_request(request, std::move(responder)); },
       .kind = someip::MethodKind::request_response,
       .pacing = pacing_});
  if (getter_.e2e) {
    service->spec.e2e.push_back(served(getter_.id, *getter_.e2e, true));
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
  const auto value = offer_->value(notifier_);
  if (!value) {
    ++without_value_;
    responder.error(ReturnCode::not_ready);
    return;
  }
  const ByteView bytes{*value};
  ++(responder.respond({&bytes, 1}, value) ? answered_ : not_sent_);
}

void GetterToTopic::append_diagnoses(std::vector<Diagnosis>& diagnoses, bool /*all*/) const {
  if (e2e_) {
    diagnoses.push_back(
        e2e_->diagnosis("the getter of " + topic_, called_id(service_, instance_, getter_.id)));
  }
}

void GetterToTopic::on_change(const std::function<void()>& changed) {
  if (e2e_) {
    e2e_->on_change(changed);
  }
}

CounterGroup GetterToTopic::counters() const {
  using enum Counter::Kind;
  CounterGroup group{"getter of " + topic_,
                     {{"received", received_},
                      {"answered", answered_},
                      {"without_value", without_value_, loss},
                      {"answers_not_sent", not_sent_, loss}}};
  append_e2e(group, e2e_);
  return group;
}

}  // namespace trestle::carry
