#include "test/sd/describe.hpp"

#include <fmt/format.h>

#include "test/bytes.hpp"

namespace trestle::test {

using sd::EndpointOption;
using sd::EndpointRole;
using sd::EntryKind;

std::string describe(const Endpoint& endpoint) {
  const auto& bytes = endpoint.address.bytes;
  if (endpoint.address.v6) {
    return fmt::format("[{}]:{}", to_hex(std::as_bytes(std::span{bytes})), endpoint.port);
  }
  return fmt::format("{}.{}.{}.{}:{}", bytes[0], bytes[1], bytes[2], bytes[3], endpoint.port);
}

namespace {

std::string labelled(const std::optional<Endpoint>& endpoint, const char* label) {
  return endpoint ? fmt::format(" {} {}", label, describe(*endpoint)) : "";
}

std::string describe_option(const sd::Option& option) {
  const auto endpoint = EndpointOption::decode(option);
  if (!endpoint) {
    return fmt::format(" option {:02x}:{}", static_cast<unsigned>(option.type), to_hex(option.body));
  }
  const char* label = endpoint->role == EndpointRole::multicast ? "multicast"
                      : endpoint->role == EndpointRole::sd      ? "sd"
                      : endpoint->transport == Transport::tcp   ? "tcp"
                                                                : "udp";
  return fmt::format(" {} {}", label, describe(endpoint->endpoint));
}

const char* word(EntryKind kind) {
  switch (kind) {
    case EntryKind::find_service:
      return "find";
    case EntryKind::offer_service:
      return "offer";
    case EntryKind::stop_offer_service:
      return "stop_offer";
    case EntryKind::subscribe_eventgroup:
      return "subscribe";
    case EntryKind::stop_subscribe_eventgroup:
      return "stop_subscribe";
    case EntryKind::subscribe_eventgroup_ack:
      return "ack";
    case EntryKind::subscribe_eventgroup_nack:
      return "nack";
    case EntryKind::unknown:
      break;
  }
  return "unknown";
}

std::string text_of(const sd::Subscriber& subscriber) {
  return fmt::format("{}{} at {}", labelled(subscriber.udp, "udp"), labelled(subscriber.tcp, "tcp"),
                     describe(subscriber.peer));
}

std::string text_of(const sd::RemoteService& service) {
  return fmt::format("{:04x}.{:04x} v{}.{}{}{} at {}", value(service.service), value(service.instance),
                     service.major, service.minor, labelled(service.udp, "udp"), labelled(service.tcp, "tcp"),
                     describe(service.peer)) +
         (service.options.load_balancing
              ? fmt::format(" priority {} weight {}", service.options.load_balancing->priority,
                            service.options.load_balancing->weight)
              : "");
}

struct EventText {
  std::string operator()(const sd::SubscriberAdded& e) const {
    return fmt::format("added {:04x}{}{}", value(e.eventgroup), text_of(e.subscriber),
                       e.initial_data ? " initial" : "");
  }
  std::string operator()(const sd::InitialDataRequested& e) const {
    return fmt::format("initial {:04x}{}", value(e.eventgroup), text_of(e.subscriber));
  }
  std::string operator()(const sd::SubscriberRemoved& e) const {
    return fmt::format("removed {:04x}{} {}", value(e.eventgroup), text_of(e.subscriber),
                       to_string(e.reason));
  }
  std::string operator()(const sd::ConnectionOutdated& e) const {
    return fmt::format("outdated {} from {}", describe(e.own), describe(e.client));
  }
  std::string operator()(const sd::ServiceAvailable& e) const { return "available " + text_of(e.service); }
  std::string operator()(const sd::ServiceLost& e) const {
    return fmt::format("lost {:04x}.{:04x} v{} {}", value(e.service.service), value(e.service.instance),
                       e.service.major, to_string(e.reason));
  }
  std::string operator()(const sd::Subscribed& e) const {
    return "subscribed" + labelled(e.multicast, "multicast");
  }
  std::string operator()(const sd::SubscriptionRefused& /*e*/) const { return "refused"; }
  std::string operator()(const sd::SubscriptionLost& e) const {
    return fmt::format("subscription lost {}", to_string(e.reason));
  }
};

}  // namespace

std::string describe(const sd::SdMessage& message, const sd::Entry& entry) {
  const EntryKind kind = entry.kind();
  std::string text =
      fmt::format("{} {:04x}.{:04x} v{}", word(kind), value(entry.service), value(entry.instance),
                  entry.major == sd::any_major ? "*" : std::to_string(entry.major));
  const bool of_service =
      entry.type == sd::EntryType::find_service || entry.type == sd::EntryType::offer_service;
  if (of_service) {
    text += entry.minor() == sd::any_minor ? ".*" : fmt::format(".{}", entry.minor());
  } else {
    text += fmt::format(" group {:04x}", value(entry.eventgroup()));
  }
  text += fmt::format(" ttl {}", entry.ttl_s);
  if (!of_service) {
    text += fmt::format(" counter {}{}", entry.counter(), entry.initial_data_requested() ? " initial" : "");
  }
  for (std::size_t i = 0; i < entry.option_count(); ++i) {
    const auto option = message.option_of(entry, i);
    text += option ? describe_option(*option) : " option missing";
  }
  return text;
}

std::string describe_datagram(ByteView datagram) {
  const auto header = someip::decode(datagram);
  if (!header) {
    return "malformed " + to_hex(datagram);
  }
  const auto message = sd::decode(*header);
  if (!message || find_fault(*message) || header->size() != datagram.size()) {
    return "malformed " + to_hex(datagram);
  }
  std::string text = fmt::format("s{}{}", value(header->header.session), message->reboot() ? " reboot" : "");
  text += message->unicast() ? "" : " no-unicast";
  text += message->explicit_initial_data() ? "" : " no-explicit";
  for (std::size_t i = 0; i < message->entry_count(); ++i) {
    text += (i == 0 ? ": " : "; ") + describe(*message, message->entry(i));
  }
  return text;
}

std::string describe(const sd::Happening& event) {
  return std::visit(EventText{}, event);
}

}  // namespace trestle::test
