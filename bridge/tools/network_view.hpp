#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sd/core/reboot_detector.hpp"
#include "sd/wire/message.hpp"
#include "someip/wire/endpoint.hpp"

namespace trestle::bridge {

/// An offer that somebody sent.
struct SeenService {
  someip::ServiceId service{};
  someip::InstanceId instance{};
  std::uint8_t major = 0;
  std::uint32_t minor = 0;
  std::optional<Endpoint> udp{};
  std::optional<Endpoint> tcp{};
  Endpoint peer{};  ///< its SD endpoint
  std::uint32_t ttl_s = 0;
  TimePoint first_seen{};
  TimePoint last_seen{};
  std::uint64_t offers = 0;  ///< that came, since first_seen
  std::optional<TimePoint> gone{};

  /// Offers a second; 0 until there were two.
  [[nodiscard]] double rate() const;
  [[nodiscard]] TimePoint expires() const;
  [[nodiscard]] bool expires_ever() const noexcept { return ttl_s != sd::infinite_ttl_s; }
};

/// Something that happened.
struct Sighting {
  enum class Kind : std::uint8_t {
    offered,     ///< for the first time, or again after it was gone
    changed,     ///< offered with another minor version or other endpoints
    stopped,     ///< withdrawn
    expired,     ///< its TTL ran out
    rebooted,    ///< gone because its host was started anew
    looked_for,  ///< somebody sent a FindService
    subscribed,  ///< somebody sent a SubscribeEventgroup; most go by unicast and are not seen
    unsubscribed,
  };
  Kind kind{};
  SeenService service{};  ///< of looked_for and (un)subscribed: the ids, version, peer and TTL
  std::optional<someip::EventgroupId> eventgroup{};
};

[[nodiscard]] const char* to_string(Sighting::Kind kind) noexcept;

/// What one hears who only listens to service discovery. No peer: it sends nothing.
class NetworkView {
 public:
  struct Counters {
    std::uint64_t messages = 0;   ///< of SD
    std::uint64_t malformed = 0;  ///< datagrams and messages
    std::uint64_t not_kept = 0;   ///< offers of more services, or hosts, than there is room for
  };

  /// @param max_services  more are counted and forgotten; as many hosts.
  explicit NetworkView(std::size_t max_services) : max_services_{max_services} {}

  /// Takes what came to SD's port, and adds what it says that is new.
  void on_datagram(ByteView datagram, const Endpoint& from, bool multicast, TimePoint now,
                   std::vector<Sighting>& sightings);
  /// Notices what has expired.
  void on_time(TimePoint now, std::vector<Sighting>& sightings);
  /// Forgets the services that are gone since then or longer.
  void forget_gone(TimePoint since);

  using Key = std::tuple<someip::ServiceId, someip::InstanceId, std::uint8_t, Endpoint>;
  /// By service, instance, major version and peer. Services that are gone stay until forget_gone().
  [[nodiscard]] const std::map<Key, SeenService>& services() const noexcept { return services_; }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  void on_message(const someip::Message& message, const Endpoint& from, bool multicast, TimePoint now,
                  std::vector<Sighting>& sightings);
  void on_offer(const SeenService& offer, TimePoint now, std::vector<Sighting>& sightings);
  void on_reboot(const Endpoint& peer, TimePoint now, std::vector<Sighting>& sightings);
  void lose(SeenService& service, Sighting::Kind why, TimePoint now, std::vector<Sighting>& sightings);

  std::size_t max_services_;
  std::map<Key, SeenService> services_;
  std::map<Endpoint, sd::RebootDetector> peers_;
  Counters counters_;
};

}  // namespace trestle::bridge
