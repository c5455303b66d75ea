// What a device has of the core that offers services and uses those of others: the header codec, service
// discovery on both sides, and TP in both directions. Linked to see how large that is, and never run: what it
// is told comes from, and what it has to say goes to, variables that the compiler knows nothing of.
#include <array>

#include "sd/core/service_discovery.hpp"
#include "someip/core/tp_reassembler.hpp"
#include "someip/core/tp_segmenter.hpp"

namespace {

using namespace trestle;

// The configuration that docs/embedding.md states. What a device stores of others is up to it: here, two
// services of others with a subscription to each, of up to 16 other nodes.
using Storage = sd::Storage<sd::Limits{.max_offers = 4,
                                       .max_eventgroups = 8,
                                       .max_subscribers = 16,
                                       .max_requirements = 2,
                                       .max_subscriptions = 2,
                                       .max_remote_services = 2,
                                       .max_peers = 16,
                                       .max_tcp_connections = 0,
                                       .max_pending_entries = 8,
                                       .max_configurations = 0,
                                       .max_configuration_bytes = 32,
                                       .max_pending_events = 8}>;
constexpr std::size_t tp_message_bytes = 8192;

volatile bool running;
volatile std::int64_t clock_ns;
std::array<std::byte, 1500> datagram;
volatile std::size_t datagram_bytes;
sd::Settings settings;  // as it may come from flash memory
sd::OfferedService offered;
sd::RequiredService required;
sd::EventgroupRequest wanted;
volatile std::size_t events;
volatile std::size_t sent_bytes;

}  // namespace

// What the RAM of the configuration is made of, under names that are found in the table of symbols.
extern "C" {
alignas(Storage) std::array<std::byte, sizeof(Storage)> ram_sd_storage;
std::array<std::byte, tp_message_bytes> ram_tp_buffer;
std::array<std::uint32_t, someip::tp_map_words(tp_message_bytes)> ram_tp_map;
std::array<someip::TpSlot, 1> ram_tp_slots{someip::TpSlot{ram_tp_buffer, ram_tp_map}};
alignas(sd::ServiceDiscovery) std::array<std::byte, sizeof(sd::ServiceDiscovery)> ram_sd;
alignas(someip::TpReassembler) std::array<std::byte, sizeof(someip::TpReassembler)> ram_tp;
}

namespace {

TimePoint now() {
  return TimePoint{std::chrono::nanoseconds{clock_ns}};
}

void send(ByteView bytes) {
  sent_bytes = sent_bytes + bytes.size();
}

// A small message in one datagram, a large one in segments.
void send(const someip::Header& header, ByteView payload) {
  std::array<std::byte, someip::header_bytes> head{};
  if (const auto encoded = someip::encode_header(header, payload.size(), head);
      encoded && payload.size() <= 1400) {
    send(*encoded);
    send(payload);
    return;
  }
  for (someip::TpSegmenter segments{header, payload.size()}; const auto segment = segments.next();) {
    send(segment->header);
    send(payload.subspan(segment->offset, segment->bytes));
  }
}

void on_datagram(someip::TpReassembler& tp, const Endpoint& from) {
  someip::MessageCursor messages{ByteView{datagram}.first(datagram_bytes)};
  while (const auto message = messages.next()) {
    if (!someip::is_tp(message->header.type)) {
      send(message->header, message->payload);
    } else if (const auto whole = tp.on_segment(from, *message, now()); whole && *whole) {
      send((*whole)->header, (*whole)->payload);
    }
  }
}

void on_event(const sd::Happening& event) {
  events = events + event.index();
}

}  // namespace

int main() {
  // Made here, and not as a static object: that would be copied from flash memory, and take as much of it.
  Storage& storage = *new (ram_sd_storage.data()) Storage{};
  sd::ServiceDiscovery& sd = *new (ram_sd.data()) sd::ServiceDiscovery{settings, storage.view()};
  someip::TpReassembler& tp = *new (ram_tp.data()) someip::TpReassembler{
      ram_tp_slots,
      {.max_message_bytes = tp_message_bytes, .max_per_sender = 1, .max_age = std::chrono::seconds{5}}};
  const auto offer = sd.offer(offered, now());
  const auto requirement = sd.require(required, now());
  if (!offer || !requirement) {
    return 1;
  }
  const auto subscription = sd.subscribe(*requirement, wanted, now());
  while (running) {
    const Endpoint from{IpAddress::v4(10, 0, 0, 1), 30490};
    if (const bool sd_port = datagram_bytes % 2 == 0; sd_port) {
      sd.on_datagram(ByteView{datagram}.first(datagram_bytes), from, running, now());
    } else {
      on_datagram(tp, from);
    }
    sd.on_time(now());
    tp.on_time(now());
    while (const auto transmit = sd.poll_transmit(datagram, now())) {
      send(transmit->bytes);
    }
    while (const auto event = sd.poll_event()) {
      on_event(*event);
    }
    sd.for_each_subscriber(*offer, sd::EventgroupId{1}, [](const sd::Subscriber& /*one*/) { send({}); });
    if (const auto deadline = sd.deadline()) {
      clock_ns = deadline->time_since_epoch().count();
    }
    if (!running) {
      sd.link_down();
      sd.link_up(now());
    }
  }
  if (subscription) {
    sd.unsubscribe(*subscription, now());
  }
  sd.release(*requirement, now());
  sd.stop_offer(*offer, now());
  sd.shutdown(now());
  return 0;
}
