#include "trestle.h"

#include <bit>
#include <memory>

#include "sd/c/tables.hpp"

using trestle::ByteSpan;
using trestle::ByteView;
using trestle::Duration;
using trestle::Endpoint;
using trestle::TimePoint;
using trestle::c::id;
namespace c = trestle::c;
namespace device = trestle::device;
namespace sd = trestle::sd;
namespace someip = trestle::someip;

struct trestle_device {
  trestle_device(const device::Settings& settings, const device::MemoryView& memory) noexcept
      : core{settings, memory} {}
  device::Device core;
};

namespace {

// --- From C and back --------------------------------------------------------------------------------------

TimePoint time(std::uint64_t now_ns) noexcept {
  return TimePoint{Duration{static_cast<Duration::rep>(now_ns)}};
}

ByteView view(const std::uint8_t* bytes, std::size_t size) noexcept {
  return std::as_bytes(std::span{bytes, size});
}

const std::uint8_t* bytes_of(const std::byte* bytes) noexcept {
  return static_cast<const std::uint8_t*>(static_cast<const void*>(bytes));
}

Endpoint endpoint(const trestle_endpoint& from) noexcept {
  Endpoint to;
  std::ranges::copy(from.address, to.address.bytes.begin());
  if (!from.v6) {
    std::fill(to.address.bytes.begin() + 4, to.address.bytes.end(), std::uint8_t{0});
  }
  to.address.v6 = from.v6;
  to.port = from.port;
  return to;
}

trestle_endpoint endpoint(const Endpoint& from) noexcept {
  trestle_endpoint to{};
  std::ranges::copy(from.address.bytes, std::begin(to.address));
  to.v6 = from.address.v6;
  to.port = from.port;
  return to;
}

trestle_status status_of(device::Error error) noexcept {
  constexpr int first = TRESTLE_BAD_ARGUMENT;  // they are in the same order
  static_assert(TRESTLE_TOO_LARGE == first + static_cast<int>(device::Error::too_large));
  return static_cast<trestle_status>(first + static_cast<int>(error));
}

template <typename T>
trestle_status status_of(const device::Result<T>& result) noexcept {
  return result ? TRESTLE_OK : status_of(result.error());
}

device::Request request_of(const trestle_request& from) noexcept {
  return {.service = from.service,
          .header = {.service = id<someip::ServiceId>(from.service_id),
                     .method = id<someip::MethodId>(from.method),
                     .client = id<someip::ClientId>(from.client),
                     .session = id<someip::SessionId>(from.session),
                     .protocol = from.protocol,
                     .interface_version = from.interface_version,
                     .type = someip::MessageType{from.type},
                     .return_code = someip::ReturnCode{from.return_code}},
          .from = endpoint(from.from)};
}

trestle_request request_of(const device::Request& from) noexcept {
  return {.service = from.service,
          .from = endpoint(from.from),
          .service_id = someip::value(from.header.service),
          .method = someip::value(from.header.method),
          .client = someip::value(from.header.client),
          .session = someip::value(from.header.session),
          .protocol = from.header.protocol,
          .interface_version = from.header.interface_version,
          .type = static_cast<std::uint8_t>(from.header.type),
          .return_code = static_cast<std::uint8_t>(from.header.return_code)};
}

std::uint32_t number_of(someip::CallHandle call) noexcept {
  return (std::uint32_t{call.generation} << 16U) | call.index;
}

// --- Memory and settings
// ------------------------------------------------------------------------------------

device::Limits limits_of(const trestle_limits& from) noexcept {
  return {.services = from.services,
          .eventgroups = from.eventgroups,
          .events = from.events,
          .subscribers = from.subscribers,
          .peers = from.peers,
          .needs = from.needs,
          .subscriptions = from.subscriptions,
          .remote_services = from.remote_services,
          .calls = from.calls,
          .pending_entries = from.pending_entries,
          .pending_events = from.pending_events,
          .sends = from.sends,
          .send_bytes = from.send_bytes,
          .tp_buffers = from.tp_buffers,
          .tp_buffer_bytes = from.tp_buffer_bytes};
}

constexpr std::size_t object_bytes = device::aligned(sizeof(trestle_device), device::memory_alignment);

std::size_t core_bytes(const device::Limits& limits) noexcept {
  return device::aligned(device::memory_bytes(limits), device::memory_alignment);
}

// Bounds of trestle.h, which a C compiler cannot know; those of slots are in tables.cpp.
static_assert(TRESTLE_OBJECT_BYTES_ >= object_bytes);
static_assert(TRESTLE_DATAGRAM_BYTES >= device::Device::datagram_bytes);

device::Settings settings_of(const trestle_settings& from, const c::Tables& tables) noexcept {
  using std::chrono::milliseconds;
  device::Settings settings;
  settings.discovery.unicast = endpoint(from.own);
  settings.discovery.multicast = endpoint(from.multicast);
  settings.discovery.seed = from.seed;
  sd::Timing& timing = settings.discovery.timing;
  timing.initial_delay_min = milliseconds{from.initial_delay_min_ms};
  timing.initial_delay_max = milliseconds{from.initial_delay_max_ms};
  timing.repetitions_base_delay = milliseconds{from.repetitions_base_delay_ms};
  timing.repetitions_max = from.repetitions_max;
  timing.cyclic_offer_delay = milliseconds{from.cyclic_offer_delay_ms};
  timing.request_response_delay_min = milliseconds{from.request_response_delay_min_ms};
  timing.request_response_delay_max = milliseconds{from.request_response_delay_max_ms};
  timing.ttl_s = from.ttl_s;
  settings.client = id<device::ClientId>(from.client);
  settings.pacing.burst = from.tp_burst;
  settings.pacing.separation = std::chrono::microseconds{from.tp_separation_us};
  settings.reassembly_timeout = milliseconds{from.reassembly_timeout_ms};
  settings.services = tables.services;
  settings.needs = tables.needs;
  return settings;
}

// --- Happenings -------------------------------------------------------------------------------------------

class Translator {
 public:
  explicit Translator(trestle_happening& to) noexcept : to_{to} { to_ = {}; }

