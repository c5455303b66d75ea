#pragma once
#include <gmock/gmock.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "sd/core/service_discovery.hpp"
#include "sd/wire/writer.hpp"
#include "test/sd/describe.hpp"

namespace trestle::test {

using namespace std::chrono_literals;

inline constexpr TimePoint start{1000s};
inline constexpr Endpoint own{IpAddress::v4(10, 0, 0, 1), 30490};
inline constexpr Endpoint own_udp{IpAddress::v4(10, 0, 0, 1), 40000};
inline constexpr Endpoint group{IpAddress::v4(224, 244, 224, 245), 30490};

/// Of the host with this number in the same subnet.
inline Endpoint host(std::uint8_t number, std::uint16_t port = 30490) {
  return {IpAddress::v4(10, 0, 0, number), port};
}

/// No randomness, so that tests can state times: first messages after 10 ms, answers to multicast after 5 ms.
inline constexpr sd::Timing fixed_timing{.initial_delay_min = 10ms,
                                         .initial_delay_max = 10ms,
                                         .repetitions_base_delay = 30ms,
                                         .repetitions_max = 2,
                                         .cyclic_offer_delay = 1s,
                                         .request_response_delay_min = 5ms,
                                         .request_response_delay_max = 5ms,
                                         .ttl_s = 3};

inline sd::Settings fixed_settings() {
  sd::Settings settings;
  settings.unicast = own;
  settings.multicast = group;
  settings.timing = fixed_timing;
  return settings;
}

/// A peer made by hand: it counts its sessions and says what it is told to.
class FakePeer {
 public:
  explicit FakePeer(Endpoint endpoint, std::uint8_t flags = sd::unicast_flag)
      : endpoint_{endpoint}, flags_{flags} {}

  /// Any option, by its bytes.
  struct Raw {
    sd::OptionType type;
    std::vector<std::byte> body;
  };
  struct Said {
    sd::Entry entry;
    std::vector<sd::EndpointOption> options;
    std::vector<Raw> more{};
  };

  std::vector<std::byte> multicast(const std::vector<Said>& entries) {
    return message(entries, multicast_++);
  }
  std::vector<std::byte> unicast(const std::vector<Said>& entries) { return message(entries, unicast_++); }
  void reboot() { multicast_ = unicast_ = 1; }
  /// From now on it tells of this multicast endpoint, without a reference.
  void be_gateway_to(const Endpoint& network) { gateway_to_ = network; }
  [[nodiscard]] const Endpoint& endpoint() const { return endpoint_; }

 private:
  [[nodiscard]] std::vector<std::byte> message(const std::vector<Said>& entries,
                                               std::uint16_t session) const {
    std::array<std::byte, 1400> room{};
    sd::SdWriter writer{room};
    if (gateway_to_) {
      EXPECT_TRUE(writer.add_unreferenced(
          sd::EndpointOption{sd::EndpointRole::multicast, *gateway_to_}.encode().view()));
    }
    for (const Said& said : entries) {
      std::vector<sd::OwnedOption> owned;
      owned.reserve(said.options.size());
      for (const sd::EndpointOption& option : said.options) {
        owned.push_back(option.encode());
      }
      std::vector<sd::Option> views;
      views.reserve(owned.size());
      for (const sd::OwnedOption& option : owned) {
        views.push_back(option.view());
      }
      for (const Raw& raw : said.more) {
        views.push_back({raw.type, raw.body});
      }
      EXPECT_TRUE(writer.add(said.entry, views));
    }
    const ByteView bytes =
        writer.finish(static_cast<std::uint8_t>(flags_ | sd::reboot_flag), sd::SessionId{session});
    return {bytes.begin(), bytes.end()};
  }

  Endpoint endpoint_;
  std::uint8_t flags_;
  std::optional<Endpoint> gateway_to_{};
  std::uint16_t multicast_ = 1;
  std::uint16_t unicast_ = 1;
};

/// A ServiceDiscovery in virtual time: run_to() jumps from deadline to deadline.
template <sd::Limits limits = sd::Limits{}>
class Machine {
 public:
  explicit Machine(const sd::Settings& settings = fixed_settings()) : discovery{settings, storage_->view()} {}

