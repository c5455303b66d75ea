#include "bridge/carry/runtime/service_offer.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>

namespace trestle::carry {

ServiceOffer::ServiceOffer(SomeipSide& someip, sd::ServiceSpec spec, bool while_published)
    : someip_{someip}, spec_{std::move(spec)} {
  if (!while_published) {
    handle_ = someip_.offer(spec_);
    return;
  }
  if (spec_.udp_port) {
    ports_.push_back(someip_.hold_port(*spec_.udp_port, Transport::udp));
  }
  if (spec_.tcp_port) {
    ports_.push_back(someip_.hold_port(*spec_.tcp_port, Transport::tcp));
  }
}

void ServiceOffer::update() {
  const bool wanted = std::ranges::all_of(needs_, [](const auto& published) { return published(); });
  if (stopped_ || wanted == handle_.has_value()) {
    return;
  }
  if (wanted) {
    try {
      handle_ = someip_.offer(spec_);
    } catch (const std::exception& error) {
      spdlog::error("{}", error.what());
    }
  } else {
    withdraw();
    for (sd::FieldSpec& field : spec_.fields) {
      field.value.reset();
    }
  }
}

void ServiceOffer::withdraw() {
  if (handle_) {
    someip_.withdraw(*handle_);
    handle_.reset();
  }
}

void ServiceOffer::forget(someip::MethodId notifier) {
  if (handle_) {
    someip_.forget_field(*handle_, notifier);
  }
  const auto field = std::ranges::find(spec_.fields, std::optional{notifier}, &sd::FieldSpec::notifier);
  if (field != spec_.fields.end()) {
    field->value.reset();
  }
}

sd::Notified ServiceOffer::set(someip::MethodId notifier,
                               std::shared_ptr<const std::vector<std::byte>> value) {
  if (handle_) {
    return someip_.set_field(*handle_, notifier, std::move(value));
  }
  const auto field = std::ranges::find(spec_.fields, std::optional{notifier}, &sd::FieldSpec::notifier);
  if (field != spec_.fields.end() && !stopped_) {
    field->value = *value;
  }
  return {};
}

ServiceOffer& ServiceOffers::of(someip::ServiceId service, someip::InstanceId instance) const {
  return **std::ranges::find_if(offers_, [&](const auto& one) {
    return one->spec().service == service && one->spec().instance == instance;
  });
}

}  // namespace trestle::carry