  void operator()(const device::Request& from) noexcept {
    to_.kind = TRESTLE_REQUEST;
    to_.index = from.service;
    to_.request = request_of(from);
    to_.method = to_.request.method;
    payload(from.payload);
  }
  void operator()(const device::FieldSet& from) noexcept {
    place(TRESTLE_FIELD_SET, from.service, from.field);
    payload(from.value);
  }
  void operator()(const device::EventReceived& from) noexcept {
    place(TRESTLE_EVENT, from.need, from.subscription);
    to_.method = someip::value(from.header.method);
    payload(from.payload);
  }
  void operator()(const device::CallEnded& from) noexcept {
    to_.kind = TRESTLE_CALL_ENDED;
    to_.call = number_of(from.call);
    to_.answered = from.answered;
    to_.return_code = static_cast<std::uint8_t>(from.code);
    payload(from.payload);
  }
  void operator()(const device::ServiceAvailable& from) noexcept {
    place(TRESTLE_SERVICE_AVAILABLE, from.need, 0);
    to_.peer = endpoint(from.service.udp.value_or(from.service.peer));
  }
  void operator()(const device::ServiceLost& from) noexcept {
    place(TRESTLE_SERVICE_LOST, from.need, 0);
    to_.peer = endpoint(from.service.udp.value_or(from.service.peer));
  }
  void operator()(const device::Subscribed& from) noexcept {
    place(TRESTLE_SUBSCRIBED, from.need, from.subscription);
    if (from.multicast) {
      to_.peer = endpoint(*from.multicast);
    }
  }
  void operator()(const device::SubscriptionRefused& from) noexcept {
    place(TRESTLE_SUBSCRIPTION_REFUSED, from.need, from.subscription);
  }
  void operator()(const device::SubscriptionLost& from) noexcept {
    place(TRESTLE_SUBSCRIPTION_LOST, from.need, from.subscription);
  }
  void operator()(const device::SubscriberAdded& from) noexcept {
    subscriber(TRESTLE_SUBSCRIBER_ADDED, from);
  }
  void operator()(const device::SubscriberRemoved& from) noexcept {
    subscriber(TRESTLE_SUBSCRIBER_REMOVED, from);
  }
  void operator()(const device::SendFinished& from) noexcept {
    to_.kind = TRESTLE_SEND_FINISHED;
    to_.payload = bytes_of(from.payload);
  }

