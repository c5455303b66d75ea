#pragma once
#include "test/bytes.hpp"
#include "test/sd/machine.hpp"

namespace trestle::test {

inline constexpr Endpoint peer_sd{IpAddress::v4(10, 0, 0, 2), 30490};
inline constexpr Endpoint peer_udp{IpAddress::v4(10, 0, 0, 2), 30509};

inline FakePeer::Raw configuration(std::string_view bytes) {
  return {sd::OptionType::configuration, hex(bytes)};
}
inline FakePeer::Raw rank(std::string_view bytes) {
  return {sd::OptionType::load_balancing, hex(bytes)};
}
inline FakePeer::Said with(FakePeer::Said said, std::vector<FakePeer::Raw> more) {
  said.more = std::move(more);
  return said;
}

template <typename AnyMachine>
std::vector<std::string> items(const AnyMachine& machine, sd::RemoteHandle handle) {
  std::vector<std::string> found;
  sd::ConfigurationCursor cursor = machine.discovery.configuration(handle);
  while (const auto item = cursor.next()) {
    found.push_back(std::string{item->key} + (item->value ? "=" + std::string{*item->value} : ""));
  }
  EXPECT_FALSE(cursor.error());
  return found;
}

// The handle in the next event, which must be ServiceAvailable.
template <typename AnyMachine>
sd::RemoteHandle available(AnyMachine& machine) {
  const auto event = machine.discovery.poll_event();
  const auto* const service = event ? std::get_if<sd::ServiceAvailable>(&*event) : nullptr;
  EXPECT_NE(service, nullptr);
  return service != nullptr ? service->service.handle : sd::RemoteHandle{};
}

class Configured : public testing::Test {
 protected:
  Machine<> machine;
  FakePeer peer{peer_sd};
};

inline std::string next_bytes(Machine<>& machine, TimePoint now) {
  machine.now = now;
  machine.discovery.on_time(now);
  std::array<std::byte, 1400> room{};
  const auto transmit = machine.discovery.poll_transmit(room, now);
  return transmit ? to_hex(transmit->bytes) : "";
}

}  // namespace trestle::test
