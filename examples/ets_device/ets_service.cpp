#include "ets_service.hpp"

#include <algorithm>
#include <iterator>
#include <memory>
#include <utility>

namespace ets {
namespace {

using namespace std::chrono_literals;

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
       .multicast_threshold = 2}};
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

std::vector<sd::ServiceSpec> companions(const Places& places) {
  const auto one = [](ServiceId id, std::uint16_t instance, std::uint16_t port) {
    return sd::ServiceSpec{.service = id,
                           .instance = InstanceId{instance},
                           .udp_port = port,
                           .tcp_port = port,
                           .methods = {echoing(echo_uint8)}};
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