  void operator()(const device::UnusualId& from) noexcept {
    place(TRESTLE_UNUSUAL_ID, from.service, 0);
    to_.method = someip::value(from.id);
  }

 private:
  void place(trestle_happening_kind kind, std::size_t index, std::size_t part) noexcept {
    to_.kind = kind;
    to_.index = index;
    to_.part = part;
  }
  void payload(ByteView bytes) noexcept {
    to_.payload = bytes_of(bytes.data());
    to_.size = bytes.size();
  }
  template <typename What>
  void subscriber(trestle_happening_kind kind, const What& from) noexcept {
    place(kind, from.service, 0);
    to_.eventgroup = someip::value(from.eventgroup);
    to_.peer = endpoint(from.subscriber);
  }

  trestle_happening& to_;
};

// Not std::visit: with so many alternatives it calls through a table, and what stack that needs is unknown.
template <typename... Kinds>
void translate(const std::variant<Kinds...>& what, Translator translator) noexcept {
  const auto if_it_is = [&](const auto* kind) {
    if (kind != nullptr) {
      translator(*kind);
    }
  };
  (if_it_is(std::get_if<Kinds>(&what)), ...);
}

}  // namespace

// --- The functions of trestle.h ---------------------------------------------------------------------------

size_t trestle_memory_bytes(const trestle_limits* limits) {
  return device::aligned(object_bytes + core_bytes(limits_of(*limits)) + c::most_tables_bytes(*limits),
                         device::memory_alignment);
}

void trestle_default_settings(trestle_settings* settings) {
  const sd::Settings discovery;
  const sd::Timing timing;
  const device::Settings own;
  const auto ms = [](Duration duration) {
    return static_cast<std::uint32_t>(
        std::chrono::duration_cast<std::chrono::milliseconds>(duration).count());
  };
  *settings = {};
  settings->own.port = 30490;  // [feat_req_someip_676]
  settings->multicast = endpoint(discovery.multicast);
  settings->client = someip::value(own.client);
  settings->initial_delay_min_ms = ms(timing.initial_delay_min);
  settings->initial_delay_max_ms = ms(timing.initial_delay_max);
  settings->repetitions_base_delay_ms = ms(timing.repetitions_base_delay);
  settings->repetitions_max = timing.repetitions_max;
  settings->cyclic_offer_delay_ms = ms(timing.cyclic_offer_delay);
  settings->request_response_delay_min_ms = ms(timing.request_response_delay_min);
  settings->request_response_delay_max_ms = ms(timing.request_response_delay_max);
  settings->ttl_s = timing.ttl_s;
  settings->tp_burst = static_cast<std::uint16_t>(own.pacing.burst.value_or(1));
  settings->tp_separation_us = static_cast<std::uint32_t>(own.pacing.separation.count() / 1000);
  settings->reassembly_timeout_ms = ms(own.reassembly_timeout);
}

