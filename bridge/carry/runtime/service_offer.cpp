#include "bridge/carry/runtime/service_offer.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>

namespace trestle::carry {

void ServiceOffer::open(SomeipSide& someip) {
  someip_ = &someip;
  if (!waits_) {
    handle_ = someip.offer(spec_);
    return;
  }
  if (spec_.udp_port) {
    ports_.push_back(someip.hold_port(*spec_.udp_port, Transport::udp));
  }
  if (spec_.tcp_port) {
    ports_.push_back(someip.hold_port(*spec_.tcp_port, Transport::tcp));
  }
}

void ServiceOffer::update() {
  const bool wanted = std::ranges::all_of(needs_, [](const auto& published) { return published(); });
  if (stopped_ || wanted == handle_.has_value()) {
    return;
  }
  if (wanted) {
    try {
      handle_ = someip_->offer(spec_);
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
    someip_->withdraw(*handle_);
    handle_.reset();
  }
}

void ServiceOffer::forget(someip::MethodId notifier) {
  if (handle_) {
    someip_->forget_field(*handle_, notifier);
  }
  const auto field = std::ranges::find(spec_.fields, std::optional{notifier}, &sd::FieldSpec::notifier);
  if (field != spec_.fields.end()) {
    field->value.reset();
  }
}

sd::Notified ServiceOffer::set(someip::MethodId notifier,
                               std::shared_ptr<const std::vector<std::byte>> value) {
  if (handle_) {
    return someip_->set_field(*handle_, notifier, std::move(value));
  }
  const auto field = std::ranges::find(spec_.fields, std::optional{notifier}, &sd::FieldSpec::notifier);
  if (field != spec_.fields.end() && !stopped_) {
    field->value = *value;
  }
  return {};
}

ServiceOffer& ServiceOffers::of(sd::ServiceSpec service, documents::Mark mark) {
  const auto known = std::ranges::find_if(
      offers_, [&](const auto& one) { return one->is_of(service.service, service.instance); });
  return known != offers_.end()
             ? **known
             : *offers_.emplace_back(std::make_unique<ServiceOffer>(std::move(service), mark));
}

}  // namespace trestle::carry
