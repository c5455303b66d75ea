#include <fmt/format.h>

#include "bridge/conform/replay/replay.hpp"
#include "someip/net/address_text.hpp"

/// Messages of services that the capture shows offers of: versions, and where events come from. What was
/// offered once counts for the whole capture, as a restart may not be in it.
namespace trestle::conform {
namespace {

using someip::MessageType;

/// A response, or an error.
bool is_answer(MessageType type) {
  return type == MessageType::response || type == MessageType::error;
}

std::string text_of(const std::set<std::uint8_t>& majors) {
  return fmt::format("{}", fmt::join(majors, " or "));
}

}  // namespace

void Replay::note_served(std::uint16_t service, std::uint8_t major, Transport transport,
                         const Endpoint& endpoint) {
  if (served_.size() >= most_relations || served_endpoints_ >= most_relations) {
    return;
  }
  Served& served = served_[{endpoint.address, service}];
  served.majors.insert(major);
  served_endpoints_ += served.endpoints.emplace(transport, endpoint).second ? 1U : 0U;
}

void Replay::judge_meaning(const At& at) {
  const someip::Header& header = at.message.header;
  const MessageType type = someip::without_tp(header.type);
  const bool is_event = type == MessageType::notification;
  if (!is_event && !is_answer(type) && type != MessageType::request &&
      type != MessageType::request_no_return) {
    return;
  }
  const std::uint32_t id = (std::uint32_t{value(header.service)} << 16U) | value(header.method);
  if (is_event_.size() < most_relations) {
    const bool known = is_event_.try_emplace(id, is_event).first->second;
    check(Rule::ids_one_meaning, at, known == is_event, fmt::format("meaning of {:#010x}", id),
          known ? "an event, as before" : "a method, as before", is_event ? "an event" : "a method");
  }
}

void Replay::judge_version(const At& at) {
  const someip::Header& header = at.message.header;
  const MessageType type = someip::without_tp(header.type);
  if (is_answer(type)) {
    return;  // which has the version of its request: another rule
  }
  const bool is_event = type == MessageType::notification;
  const Endpoint& server = is_event ? at.place.flow.from : at.place.flow.to;
  const auto served = served_.find({server.address, value(header.service)});
  if (served != served_.end() &&
      served->second.endpoints.contains({at.place.transport.value_or(Transport::udp), server})) {
    check(Rule::rpc_interface_version, at, served->second.majors.contains(header.interface_version),
          "Interface Version", text_of(served->second.majors) + ", which is offered",
          std::to_string(header.interface_version));
  }
}

void Replay::judge_source(const At& at) {
  if (someip::without_tp(at.message.header.type) != MessageType::notification) {
    return;
  }
  const std::uint16_t service = value(at.message.header.service);
  const Transport transport = at.place.transport.value_or(Transport::udp);
  const auto& [from, to] = at.place.flow;
  const auto offers_at = [&](const Endpoint& endpoint) {
    const auto served = served_.find({endpoint.address, service});
    return served != served_.end() && served->second.endpoints.contains({transport, endpoint});
  };
  const bool is_server = served_.contains({from.address, service});
  // Of a sender that offers nothing, only what goes to a server is known to be wrong: its own offers may have
  // come before the capture began.
  if (is_server || offers_at(to)) {
    check(Rule::rpc_event_source, at, offers_at(from), "sender of the event",
          "an endpoint at which it offers the service",
          someip::to_string(from) + (is_server ? "" : ", which sends it to a server of the service"));
  }
}

}  // namespace trestle::conform