trestle_status trestle_init(void* memory, size_t bytes, const trestle_limits* limits,
                            const trestle_settings* settings, trestle_device** device) {
  const device::Limits core = limits_of(*limits);
  if (!device::are_possible(core)) {
    return TRESTLE_BAD_LIMITS;
  }
  if (trestle_bad_setting(settings) != TRESTLE_ARGUMENT_NONE) {
    return TRESTLE_BAD_ARGUMENT;
  }
  const c::Sizes sizes = c::sizes_of(*settings);
  if (!c::are_within(sizes, *limits)) {
    return TRESTLE_TABLE_FULL;
  }
  const ByteSpan all{static_cast<std::byte*>(memory), bytes};
  if (bytes < object_bytes + core_bytes(core) + c::tables_bytes(sizes)) {
    return TRESTLE_NO_MEMORY;
  }
  const auto view = device::lay_out(core, all.subspan(object_bytes, core_bytes(core)));
  if (!view) {
    return TRESTLE_NO_MEMORY;  // not aligned
  }
  const c::Tables tables = c::copy_tables(*settings, sizes, all.subspan(object_bytes + core_bytes(core)));
  *device = std::construct_at(static_cast<trestle_device*>(memory), settings_of(*settings, tables), *view);
  return TRESTLE_OK;
}

static_assert(TRESTLE_ARGUMENT_FIELD_INITIAL_BYTES ==
              static_cast<int>(device::Argument::field_initial_bytes));  // they are in the same order

trestle_argument trestle_bad(const trestle_device* device, size_t* index) {
  const device::BadArgument& bad = device->core.bad_argument();
  if (index != nullptr) {
    *index = bad.index;
  }
  return static_cast<trestle_argument>(bad.argument);
}

trestle_argument trestle_bad_setting(const trestle_settings* settings) {
  if (settings->initial_delay_min_ms > settings->initial_delay_max_ms) {
    return TRESTLE_ARGUMENT_INITIAL_DELAY;
  }
  if (settings->request_response_delay_min_ms > settings->request_response_delay_max_ms) {
    return TRESTLE_ARGUMENT_REQUEST_RESPONSE_DELAY;
  }
  if (settings->ttl_s < 1 || settings->ttl_s > sd::infinite_ttl_s) {
    return TRESTLE_ARGUMENT_TTL;
  }
  return settings->tp_burst < 1 ? TRESTLE_ARGUMENT_TP_BURST : TRESTLE_ARGUMENT_NONE;
}

const char* trestle_argument_name(trestle_argument argument) {
  switch (argument) {
    case TRESTLE_ARGUMENT_INITIAL_DELAY:
      return "initial_delay";
    case TRESTLE_ARGUMENT_REQUEST_RESPONSE_DELAY:
      return "request_response_delay";
    case TRESTLE_ARGUMENT_TP_BURST:
      return "tp_burst";
    default:
      return device::to_string(static_cast<device::Argument>(argument));
  }
}

trestle_status trestle_offer(trestle_device* device, size_t service, uint64_t now_ns) {
  return status_of(device->core.offer(service, time(now_ns)));
}

void trestle_withdraw(trestle_device* device, size_t service, uint64_t now_ns) {
  device->core.withdraw(service, time(now_ns));
}

trestle_status trestle_notify(trestle_device* device, size_t service, uint16_t event, const uint8_t* payload,
                              size_t size) {
  return status_of(device->core.notify(service, id<device::MethodId>(event), view(payload, size)));
}

trestle_status trestle_set_field(trestle_device* device, size_t service, size_t field, const uint8_t* value,
                                 size_t size) {
  return status_of(device->core.set_field(service, field, view(value, size)));
}

const uint8_t* trestle_field_value(const trestle_device* device, size_t service, size_t field, size_t* size) {
  const auto value = device->core.field(service, field);
  if (!value) {
    return nullptr;
  }
  *size = value->size();
  return bytes_of(value->data());
}

size_t trestle_subscribers(const trestle_device* device, size_t service, uint16_t event) {
  return device->core.subscribers(service, id<device::MethodId>(event));
}

size_t trestle_max_copied_bytes(const trestle_device* device) {
  return device->core.max_copied_bytes();
}