  /// Lets time pass until `time` after the start, included.
  /// @return what was sent meanwhile: "40ms -> 224.244.224.245:30490 s2 reboot: offer ..."
  std::vector<std::string> run_to(Duration time) {
    std::vector<std::string> sent;
    for (int i = 0;; ++i) {
      if (i > 1'000'000) {
        ADD_FAILURE() << "the deadline does not move on";
        return sent;
      }
      discovery.on_time(now);
      drain(sent);
      const auto deadline = discovery.deadline();
      if (!deadline || *deadline > start + time) {
        break;
      }
      now = std::max(now, *deadline);
    }
    now = std::max(now, start + time);
    return sent;
  }

  void receive(const std::vector<std::byte>& datagram, const Endpoint& from, bool via_multicast) {
    discovery.on_datagram(datagram, from, via_multicast, now);
  }
  void multicast(FakePeer& peer, const std::vector<FakePeer::Said>& entries) {
    receive(peer.multicast(entries), peer.endpoint(), true);
  }
  void unicast(FakePeer& peer, const std::vector<FakePeer::Said>& entries) {
    receive(peer.unicast(entries), peer.endpoint(), false);
  }

  /// What is sent without time passing.
  std::vector<std::string> sent() {
    std::vector<std::string> result;
    drain(result);
    return result;
  }
  std::vector<std::string> events() {
    std::vector<std::string> result;
    while (const auto event = discovery.poll_event()) {
      result.push_back(describe(*event));
    }
    return result;
  }

  TimePoint now = start;
  std::size_t room_bytes = 1400;

 private:
  std::unique_ptr<sd::Storage<limits>> storage_ = std::make_unique<sd::Storage<limits>>();

 public:
  sd::ServiceDiscovery discovery;

 private:
  void drain(std::vector<std::string>& sent) {
    std::vector<std::byte> room(room_bytes);
    while (const auto transmit = discovery.poll_transmit(room, now)) {
      const auto at = std::chrono::duration_cast<std::chrono::milliseconds>(now - start).count();
      sent.push_back(std::to_string(at) + "ms -> " + describe(transmit->destination) + " " +
                     describe_datagram(transmit->bytes));
    }
  }
};

inline FakePeer::Said find(std::uint16_t service, std::uint16_t instance = 0xffff, std::uint8_t major = 0xff,
                           std::uint32_t minor = 0xffff'ffff) {
  return {{.type = sd::EntryType::find_service,
           .service = sd::ServiceId{service},
           .instance = sd::InstanceId{instance},
           .major = major,
           .ttl_s = 3,
           .tail = minor},
          {}};
}

inline FakePeer::Said offer(std::vector<sd::EndpointOption> options, std::uint32_t ttl_s = 3,
                            std::uint16_t service = 0x1234, std::uint16_t instance = 0x5678) {
  return {{.type = sd::EntryType::offer_service,
           .service = sd::ServiceId{service},
           .instance = sd::InstanceId{instance},
           .major = 1,
           .ttl_s = ttl_s,
           .tail = 0},
          std::move(options)};
}

inline FakePeer::Said subscribe(std::uint16_t eventgroup, std::vector<sd::EndpointOption> options,
                                std::uint32_t ttl_s = 3, std::uint8_t counter = 0, bool initial = false) {
  return {{.type = sd::EntryType::subscribe_eventgroup,
           .service = sd::ServiceId{0x1234},
           .instance = sd::InstanceId{0x5678},
           .major = 1,
           .ttl_s = ttl_s,
           .tail = sd::Entry::eventgroup_tail(sd::EventgroupId{eventgroup}, counter, initial)},
          std::move(options)};
}

inline FakePeer::Said ack(std::uint16_t eventgroup, std::vector<sd::EndpointOption> options = {},
                          std::uint32_t ttl_s = 3, std::uint8_t counter = 0) {
  FakePeer::Said said = subscribe(eventgroup, std::move(options), ttl_s, counter);
  said.entry.type = sd::EntryType::subscribe_eventgroup_ack;
  return said;
}

inline sd::EndpointOption udp(const Endpoint& endpoint) {
  return {sd::EndpointRole::unicast, endpoint, Transport::udp};
}
inline sd::EndpointOption tcp(const Endpoint& endpoint) {
  return {sd::EndpointRole::unicast, endpoint, Transport::tcp};
}

}  // namespace trestle::test
