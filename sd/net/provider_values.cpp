// The values that a Node keeps: those of fields, and what events with an update rule have sent last.
#include <algorithm>
#include <stdexcept>

#include "sd/net/clock.hpp"
#include "sd/net/discovery_text.hpp"
#include "sd/net/provider.hpp"

namespace trestle::sd {

using someip::MethodId;
using someip::ReturnCode;

// --- Fields -----------------------------------------------------------------------------------------------

std::optional<std::size_t> Provider::field_of(const OpenOffer& offer, MethodId any) {
  const auto found = std::ranges::find_if(offer.spec.fields, [any](const FieldSpec& field) {
    return field.getter == any || field.setter == any || field.notifier == any;
  });
  return found == offer.spec.fields.end()
             ? std::nullopt
             : std::optional{static_cast<std::size_t>(found - offer.spec.fields.begin())};
}

void Provider::call_setter(const OpenOffer& offer, std::size_t field, ByteView wanted, Responder& responder) {
  std::vector<std::byte> value;
  if (const SetHandler& judge = offer.spec.fields[field].on_set) {
    auto judged = judge(wanted);
    if (!judged) {
      responder.error(judged.error() == ReturnCode::ok ? ReturnCode::not_ok : judged.error());
      return;
    }
    value = std::move(*judged);
  } else {
    value.assign(wanted.begin(), wanted.end());
  }
  // The response first, so that who sets the value knows why it is notified.  [feat_req_someip_634]
  responder.respond(ByteView{value});
  if (const auto still = find(offer.handle)) {
    store(*still, still->values[field], std::make_shared<const std::vector<std::byte>>(std::move(value)));
  }
}

bool Provider::is_notifier(OfferHandle handle, MethodId event) const {
  const auto offer = find(handle);
  return offer && std::ranges::any_of(offer->spec.fields,
                                      [event](const FieldSpec& field) { return field.notifier == event; });
}

Notified Provider::set_field(OfferHandle handle, MethodId id, Value value) {
  const auto offer = find(handle);
  if (!offer) {
    return {};
  }
  const auto field = field_of(*offer, id);
  if (!field) {
    throw std::invalid_argument{to_string(offer->spec.service, offer->spec.instance) + " has no field " +
                                hexadecimal(someip::value(id))};
  }
  return store(*offer, offer->values[*field], std::move(value));
}

Provider::Value Provider::field(OfferHandle handle, MethodId id) const {
  const auto offer = find(handle);
  const auto field = offer ? field_of(*offer, id) : std::nullopt;
  return field ? offer->values[*field].value : nullptr;
}

void Provider::forget_field(OfferHandle handle, MethodId id) {
  const auto offer = find(handle);
  const auto field = offer ? field_of(*offer, id) : std::nullopt;
  if (field && !offer->values[*field].schedule.deadline()) {
    offer->values[*field].value = nullptr;
    offer->values[*field].sent = nullptr;
  }
}

// --- Values -----------------------------------------------------------------------------------------------

std::vector<Provider::Ruled> Provider::values_of(ServiceSpec& spec, TimePoint now) const {
  std::vector<Ruled> values;
  values.reserve(spec.fields.size() + spec.events.size());
  for (FieldSpec& field : spec.fields) {
    Ruled& ruled = values.emplace_back(Ruled{field.notifier, someip::UpdateSchedule{field.update},
                                             field.differs, field.pacing.value_or(config_.pacing)});
    if (field.value) {  // which is no change for anybody
      ruled.value = std::make_shared<const std::vector<std::byte>>(std::move(*field.value));
      ruled.sent = ruled.value;
      static_cast<void>(ruled.schedule.on_value(true, now));
    }
  }
  for (const EventSpec& event : spec.events) {
    values.push_back({event.id, someip::UpdateSchedule{event.update}, event.differs, config_.pacing});
  }
  return values;
}

Provider::Ruled* Provider::event_with_rule(OpenOffer& offer, MethodId event) {
  const std::span events = std::span{offer.values}.subspan(offer.spec.fields.size());
  const auto found = std::ranges::find(events, event, &Ruled::event);
  return found == events.end() ? nullptr : &*found;
}

// [feat_req_someip_635]
Notified Provider::store(OpenOffer& offer, Ruled& ruled, Value value) {
  if (!ruled.value || *ruled.value != *value) {
    ruled.value = std::move(value);
  }
  const bool differ =
      !ruled.sent || (ruled.differs ? ruled.differs(*ruled.sent, *ruled.value) : *ruled.sent != *ruled.value);
  const bool due = ruled.schedule.on_value(differ, now());
  arm_cycle();
  return due ? send_value(offer, ruled) : Notified{};
}

Notified Provider::send_value(OpenOffer& offer, Ruled& ruled) {
  ruled.sent = ruled.value;
  const ByteView bytes{*ruled.value};
  return ruled.event ? send_event(offer, *ruled.event, {}, {&bytes, 1}, ruled.value, ruled.pacing)
                     : Notified{};
}

void Provider::send_cyclic_values() {
  for (const auto& offer : offers_) {
    for (Ruled& ruled : offer->values) {
      if (ruled.schedule.on_time(now())) {
        send_value(*offer, ruled);
      }
    }
  }
  arm_cycle();
}

void Provider::arm_cycle() {
  std::optional<TimePoint> next;
  for (const auto& offer : offers_) {
    for (const Ruled& ruled : offer->values) {
      const auto due = ruled.schedule.deadline();
      next = due && (!next || *due < *next) ? due : next;
    }
  }
  cycle_.arm(next);
}

}  // namespace trestle::sd
