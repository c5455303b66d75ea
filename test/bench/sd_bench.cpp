// What SD messages cost: the offer that vsomeip sends, and a subscription from its arrival to its Ack.
#include <benchmark/benchmark.h>

#include <array>
#include <memory>

#include "sd/core/service_discovery.hpp"
#include "sd/wire/writer.hpp"

namespace {

using namespace trestle;
using namespace trestle::sd;
using namespace std::chrono_literals;

constexpr Endpoint server{IpAddress::v4(10, 0, 0, 1), 30509};
constexpr Endpoint client{IpAddress::v4(10, 0, 0, 2), 40000};

Entry offer_entry(std::uint16_t service) {
  return {.type = EntryType::offer_service,
          .service = ServiceId{service},
          .instance = InstanceId{1},
          .major = 1,
          .ttl_s = 3};
}

// A message with `state.range(0)` offers that share one endpoint option.
ByteView offers(std::int64_t count, ByteSpan room) {
  SdWriter writer{room};
  const OwnedOption udp = EndpointOption{EndpointRole::unicast, server, Transport::udp}.encode();
  for (std::int64_t i = 0; i < count; ++i) {
    static_cast<void>(writer.add(offer_entry(static_cast<std::uint16_t>(i)), std::array{udp.view()}));
  }
  return writer.finish(reboot_flag | unicast_flag, SessionId{1});
}

void encode_offers(benchmark::State& state) {
  std::array<std::byte, 1400> room{};
  for (auto _ : state) {
    benchmark::DoNotOptimize(offers(state.range(0), room));
  }
}
BENCHMARK(encode_offers)->Arg(1)->Arg(20);

void decode_offers(benchmark::State& state) {
  std::array<std::byte, 1400> room{};
  const ByteView datagram = offers(state.range(0), room);
  for (auto _ : state) {
    const auto message = decode(*someip::decode(datagram));
    for (std::size_t i = 0; i < message->entry_count(); ++i) {
      const Entry entry = message->entry(i);
      benchmark::DoNotOptimize(EndpointOption::decode(*message->option_of(entry, 0)));
    }
  }
}
BENCHMARK(decode_offers)->Arg(1)->Arg(20);

// A renewal of one of `state.range(0)` subscriptions: datagram in, Ack out.
void renew_subscription(benchmark::State& state) {
  const auto storage = std::make_unique<Storage<>>();
  Settings settings;
  settings.unicast = {server.address, 30490};
  settings.max_subscribers_per_eventgroup = 512;
  ServiceDiscovery discovery{settings, storage->view()};
  const std::array groups{Eventgroup{.id = EventgroupId{1}}};
  TimePoint now{1000s};
  static_cast<void>(discovery.offer(
      {.service = ServiceId{1}, .instance = InstanceId{1}, .udp = server, .eventgroups = groups}, now));
  std::array<std::byte, 1400> room{};
  ByteView datagram;
  std::array<std::byte, 100> subscribe{};
  for (std::int64_t i = 0; i < state.range(0); ++i) {
    SdWriter writer{subscribe};
    Entry entry = offer_entry(1);
    entry.type = EntryType::subscribe_eventgroup;
    entry.tail = Entry::eventgroup_tail(EventgroupId{1}, 0, false);
    const Endpoint endpoint{client.address, static_cast<std::uint16_t>(40000 + i)};
    const OwnedOption udp = EndpointOption{EndpointRole::unicast, endpoint, Transport::udp}.encode();
    static_cast<void>(writer.add(entry, std::array{udp.view()}));
    datagram = writer.finish(unicast_flag, SessionId{1});
    discovery.on_datagram(datagram, {client.address, 30490}, false, now);
    static_cast<void>(discovery.poll_event());
    static_cast<void>(discovery.poll_transmit(room, now));
  }
  for (auto _ : state) {
    discovery.on_datagram(datagram, {client.address, 30490}, false, now);
    benchmark::DoNotOptimize(discovery.poll_transmit(room, now));
  }
}
BENCHMARK(renew_subscription)->Arg(1)->Arg(500);

}  // namespace
