#include "ets_client.hpp"

#include <utility>

namespace ets {
namespace {

constexpr MethodId event_by_udp{0x8001};
constexpr MethodId event_by_tcp{0x8002};
constexpr MethodId event_by_multicast{0x8003};

}  // namespace

Client::Client(sd::Node& node)
    : node_{node},
      own_{node,
           {.service = used_by_itself,
            .instance = InstanceId{1},
            .eventgroup = EventgroupId{1},
            .events = {event_by_udp}},
           [](const Message&, const trestle::Endpoint&) {}} {}

Client::~Client() {
  deactivate();
}

void Client::activate() {
  if (!requirement_) {
    requirement_ = node_.require({.service = used_when_told, .instance = InstanceId{1}});
  }
}

void Client::deactivate() {
  subscriptions_.clear();
  if (requirement_) {
    node_.release(*requirement_);
    requirement_.reset();
  }
}

/// To an eventgroup over UDP, one over TCP, and one over multicast.
void Client::subscribe() {
  activate();
  if (!subscriptions_.empty()) {
    return;
  }
  const auto keep = [this](const Message& event, const trestle::Endpoint&) {
    if (!event.payload.empty()) {
      last_values_[event.header.method] = std::to_integer<std::uint8_t>(event.payload.front());
    }
  };
  const auto add = [&](std::uint16_t group, MethodId event, bool tcp) {
    subscriptions_.emplace_back(node_,
                                sd::SubscribeSpec{.service = used_when_told,
                                                  .instance = InstanceId{1},
                                                  .eventgroup = EventgroupId{group},
                                                  .events = {event},
                                                  .udp = !tcp,
                                                  .tcp = tcp},
                                keep);
  };
  add(1, event_by_udp, false);
  add(2, event_by_tcp, true);
  add(3, event_by_multicast, false);
}

std::vector<sd::MethodSpec> Client::methods() {
  std::vector<sd::MethodSpec> all;
  const auto order = [&](MethodId id, auto action) {
    all.push_back(
        {id, [action](const Message&, const sd::Responder&) { action(); }, MethodKind::fire_and_forget});
  };
  order(client_activate, [this] { activate(); });
  order(client_deactivate, [this] { deactivate(); });
  order(client_subscribe, [this] { subscribe(); });
  const auto last_value = [&](MethodId id, MethodId event) {
    all.push_back({id, sd::answering([this, event] { return last_values_[event]; })});
  };
  last_value(last_value_tcp, event_by_tcp);
  last_value(last_value_udp, event_by_udp);
  last_value(last_value_multicast, event_by_multicast);
  return all;
}

}  // namespace ets
