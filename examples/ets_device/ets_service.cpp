#include "ets_service.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <iterator>
#include <string>
#include <tuple>
#include <utility>
#include <variant>

namespace ets {
namespace {

using namespace std::chrono_literals;

constexpr PayloadRules in_utf16{.string_encoding = StringEncoding::utf16be};
constexpr PayloadRules array_length_16{.array_length = FieldWidth::bits16};
constexpr PayloadRules array_length_8{.array_length = FieldWidth::bits8};

constexpr MethodId event_uint8{0x8001};
constexpr MethodId event_array{0x8002};
constexpr MethodId event_reliable{0x8003};
constexpr MethodId event_e2e{0x8004};
constexpr MethodId event_multicast{0x800b};
constexpr MethodId event_two_receivers{0x800c};
constexpr MethodId field_uint8{0x8006};
constexpr MethodId field_array{0x8007};

template <typename T>
constexpr auto same = [](const T& value) { return value; };

/// A method that answers with what it was given, if that is a T.
template <typename T>
sd::MethodSpec echo(std::uint16_t id, const PayloadRules& rules = {}) {
  return {MethodId{id}, sd::answering(same<T>, rules)};
}

template <typename T>
constexpr T reversed_bits(T number) {
  T result = 0;
  for (unsigned bit = 0; bit < sizeof(T) * 8; ++bit) {
    result = static_cast<T>(2U * result + ((static_cast<unsigned>(number) >> bit) & 1U));
  }
  return result;
}

using Union = std::variant<std::uint8_t, std::uint16_t, std::uint32_t>;
using E2eShaped = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t, std::uint8_t>;

}  // namespace

Service::Service(boost::asio::io_context& io, sd::Node& node, const Places& places, Client& client)
    : io_{io}, node_{node}, places_{places}, client_{client}, resume_{io} {
  offer();
}

void Service::offer() {
  offer_.emplace(node_, description());
}

sd::ServiceSpec Service::description() {
  sd::ServiceSpec spec{
      .service = service, .instance = InstanceId{1}, .udp_port = places_.port, .tcp_port = places_.port};
  add_methods(spec);
  add_echoes(spec);
  add_fields(spec);
  add_protected(spec);
  std::ranges::move(client_.methods(), std::back_inserter(spec.methods));
  spec.eventgroups = {
      {.id = EventgroupId{2}, .events = {event_uint8, event_array, event_reliable, event_e2e, field_uint8}},
      {.id = EventgroupId{5}, .events = {field_uint8, field_array}},
      {.id = EventgroupId{6},
       .events = {event_multicast},
       .multicast = trestle::Endpoint{places_.event_group, static_cast<std::uint16_t>(places_.port + 10)},
       .multicast_threshold = 1},
      {.id = EventgroupId{7},
       .events = {event_two_receivers},
       .multicast = trestle::Endpoint{places_.event_group, static_cast<std::uint16_t>(places_.port + 11)},
       .multicast_threshold = 2}};
  spec.tcp_events = {event_reliable};
  return spec;
}

void Service::add_methods(sd::ServiceSpec& spec) {
  const auto fire_and_forget = [&](std::uint16_t id, auto action) {
    spec.methods.push_back({MethodId{id},
                            [action](const Message& request, const sd::Responder&) { action(request); },
                            MethodKind::fire_and_forget});
  };
  fire_and_forget(0x01, [this](const Message&) {  // resetInterface
    offer_->set(field_uint8, pack(std::uint8_t{0}));
    offer_->set(field_array, pack(std::vector<std::uint8_t>{1, 2, 3}));
    offer_->set(MethodId{0x2a}, pack(std::uint8_t{0}));  // it has no notifier
  });
  fire_and_forget(0x02, [this](const Message&) { suspend(); });
  const auto triggers = [&](std::uint16_t id, MethodId event, std::vector<std::byte> payload) {
    fire_and_forget(id, [this, event, payload = std::move(payload)](const Message& request) {
      trigger(request, event, payload);
    });
  };
  triggers(0x03, event_uint8, pack(std::uint8_t{42}));
  triggers(0x04, event_array, pack(std::vector<std::uint8_t>{4, 2}));
  triggers(0x05, event_reliable, pack(std::uint8_t{43}));
  triggers(0x06, event_e2e, pack(E2eShaped{1, 2, 3, 4, 5}));
  triggers(0x3a, event_multicast, pack(std::uint8_t{44}));
  triggers(0x70, event_two_receivers, pack(std::uint8_t{45}));
}

void Service::add_echoes(sd::ServiceSpec& spec) {
  using Bytes = std::vector<std::uint8_t>;
  const auto few = [](const Bytes& elements) -> Result<Bytes, ReturnCode> {
    if (elements.size() < 3 || elements.size() > 5) {
      return tl::unexpected{ReturnCode::malformed_message};
    }
    return elements;
  };
  std::vector<sd::MethodSpec> all{
      echo<std::uint8_t>(0x08),
      echo<Bytes>(0x09),
      echo<std::uint8_t>(0x0a),
      echo<E2eShaped>(0x0b),
      echo<std::int8_t>(0x0e),
      echo<double>(0x12),
      echo<FixedString<64>>(0x13),
      echo<FixedString<64>>(0x14, in_utf16),
      echo<std::string>(0x15),
      echo<std::string>(0x16, in_utf16),
      echo<std::uint8_t>(0x17),
      echo<Union>(0x19),
      echo<std::vector<Bytes>>(0x35),
      echo<std::array<std::uint8_t, 5>>(0x36),
      {MethodId{0x37}, sd::answering(few)},
      echo<Bytes>(0x3e, array_length_8),
      echo<Bytes>(0x3f, array_length_16),
      {MethodId{0x1f}, sd::answering([](std::uint8_t a, std::uint16_t b) { return std::uint32_t{a} + b; })},
      {MethodId{0x23}, sd::answering([](bool a, std::uint8_t b, std::uint16_t c, std::uint32_t d,
                                        std::int8_t e, std::int16_t f, std::int32_t g, float h,
                                        double i) { return std::tuple{i, h, g, f, e, d, c, b, a}; })},
      {MethodId{0x41}, sd::answering([](std::uint8_t a, std::uint16_t b, std::uint32_t c) {
         return std::tuple{reversed_bits(a), reversed_bits(b), reversed_bits(c)};
       })}};
  std::ranges::move(all, std::back_inserter(spec.methods));
}

void Service::add_fields(sd::ServiceSpec& spec) const {
  const auto field = [&](std::uint16_t getter, MethodId notifier, std::vector<std::byte> value) {
    spec.fields.push_back({.getter = MethodId{getter},
                           .setter = MethodId{static_cast<std::uint16_t>(getter + 1)},
                           .notifier = notifier,
                           .value = std::move(value)});
  };
  field(0x26, field_uint8, pack(std::uint8_t{0}));
  field(0x28, field_array, pack(std::vector<std::uint8_t>{1, 2, 3}));
  spec.fields.push_back({.getter = MethodId{0x2a}, .setter = MethodId{0x2b}, .value = pack(std::uint8_t{0})});
  spec.fields.push_back({.getter = MethodId{0x25}, .value = pack(std::uint8_t{1})});  // the interface version
}

/// Echoes of uint32 with end-to-end protection, one for each profile.
void Service::add_protected(sd::ServiceSpec& spec) {
  namespace e2e = trestle::someip::e2e;
  // What is protected: 8 bytes of the SOME/IP header, the E2E header, four bytes of payload.
  constexpr auto bits = [](std::uint32_t header_bytes) { return (8 + header_bytes + 4) * 8; };
  constexpr std::array<std::uint8_t, 16> list{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
  // The first request of a client is as good as any.
  constexpr e2e::EarlySequence early{.behavior = e2e::Behavior::pre_r4_2};
  std::uint16_t method = 0x50;
  const auto add = [&](const e2e::Config& config) {
    const MethodId id{method++};
    spec.methods.push_back(echo<std::uint32_t>(value(id)));
    spec.e2e.push_back({.id = id, .protect = config, .check = config});
  };
  add(e2e::Profile1{.data_id = 0x0123, .data_bits = bits(2), .sequence = early});
  add(e2e::Profile2{.data_id_list = list, .data_bits = bits(2), .sequence = early});
  add(e2e::Profile4{.data_id = 0x0a0b'0c04});
  add(e2e::Profile4m{{.data_id = 0x0a0b'0c14}});
  add(e2e::Profile5{.data_id = 0x0105, .data_bits = bits(3)});
  add(e2e::Profile6{.data_id = 0x0106});
  add(e2e::Profile7{.data_id = 0x0a0b'0c07});
  add(e2e::Profile7m{{.data_id = 0x0a0b'0c17}});
  add(e2e::Profile8{{.data_id = 0x0a0b'0c08}});
  add(e2e::Profile11{.data_id = 0x0b23, .data_id_mode = e2e::DataIdMode::nibble, .data_bits = bits(2)});
  add(e2e::Profile22{.data_id_list = list, .data_bits = bits(2)});
  add(e2e::Profile44{{.data_id = 0x0a0b'0c44}});
  add(e2e::Profile44m{{.data_id = 0x0a0b'0c54}});
}

/// The service goes away for a while, and comes back as it was.
void Service::suspend() {
  const auto keep_udp = node_.hold_port(places_.port, trestle::Transport::udp);
  const auto keep_tcp = node_.hold_port(places_.port, trestle::Transport::tcp);
  std::vector<std::pair<MethodId, std::vector<std::byte>>> values;
  for (const MethodId field : {field_uint8, field_array}) {
    values.emplace_back(field, *node_.field(offer_->handle(), field));
  }
  // Not from within a request to it.
  resume_.expires_after(0ms);
  resume_.async_wait([this, keep_udp, keep_tcp, values](auto error) {
    if (error) {
      return;
    }
    offer_.reset();
    resume_.expires_after(500ms);
    resume_.async_wait([this, keep_udp, keep_tcp, values](auto again) {
      if (again) {
        return;
      }
      offer();
      for (const auto& [field, value] : values) {
        offer_->set(field, value);
      }
    });
  });
}

/// How often, and when, an event is sent.
struct Service::Trigger {
  Trigger(boost::asio::io_context& io, MethodId which, std::vector<std::byte> bytes)
      : timer{io}, event{which}, payload{std::move(bytes)} {}

  boost::asio::steady_timer timer;
  MethodId event;
  std::vector<std::byte> payload;
  std::chrono::milliseconds left{0};
  std::chrono::milliseconds pause{0};
};

/// Parameters of the request, in milliseconds: wait, how long, pause between two. Without them: once, at
/// once.
void Service::trigger(const Message& request, MethodId event, std::vector<std::byte> payload) {
  const auto times = unpack<std::uint32_t, std::uint32_t, std::uint32_t>(request.payload)
                         .value_or(std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>{});
  const auto next = std::make_shared<Trigger>(io_, event, std::move(payload));
  next->left = std::chrono::milliseconds{std::get<1>(times)};
  next->pause = std::chrono::milliseconds{std::max(std::get<2>(times), 1U)};
  next->timer.expires_after(std::chrono::milliseconds{std::get<0>(times)});
  next->timer.async_wait([this, next](auto error) {
    if (!error) {
      fire(next);
    }
  });
}

void Service::fire(const std::shared_ptr<Trigger>& trigger) {
  if (offer_) {
    offer_->notify(trigger->event, trigger->payload);
  }
  trigger->left -= trigger->pause;
  if (trigger->left > 0ms) {
    trigger->timer.expires_after(trigger->pause);
    trigger->timer.async_wait([this, trigger](auto error) {
      if (!error) {
        fire(trigger);
      }
    });
  }
}

std::vector<sd::ServiceSpec> companions(const Places& places) {
  const auto one = [](ServiceId id, std::uint16_t instance, std::uint16_t port) {
    return sd::ServiceSpec{.service = id,
                           .instance = InstanceId{instance},
                           .udp_port = port,
                           .tcp_port = port,
                           .methods = {echo<std::uint8_t>(0x08)}};
  };
  sd::ServiceSpec second = one(second_service, 1, places.port);
  second.options.load_balancing = sd::LoadBalancingOption{.priority = 3, .weight = 250};
  second.configuration = {{"place", "front"}, {"place", "rear"}, {"spare", ""}, {"flag"}};
  const auto other_port = static_cast<std::uint16_t>(places.port + 2);
  sd::ServiceSpec newer = one(old_and_new, 1, other_port);
  newer.major = 2;
  newer.minor = 7;
  return {one(service, 2, static_cast<std::uint16_t>(places.port + 1)), std::move(second),
          one(old_and_new, 1, other_port), std::move(newer)};
}

}  // namespace ets
