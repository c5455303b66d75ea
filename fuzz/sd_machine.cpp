// Property: whatever datagrams arrive and however time passes, a ServiceDiscovery with offers and
// subscriptions sends only flawless SD messages, no more than its limits allow, loses no event, and does not
// ask to be called again at a moment that has passed.
//
// The input is a list of steps: a byte that says what happens, then its arguments. Datagrams stand in it as a
// length of two bytes and a payload; the SOME/IP header before it is made here, with a session from the
// input, so that the fuzzer need not guess it. Every other kind of broken header has its own target.
#include <array>
#include <cstdlib>
#include <memory>

#include "sd/core/service_discovery.hpp"
#include "someip/wire/bytes.hpp"

using namespace trestle;
using namespace trestle::sd;
using namespace std::chrono_literals;

namespace {

constexpr Limits limits{.max_offers = 3,
                        .max_eventgroups = 6,
                        .max_subscribers = 6,
                        .max_requirements = 3,
                        .max_subscriptions = 4,
                        .max_remote_services = 4,
                        .max_peers = 4,
                        .max_tcp_connections = 2,
                        .max_pending_entries = 24,
                        .max_configurations = 2,
                        .max_configuration_bytes = 40,
                        .max_pending_events = 24};

void require(bool condition) {
  if (!condition) {
    std::abort();
  }
}

class Conversation {
 public:
  explicit Conversation(ByteView input) : in_{input} { start_services(); }

  void run() {
    while (!in_.rest().empty() && !in_.failed()) {
      step(in_.u8());
      drain();
    }
    // Left alone, everything that peers said comes to its end, unless it was said to last.
    discovery_.shutdown(now_);
    drain();
    require(!discovery_.deadline());
  }

 private:
  static Settings settings() {
    Settings settings;
    settings.unicast = {IpAddress::v4(10, 0, 0, 1), 30490};
    settings.max_subscribers_per_eventgroup = 3;
    return settings;
  }

  void start_services() {
    static constexpr std::array groups{
        Eventgroup{.id = EventgroupId{1}},
        Eventgroup{
            .id = EventgroupId{2}, .tcp = true, .multicast = Endpoint{IpAddress::v4(224, 0, 0, 9), 9}}};
    static constexpr std::array<ConfigurationItem, 1> said{{{"otherserv", "x"}}};
    for (std::uint16_t instance = 1; instance <= 2; ++instance) {
      offer_ = discovery_
                   .offer({.service = ServiceId{0x1234},
                           .instance = InstanceId{instance},
                           .udp = Endpoint{IpAddress::v4(10, 0, 0, 1), 30509},
                           .tcp = Endpoint{IpAddress::v4(10, 0, 0, 1), 30510},
                           .eventgroups = groups,
                           .options = {.load_balancing = LoadBalancingOption{.priority = instance}}},
                          now_)
                   .value_or(OfferHandle{});
    }
    static_cast<void>(discovery_.offer({.service = other_protocols,
                                        .instance = InstanceId{1},
                                        .udp = Endpoint{IpAddress::v4(10, 0, 0, 1), 30509},
                                        .eventgroups = groups,
                                        .configuration = said},
                                       now_));
    requirement_ = discovery_.require({.service = ServiceId{0x1234}}, now_).value_or(RequirementHandle{});
    static_cast<void>(discovery_.require({.service = other_protocols, .otherserv = "x"}, now_));
    subscribe(InstanceId{1}, true);
    subscribe(InstanceId{2}, false);
  }

  void subscribe(InstanceId instance, bool tcp) {
    EventgroupRequest request{.eventgroup = EventgroupId{1},
                              .instance = instance,
                              .udp = Endpoint{IpAddress::v4(10, 0, 0, 1), 40000},
                              .receive_buffer_bytes = 212'992};
    if (tcp) {
      request.tcp = Endpoint{IpAddress::v4(10, 0, 0, 1), 41000};
    }
    if (const auto handle = discovery_.subscribe(requirement_, request, now_)) {
      subscription_ = *handle;
    }
  }

  void step(std::uint8_t what) {
    switch (what % 12) {
      case 0:
      case 1:
      case 2:
      case 3:
        return datagram(what);
      case 4:
        now_ += std::chrono::milliseconds{in_.u16()};
        return discovery_.on_time(now_);
      case 5:
        now_ += std::chrono::seconds{in_.u16()};
        return discovery_.on_time(now_);
      case 6:
        discovery_.stop_offer(offer_, now_);
        return start_services();
      case 7:
        discovery_.unsubscribe(subscription_, now_);
        return subscribe(InstanceId{in_.u8()}, (what & 0x80U) != 0);
      case 8:
        static_cast<void>(discovery_.tcp_connected({IpAddress::v4(10, 0, 0, 1), 30510}, client()));
        return;
      case 9:
        discovery_.tcp_closed({IpAddress::v4(10, 0, 0, 1), 30510}, client());
        return discovery_.unreachable(client());
      case 10:
        discovery_.link_down();
        return discovery_.link_up(now_);
      default:
        return discovery_.reconnected(subscription_, {IpAddress::v4(10, 0, 0, 1), 41001}, now_);
    }
  }

  Endpoint client() { return {IpAddress::v4(10, 0, 0, static_cast<std::uint8_t>(2 + in_.u8() % 6)), 40000}; }

  void datagram(std::uint8_t what) {
    const auto host = static_cast<std::uint8_t>(1 + in_.u8() % 8);
    const SessionId session{in_.u16()};
    const ByteView payload = in_.take(std::min<std::size_t>(in_.u16(), in_.rest().size()));
    std::array<std::byte, 70'000> room{};
    const auto bytes = encode(sd_header(session), payload, room);
    require(bytes.has_value());
    discovery_.on_datagram(*bytes, {IpAddress::v4(10, 0, 0, host), 30490}, (what & 0x80U) != 0, now_);
  }

  void drain() {
    std::array<std::byte, 1400> room{};
    for (int count = 0; const auto transmit = discovery_.poll_transmit(room, now_); ++count) {
      require(count < limits.max_pending_entries);
      const auto message = someip::decode(transmit->bytes);
      require(message && message->size() == transmit->bytes.size());
      const auto decoded = sd::decode(*message);
      require(decoded && !find_fault(*decoded) && decoded->entry_count() > 0);
      require(transmit->destination.port != 0);
    }
    for (int count = 0; discovery_.poll_event(); ++count) {
      require(count < limits.max_pending_events);
    }
    discovery_.on_time(now_);
    while (discovery_.poll_transmit(room, now_)) {
    }
    while (discovery_.poll_event()) {
    }
    if (const auto service = discovery_.choose(requirement_)) {
      ConfigurationCursor items = discovery_.configuration(service->handle);
      while (items.next()) {
      }
      require(!items.error());
    }
    const auto deadline = discovery_.deadline();
    require(!deadline || *deadline > now_);
    require(discovery_.counters().unsendable_entries == 0 && discovery_.counters().lost_events == 0);
    std::size_t subscribers = 0;
    discovery_.for_each_subscriber(offer_, EventgroupId{1}, [&](const Subscriber& subscriber) {
      require(subscriber.udp.has_value());
      ++subscribers;
    });
    require(subscribers <= 3);
  }

  someip::ByteReader in_;
  TimePoint now_{1000s};
  std::unique_ptr<Storage<limits>> storage_ = std::make_unique<Storage<limits>>();
  ServiceDiscovery discovery_{settings(), storage_->view()};
  OfferHandle offer_;
  RequirementHandle requirement_;
  SubscriptionHandle subscription_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Conversation{std::as_bytes(std::span{data, size})}.run();
  return 0;
}
