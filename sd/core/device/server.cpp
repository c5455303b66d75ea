// Device as a server: offers, events, fields, requests.
#include <cstring>

#include "sd/core/device/device.hpp"

namespace trestle::device {

using someip::Header;
using someip::Message;
using someip::MessageType;
using someip::MethodKind;
using someip::ReturnCode;

namespace {

bool contains(std::span<const EventgroupId> groups, EventgroupId id) noexcept {
  return std::ranges::find(groups, id) != groups.end();
}

// The field with this getter or setter.
std::optional<std::size_t> accessed_field(const Service& service, MethodId id) noexcept {
  for (std::size_t i = 0; i < service.fields.size() && id != MethodId{0}; ++i) {
    if (service.fields[i].getter == id || service.fields[i].setter == id) {
      return i;
    }
  }
  return std::nullopt;
}

MethodKind kind_of(const Service& service, MethodId id) noexcept {
  const auto method = std::ranges::find(service.methods, id, &Method::id);
  if (method != service.methods.end()) {
    return method->kind;
  }
  return accessed_field(service, id) ? MethodKind::request_response : MethodKind::unknown;
}

}  // namespace

// --- Offers -----------------------------------------------------------------------------------------------

bool Device::is_offered(std::size_t service) const noexcept {
  return service < service_slots_.size() && service_slots_[service].offer != sd::OfferHandle{};
}

std::size_t Device::first_event(std::size_t service) const noexcept {
  std::size_t sum = 0;
  for (const Service& one : services_.first(service)) {
    sum += one.events.size() + one.fields.size();
  }
  return sum;
}

EventSlot& Device::field_slot(std::size_t service, std::size_t field) const noexcept {
  return event_slots_[first_event(service) + services_[service].events.size() + field];
}

Result<void> Device::offer(std::size_t index, TimePoint now) noexcept {
  if (index >= services_.size()) {
    return bad(Argument::service);
  }
  const Service& service = services_[index];
  if (!may_be_port(service.port)) {
    return bad(Argument::port);
  }
  if (const BadArgument mistake = mistake_in(service); mistake.argument != Argument::none) {
    return bad(mistake);
  }
  // Only the endpoint tells which instance a message is for.  [feat_req_someip_445] [feat_req_someip_967]
  for (std::size_t i = 0; i < services_.size(); ++i) {
    const Service& other = services_[i];
    if (is_offered(i) && other.service == service.service && other.port == service.port &&
        other.instance != service.instance) {
      return tl::unexpected{Error::duplicate};
    }
  }
  const std::size_t events = first_event(index) + service.events.size() + service.fields.size();
  if (index >= service_slots_.size() || events > event_slots_.size()) {
    return tl::unexpected{Error::table_full};
  }
  const auto offer = discovery_.offer({.service = service.service,
                                       .instance = service.instance,
                                       .major = service.major,
                                       .minor = service.minor,
                                       .udp = Endpoint{own_.address, service.port},
                                       .eventgroups = service.eventgroups,
                                       .ttl_s = service.ttl_s},
                                      now);
  if (!offer) {
    return refused(offer.error());
  }
  service_slots_[index] = {.offer = *offer, .unusual_told = 0};
  for (std::size_t i = 0; i < service.fields.size(); ++i) {
    EventSlot& slot = field_slot(index, i);
    if (!slot.has_value && service.fields[i].initial_bytes) {
      slot.has_value = true;
      slot.value_bytes = static_cast<std::uint32_t>(*service.fields[i].initial_bytes);
    }
  }
  return {};
}

void Device::withdraw(std::size_t service, TimePoint now) noexcept {
  if (is_offered(service)) {
    discovery_.stop_offer(std::exchange(service_slots_[service], {}).offer, now);
  }
}

// --- Events -----------------------------------------------------------------------------------------------

// Whether an event of these eventgroups is sent for the subscription in this place. A subscriber with several
// subscriptions gets it once: for the first of them.  [feat_req_someipsd_1168]
bool Device::is_receiver(std::size_t service, std::span<const EventgroupId> groups,
                         std::size_t place) const noexcept {
  const auto endpoint_at = [&](std::size_t at) -> const Endpoint* {
    const sd::slots::Subscriber* const slot = discovery_.subscription(service_slots_[service].offer, at);
    return slot != nullptr && slot->udp && contains(groups, slot->eventgroup) ? &*slot->udp : nullptr;
  };
  const Endpoint* const endpoint = endpoint_at(place);
  if (endpoint == nullptr) {
    return false;
  }
  for (std::size_t before = 0; before < place; ++before) {
    if (const Endpoint* const other = endpoint_at(before); other != nullptr && *other == *endpoint) {
      return false;
    }
  }
  return true;
}

std::size_t Device::count_receivers(std::size_t service,
                                    std::span<const EventgroupId> groups) const noexcept {
  std::size_t count = 0;
  for (std::size_t place = 0; place < max_subscribers_; ++place) {
    count += is_receiver(service, groups, place) ? 1U : 0U;
  }
  return count;
}

std::size_t Device::subscribers(std::size_t index, MethodId id) const noexcept {
  if (!is_offered(index)) {
    return 0;
  }
  const Service& service = services_[index];
  const auto event = std::ranges::find(service.events, id, &Event::id);
  if (event != service.events.end()) {
    return count_receivers(index, event->eventgroups);
  }
  const auto field = std::ranges::find(service.fields, id, &Field::notifier);
  return field != service.fields.end() && id != MethodId{0} ? count_receivers(index, field->eventgroups) : 0;
}

Header Device::event_header(std::size_t service, MethodId event, EventSlot& slot) const noexcept {
  return {.service = services_[service].service,
          .method = event,
          .session = slot.sessions.next(),  // [feat_req_someip_667]
          .interface_version = services_[service].major,
          .type = MessageType::notification};
}

Result<void> Device::notify(std::size_t index, MethodId id, ByteView payload) noexcept {
  if (index >= services_.size()) {
    return bad(Argument::service);
  }
  const Service& service = services_[index];
  const auto event = std::ranges::find(service.events, id, &Event::id);
  if (event == service.events.end()) {
    return bad(Argument::event);
  }
  if (!is_offered(index)) {
    return tl::unexpected{Error::not_offered};
  }
  if (count_receivers(index, event->eventgroups) == 0) {
    return {};
  }
  if (const auto possible = check_payload(payload); !possible) {
    return possible;
  }
  EventSlot& slot =
      event_slots_[first_event(index) + static_cast<std::size_t>(event - service.events.begin())];
  send_event(index, event_header(index, id, slot), event->eventgroups, payload, queue_.kind_of(payload));
  return {};
}

void Device::send_event(std::size_t service, const Header& header, std::span<const EventgroupId> groups,
                        ByteView payload, SendQueue::Payload kind) noexcept {
  queue_.push_event(header, services_[service].port, static_cast<std::uint16_t>(service), payload, kind,
                    [&](std::size_t place) { return is_receiver(service, groups, place); });
}

// By unicast, also when the subscriber has the events through another eventgroup.  [feat_req_someipsd_793]
// [feat_req_someipsd_1167] Events that belong to no field have no initial value.  [feat_req_someipsd_833]
void Device::send_initial_events(std::size_t index, EventgroupId eventgroup,
                                 const Endpoint& receiver) noexcept {
  const Service& service = services_[index];
  for (std::size_t i = 0; i < service.fields.size(); ++i) {
    const Field& one = service.fields[i];
    const auto value = field(index, i);
    if (one.notifier == MethodId{0} || !value || !contains(one.eventgroups, eventgroup)) {
      continue;
    }
    if (!queue_.has_room(1, 0)) {
      ++counters_.send_queue_full;
      continue;
    }
    queue_.push(event_header(index, one.notifier, field_slot(index, i)), service.port, receiver, *value,
                SendQueue::Payload::of_field);
  }
}

// --- Fields -----------------------------------------------------------------------------------------------

std::optional<ByteView> Device::field(std::size_t service, std::size_t field) const noexcept {
  if (!is_offered(service) || field >= services_[service].fields.size()) {
    return std::nullopt;
  }
  const EventSlot& slot = field_slot(service, field);
  return slot.has_value
             ? std::optional<ByteView>{services_[service].fields[field].room.first(slot.value_bytes)}
             : std::nullopt;
}

// Whether the field can take this value and all subscribers can be notified, with `answers` more messages.
Result<void> Device::check_value(std::size_t service, std::size_t index, ByteView value,
                                 std::size_t answers) const noexcept {
  const Field& one = services_[service].fields[index];
  if (value.size() > one.room.size()) {
    return tl::unexpected{Error::too_large};
  }
  if (queue_.needs(one.room.data())) {
    return tl::unexpected{Error::busy};
  }
  const bool copied = queue_.kind_of(value) == SendQueue::Payload::copied;
  const bool told = one.notifier != MethodId{0} && count_receivers(service, one.eventgroups) != 0;
  if (!queue_.has_room(answers + (told ? 1U : 0U), told && copied ? value.size() : 0)) {
    return tl::unexpected{Error::no_room};
  }
  return {};
}

// [feat_req_someip_635]
void Device::store(std::size_t service, std::size_t index, ByteView value) noexcept {
  const Field& one = services_[service].fields[index];
  const auto old = field(service, index);
  if (old && std::ranges::equal(*old, value)) {
    return;
  }
  if (!value.empty()) {
    std::memmove(one.room.data(), value.data(), value.size());
  }
  EventSlot& slot = field_slot(service, index);
  slot.has_value = true;
  slot.value_bytes = static_cast<std::uint32_t>(value.size());
  if (one.notifier == MethodId{0} || count_receivers(service, one.eventgroups) == 0) {
    return;
  }
  const ByteView kept = one.room.first(value.size());
  const bool copied = queue_.kind_of(kept) == SendQueue::Payload::copied;
  send_event(service, event_header(service, one.notifier, slot), one.eventgroups, kept,
             copied ? SendQueue::Payload::copied : SendQueue::Payload::of_field);
}

Result<void> Device::set_field(std::size_t service, std::size_t field, ByteView value) noexcept {
  if (service >= services_.size()) {
    return bad(Argument::service);
  }
  if (field >= services_[service].fields.size()) {
    return bad(Argument::field);
  }
  if (!is_offered(service)) {
    return tl::unexpected{Error::not_offered};
  }
  if (const auto possible = check_value(service, field, value, 0); !possible) {
    return possible;
  }
  store(service, field, value);
  return {};
}

// --- Requests ---------------------------------------------------------------------------------------------

bool Device::takes(const Header& header) const noexcept {
  for (std::size_t i = 0; i < services_.size(); ++i) {
    const Service& one = services_[i];
    if (is_offered(i) && one.port == to_.port && one.service == header.service &&
        one.major == header.interface_version) {
      return !to_.address.is_multicast() && kind_of(one, header.method) != someip::MethodKind::unknown;
    }
  }
  return false;
}

void Device::on_request(const Message& message) noexcept {
  if (to_.address.is_multicast()) {
    ++counters_.unexpected;
    return;
  }
  someip::RequestTarget target;
  someip::AnswerRules rules;
  std::size_t index = 0;
  for (std::size_t i = 0; i < services_.size(); ++i) {
    const Service& one = services_[i];
    if (!is_offered(i) || one.port != to_.port || one.service != message.header.service) {
      continue;
    }
    if (!target.service) {
      rules = one.answers;
      target.service = true;
    }
    if (one.major == message.header.interface_version) {
      rules = one.answers;
      target.interface_version = true;
      target.method = kind_of(one, message.header.method);
      index = i;
    }
  }
  const someip::RequestCheck check = someip::check_request(message.header, target, rules);
  if (!check.fault) {
    ++counters_.requests;
    handle({.service = index, .header = message.header, .from = from_, .payload = message.payload});
  } else if (check.answer) {
    ++counters_.requests_answered;
    answer(*check.answer, {});
  } else {
    ++counters_.unexpected;
  }
}

void Device::handle(const Request& request) noexcept {
  const Service& service = services_[request.service];
  const auto index = accessed_field(service, request.header.method);
  const bool is_method =
      std::ranges::find(service.methods, request.header.method, &Method::id) != service.methods.end();
  if (is_method || !index) {
    ready_ = request;
    return;
  }
  const Field& one = service.fields[*index];
  if (one.setter == request.header.method) {
    if (one.judged) {
      ready_ = request;
    } else {
      set(request, *index);
    }
    // A getter has no parameters  [feat_req_someip_633]; a payload comes from a newer client.
    // [feat_req_someip_168]
  } else if (const auto value = field(request.service, *index)) {
    answer(someip::answer_header(request.header, ReturnCode::ok, service.answers), *value);
  } else {
    refuse(request, ReturnCode::not_ready);
  }
}

void Device::refuse(const Request& request, ReturnCode code) noexcept {
  if (const auto header = someip::error_answer(request.header, code, services_[request.service].answers)) {
    answer(*header, {});
  }
}

// The response first, so that the client that sets the value knows why it is notified.  [feat_req_someip_634]
void Device::set(const Request& request, std::size_t index) noexcept {
  const auto possible = check_value(request.service, index, request.payload, 1);
  if (!possible) {
    refuse(request,
           possible.error() == Error::too_large ? ReturnCode::malformed_message : ReturnCode::not_ready);
    return;
  }
  accept_value(request, index, request.payload);
  ready_ = FieldSet{.service = request.service,
                    .field = index,
                    .value = services_[request.service].fields[index].room.first(request.payload.size())};
}

void Device::accept_value(const Request& request, std::size_t index, ByteView value) noexcept {
  const Service& service = services_[request.service];
  const ByteView kept = service.fields[index].room.first(value.size());
  queue_.push(someip::answer_header(request.header, ReturnCode::ok, service.answers), service.port,
              request.from, kept, SendQueue::Payload::of_field);
  store(request.service, index, value);
}

Result<void> Device::accept(const Request& request, ByteView value) noexcept {
  if (request.service >= services_.size()) {
    return bad(Argument::service);
  }
  const auto index = accessed_field(services_[request.service], request.header.method);
  if (!index || services_[request.service].fields[*index].setter != request.header.method) {
    return bad(Argument::request);
  }
  if (!is_offered(request.service)) {
    return tl::unexpected{Error::not_offered};
  }
  if (const auto possible = check_value(request.service, *index, value, 1); !possible) {
    return possible;
  }
  accept_value(request, *index, value);
  return {};
}

Result<void> Device::respond(const Request& request, ByteView payload) noexcept {
  if (request.service >= services_.size()) {
    return bad(Argument::service);
  }
  if (request.header.type != MessageType::request) {
    return {};
  }
  if (const auto possible = check_payload(payload); !possible) {
    return possible;
  }
  const Service& service = services_[request.service];
  queue_.push(someip::answer_header(request.header, ReturnCode::ok, service.answers), service.port,
              request.from, payload, queue_.kind_of(payload));
  return {};
}

Result<void> Device::respond_error(const Request& request, ReturnCode code, ByteView payload) noexcept {
  if (request.service >= services_.size()) {
    return bad(Argument::service);
  }
  if (code == ReturnCode::ok) {
    return bad(Argument::return_code);
  }
  const Service& service = services_[request.service];
  const auto header = someip::error_answer(request.header, code, service.answers);
  if (!header) {
    return {};
  }
  if (payload.size() > queue_.max_copied_bytes()) {
    return tl::unexpected{Error::too_large};
  }
  if (const auto possible = check_payload(payload); !possible) {
    return possible;
  }
  queue_.push(*header, service.port, request.from, payload, SendQueue::Payload::copied);
  return {};
}

// --- What discovery tells ---------------------------------------------------------------------------------

std::optional<std::size_t> Device::service_of(sd::OfferHandle offer) const noexcept {
  const auto found = std::ranges::find(service_slots_, offer, &ServiceSlot::offer);
  return found == service_slots_.end()
             ? std::nullopt
             : std::optional{static_cast<std::size_t>(found - service_slots_.begin())};
}

std::optional<Happening> Device::next_unusual_id() noexcept {
  for (std::size_t i = 0; i < service_slots_.size(); ++i) {
    std::optional<std::uint16_t>& told = service_slots_[i].unusual_told;
    if (!told) {
      continue;
    }
    if (const auto id = unusual_id(services_[i], (*told)++)) {
      return UnusualId{i, *id};
    }
    told.reset();
  }
  return std::nullopt;
}

std::optional<Happening> Device::on_event(const sd::SubscriberAdded& event) noexcept {
  const auto service = service_of(event.offer);
  if (!service || !event.subscriber.udp) {
    return std::nullopt;
  }
  if (event.initial_data) {
    send_initial_events(*service, event.eventgroup, *event.subscriber.udp);
  }
  return SubscriberAdded{*service, event.eventgroup, *event.subscriber.udp};
}

std::optional<Happening> Device::on_event(const sd::InitialDataRequested& event) noexcept {
  const auto service = service_of(event.offer);
  if (!service || !event.subscriber.udp) {
    return std::nullopt;
  }
  send_initial_events(*service, event.eventgroup, *event.subscriber.udp);
  return SubscriberAdded{*service, event.eventgroup, *event.subscriber.udp, true};
}

std::optional<Happening> Device::on_event(const sd::SubscriberRemoved& event) noexcept {
  const auto service = service_of(event.offer);
  if (!service || !event.subscriber.udp) {
    return std::nullopt;
  }
  return SubscriberRemoved{*service, event.eventgroup, *event.subscriber.udp, event.reason};
}

}  // namespace trestle::device
