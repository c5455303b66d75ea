#include "ets_service.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <memory>
#include <utility>

namespace ets {
namespace {

using namespace std::chrono_literals;

/// Makes the event over TCP be sent, of the second service as of the first.
constexpr MethodId trigger_reliable{0x05};
/// Makes each event with end-to-end protection be sent once.
constexpr MethodId trigger_protected{0x71};
constexpr EventgroupId group_of_protected{8};
constexpr std::array<std::byte, 4> protected_value = values::bytes_of(0x12, 0x34, 0x56, 0x78);

/// One for each profile that is not for methods alone. What the profiles count: 8 bytes of the SOME/IP
/// header, the E2E header, four bytes of payload.
const std::vector<sd::E2eSpec>& protected_events() {
  constexpr std::uint32_t data_bits = (8 + 2 + 4) * 8;
  constexpr std::array<std::uint8_t, 16> data_ids{17, 18, 19, 20, 21, 22, 23, 24,
                                                  25, 26, 27, 28, 29, 30, 31, 32};
  static const std::vector<sd::E2eSpec> all{
      {.id = MethodId{0x8050}, .protect = e2e::Profile1{.data_id = 0x0124, .data_bits = data_bits}},
      {.id = MethodId{0x8051}, .protect = e2e::Profile2{.data_id_list = data_ids, .data_bits = data_bits}},
      {.id = MethodId{0x8052}, .protect = e2e::Profile4{.data_id = 0x0a0b'0d04}},
      {.id = MethodId{0x8053}, .protect = e2e::Profile5{.data_id = 0x0205, .data_bits = data_bits + 8}},
      {.id = MethodId{0x8054}, .protect = e2e::Profile6{.data_id = 0x0206}},
      {.id = MethodId{0x8055}, .protect = e2e::Profile7{.data_id = 0x0a0b'0d07}},
      {.id = MethodId{0x8056}, .protect = e2e::Profile8{{.data_id = 0x0a0b'0d08}}},
      {.id = MethodId{0x8057},
       .protect =
           e2e::Profile11{
               .data_id = 0x0b24, .data_id_mode = e2e::DataIdMode::nibble, .data_bits = data_bits}},
      {.id = MethodId{0x8058}, .protect = e2e::Profile22{.data_id_list = data_ids, .data_bits = data_bits}},
      {.id = MethodId{0x8059}, .protect = e2e::Profile44{{.data_id = 0x0a0b'0d44}}}};
  return all;
}

/// A method that answers as ets::echo() says.
sd::MethodSpec echoing(MethodId id) {
  return {id, [id](const Message& request, sd::Responder responder) {
            const std::size_t size = request.payload.size();
            const auto answer = std::make_shared<std::vector<std::byte>>(size + room_beside);
            std::vector<char> text(size / 2 * 3);
            const auto payload = echo(id, request.payload, {.answer = *answer, .text = text});
            if (payload) {
              responder.respond({&*payload, 1}, answer);
            } else {
              responder.error(payload.error());
            }
          }};
}

}  // namespace

Service::Service(boost::asio::io_context& io, sd::Node& node, const Places& places, Client& client)
    : node_{node}, places_{places}, client_{client}, resume_{io}, next_event_{io} {
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
  std::ranges::move(client_.methods(), std::back_inserter(spec.methods));
  spec.eventgroups = {
      {.id = EventgroupId{2},
       .events = {event_uint8, event_array, event_reliable, event_e2e_shaped, field_uint8}},
      {.id = EventgroupId{5}, .events = {field_uint8, field_array}},
      {.id = EventgroupId{6},
       .events = {event_multicast},
       .multicast = trestle::Endpoint{places_.event_group, static_cast<std::uint16_t>(places_.port + 10)},
       .multicast_threshold = 1},
      {.id = EventgroupId{7},
       .events = {event_two_receivers},
       .multicast = trestle::Endpoint{places_.event_group, static_cast<std::uint16_t>(places_.port + 11)},
       .multicast_threshold = 2},
      {.id = group_of_protected}};
  for (const sd::E2eSpec& one : protected_events()) {
    spec.eventgroups.back().events.push_back(one.id);
    spec.e2e.push_back(one);
  }
  spec.tcp_events = {event_reliable};
  return spec;
}

void Service::add_methods(sd::ServiceSpec& spec) {
  const auto fire_and_forget = [&](MethodId id, auto action) {
    spec.methods.push_back({id, [action](const Message& request, const sd::Responder&) { action(request); },
                            MethodKind::fire_and_forget});
  };
  fire_and_forget(reset_interface, [this](const Message&) {
    for (const FieldOfInterface& field : fields) {
      if (field.setter) {
        offer_->set(field.notifier.value_or(field.getter), field.initial);
      }
    }
  });
  fire_and_forget(suspend_interface, [this](const Message&) { suspend(); });
  fire_and_forget(trigger_protected, [this](const Message&) {
    for (const sd::E2eSpec& one : protected_events()) {
      offer_->notify(one.id, protected_value);
    }
  });
  for (const Trigger& one : triggers) {
    fire_and_forget(one.method, [this, &one](const Message& request) {
      schedule_.trigger(one, request.payload, std::chrono::steady_clock::now());
      wait_for_event();
    });
  }
}

void Service::add_echoes(sd::ServiceSpec& spec) {
  for (const MethodId id : echoes) {
    spec.methods.push_back(echoing(id));
  }
  for (const MethodId id : protected_echoes) {
    spec.methods.push_back(echoing(id));
    spec.e2e.push_back({.id = id, .protect = protection_of(id), .check = protection_of(id)});
  }
}

void Service::add_fields(sd::ServiceSpec& spec) {
  for (const FieldOfInterface& field : fields) {
    spec.fields.push_back({.getter = field.getter,
                           .setter = field.setter,
                           .notifier = field.notifier,
                           .value = std::vector<std::byte>{field.initial.begin(), field.initial.end()}});
  }
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
    resume_.expires_after(suspended_for);
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

void Service::wait_for_event() {
  const auto when = schedule_.deadline();
  if (!when) {
    return;
  }
  next_event_.expires_at(*when);
  next_event_.async_wait([this](auto error) {
    if (error) {
      return;
    }
    const TimePoint now = std::chrono::steady_clock::now();
    while (const Trigger* const due = schedule_.next(now)) {
      if (offer_) {
        offer_->notify(due->event, due->payload);
      }
    }
    wait_for_event();
  });
}

Companions::Companions(sd::Node& node, const Places& places) {
  const auto one = [](ServiceId id, std::uint16_t instance, std::uint16_t port) {
    return sd::ServiceSpec{.service = id,
                           .instance = InstanceId{instance},
                           .udp_port = port,
                           .tcp_port = port,
                           .methods = {echoing(echo_uint8)}};
  };
  const auto other_port = static_cast<std::uint16_t>(places.port + 2);
  sd::ServiceSpec newer = one(old_and_new, 1, other_port);
  newer.major = 2;
  newer.minor = 7;
  others_.emplace_back(node, one(service, 2, static_cast<std::uint16_t>(places.port + 1)));
  second_.emplace(node, second(one(second_service, 1, places.port)));
  others_.emplace_back(node, one(old_and_new, 1, other_port));
  others_.emplace_back(node, std::move(newer));
}

sd::ServiceSpec Companions::second(sd::ServiceSpec spec) {
  spec.options.load_balancing = sd::LoadBalancingOption{.priority = 3, .weight = 250};
  spec.configuration = {{"place", "front"}, {"place", "rear"}, {"spare", ""}, {"flag"}};
  spec.eventgroups = {{.id = EventgroupId{2}, .events = {event_reliable}}};
  spec.tcp_events = {event_reliable};
  spec.methods.push_back(
      {trigger_reliable,
       [this](const Message&, const sd::Responder&) { second_->notify(event_reliable, values::number_43); },
       MethodKind::fire_and_forget});
  return spec;
}

}  // namespace ets