trestle_status trestle_respond(trestle_device* device, const trestle_request* request, const uint8_t* payload,
                               size_t size) {
  return status_of(device->core.respond(request_of(*request), view(payload, size)));
}

trestle_status trestle_respond_error(trestle_device* device, const trestle_request* request,
                                     uint8_t return_code) {
  return status_of(device->core.respond_error(request_of(*request), someip::ReturnCode{return_code}));
}

trestle_status trestle_accept(trestle_device* device, const trestle_request* request, const uint8_t* value,
                              size_t size) {
  return status_of(device->core.accept(request_of(*request), view(value, size)));
}

trestle_status trestle_require(trestle_device* device, size_t need, uint64_t now_ns) {
  return status_of(device->core.require(need, time(now_ns)));
}

void trestle_release(trestle_device* device, size_t need, uint64_t now_ns) {
  device->core.release(need, time(now_ns));
}

bool trestle_available(trestle_device* device, size_t need) {
  return device->core.available(need);
}

trestle_status trestle_call(trestle_device* device, size_t need, uint16_t method, const uint8_t* payload,
                            size_t size, uint64_t timeout_ns, uint64_t now_ns, uint32_t* call) {
  const auto started = device->core.call(need, id<device::MethodId>(method), view(payload, size),
                                         Duration{static_cast<Duration::rep>(timeout_ns)}, time(now_ns));
  if (started) {
    *call = number_of(*started);
  }
  return status_of(started);
}

trestle_status trestle_tell(trestle_device* device, size_t need, uint16_t method, const uint8_t* payload,
                            size_t size) {
  return status_of(device->core.tell(need, id<device::MethodId>(method), view(payload, size)));
}

bool trestle_cancel(trestle_device* device, uint32_t call) {
  return device->core.cancel({static_cast<std::uint16_t>(call), static_cast<std::uint16_t>(call >> 16U)});
}

void trestle_link_down(trestle_device* device) {
  device->core.link_down();
}

void trestle_link_up(trestle_device* device, uint64_t now_ns) {
  device->core.link_up(time(now_ns));
}

void trestle_shutdown(trestle_device* device, uint64_t now_ns) {
  device->core.shutdown(time(now_ns));
}

void trestle_on_datagram(trestle_device* device, const uint8_t* datagram, size_t size,
                         const trestle_endpoint* from, const trestle_endpoint* to, uint64_t now_ns) {
  device->core.on_datagram(view(datagram, size), endpoint(*from), endpoint(*to), time(now_ns));
}

void trestle_unreachable(trestle_device* device, const trestle_endpoint* receiver) {
  device->core.unreachable(endpoint(*receiver));
}

void trestle_on_time(trestle_device* device, uint64_t now_ns) {
  device->core.on_time(time(now_ns));
}

bool trestle_poll_transmit(trestle_device* device, uint8_t* room, size_t room_bytes, uint64_t now_ns,
                           trestle_transmit* transmit) {
  const auto out =
      device->core.poll_transmit(std::as_writable_bytes(std::span{room, room_bytes}), time(now_ns));
  if (!out) {
    return false;
  }
  *transmit = {out->from_port, endpoint(out->destination), bytes_of(out->bytes.data()), out->bytes.size()};
  return true;
}

bool trestle_poll_happening(trestle_device* device, trestle_happening* happening) {
  const auto what = device->core.poll_happening();
  if (what) {
    translate(*what, Translator{*happening});
  }
  return what.has_value();
}

bool trestle_deadline(const trestle_device* device, uint64_t* deadline_ns) {
  const auto deadline = device->core.deadline();
  if (deadline) {
    *deadline_ns = static_cast<std::uint64_t>(deadline->time_since_epoch().count());
  }
  return deadline.has_value();
}

void trestle_get_counters(const trestle_device* device, trestle_counters* counters) {
  *counters = std::bit_cast<trestle_counters>(device->core.counters());  // the same numbers in the same order
}
