#include "bridge/measure/perf/server.hpp"

#include <array>
#include <cmath>

#include "someip/net/message_sender.hpp"
#include "someip/net/parameters.hpp"

namespace trestle::measure::perf {
namespace {

bool is_possible(const EventPlan& plan) {
  return plan.bytes >= min_event_bytes && plan.bytes <= max_event_bytes && std::isfinite(plan.rate_hz) &&
         plan.rate_hz >= 0;
}

}  // namespace

Server::Server(sd::Node& node, someip::ServiceId service, someip::InstanceId instance) : node_{node} {
  using someip::Message;
  const auto reply = [this](sd::Responder& responder) {
    const auto bytes = status();
    responder.respond(bytes);
  };
  sd::ServiceSpec spec{.service = service, .instance = instance, .tcp_port = 0};
  spec.methods = {
      {.id = echo_method,
       .handler = [](const Message& request,
                     sd::Responder responder) { responder.respond(request.payload); }},
      {.id = status_method,
       .handler = [reply](const Message& /*request*/, sd::Responder responder) { reply(responder); }},
      {.id = start_method,
       .handler = [this](const Message& request, sd::Responder responder) { on_start(request, responder); }},
      {.id = stop_method,
       .handler =
           [this, reply](const Message& /*request*/, sd::Responder responder) {
             events_->stop();
             reply(responder);
           }},
      {.id = acknowledge_method,
       .handler =
           [this](const Message& request, sd::Responder /*responder*/) {
             if (const auto sequence = someip::unpack<std::uint64_t>(request.payload)) {
               events_->acknowledge(*sequence);
             }
           },
       .kind = someip::MethodKind::fire_and_forget}};
  spec.eventgroups = {{.id = udp_eventgroup, .events = {udp_event}},
                      {.id = tcp_eventgroup, .events = {tcp_event}},
                      {.id = callers_eventgroup, .events = {no_event}}};
  spec.tcp_events = {tcp_event};
  spec.segmented = {{echo_method, udp_event}};  // so that the offer tells how large bursts of requests may be
  offer_ = node_.offer(std::move(spec));
  events_ = std::make_shared<EventSource>(node_, offer_);
}

Server::~Server() {
  events_->stop();
  node_.withdraw(offer_);
}

std::vector<std::byte> Server::status() const {
  Status status = own_status();
  status.events = events_->events();
  status.dropped = events_->dropped();
  return someip::pack(status);
}

void Server::on_start(const someip::Message& request, sd::Responder& responder) {
  const auto plan = someip::unpack<EventPlan>(request.payload);
  if (!plan || !is_possible(*plan)) {
    responder.error(someip::ReturnCode::malformed_message);
  } else if (!events_->start(*plan)) {
    responder.error(someip::ReturnCode::not_ready);
  } else {
    responder.respond();
  }
}

}  // namespace trestle::measure::perf
