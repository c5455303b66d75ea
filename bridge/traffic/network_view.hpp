#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sd/core/reboot_detector.hpp"
#include "sd/wire/message.hpp"
#include "someip/wire/endpoint.hpp"

namespace trestle::traffic {

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
  std::uint64_t offers = 0;                ///< that came, since first_seen
  std::optional<TimePoint> last_to_all{};  ///< when the last one came that went to the group
  std::optional<Duration> cycle{};         ///< between the last two of these
  std::optional<TimePoint> gone{};

  /// Offers a second; 0 until there were two.
  [[nodiscard]] double rate() const;
  [[nodiscard]] TimePoint expires() const;
  [[nodiscard]] bool expires_ever() const noexcept { return ttl_s != sd::infinite_ttl_s; }
};

/// A subscription that somebody asked for.
struct SeenSubscription {
  enum class State : std::uint8_t { asked, acknowledged, refused };
  someip::ServiceId service{};
  someip::InstanceId instance{};
  std::uint8_t major = 0;
  someip::EventgroupId eventgroup{};
  Endpoint subscriber{};                ///< its SD endpoint
  Endpoint server{};                    ///< its SD endpoint, or the group, which it was asked for at
  std::optional<Endpoint> udp{};        ///< where the subscriber wants the events
  std::optional<Endpoint> tcp{};        ///< the same
  std::optional<Endpoint> multicast{};  ///< where the server sends them to all subscribers
  std::uint32_t ttl_s = 0;
  State state = State::asked;
  TimePoint first_seen{};
  TimePoint last_seen{};
  std::optional<TimePoint> gone{};

  [[nodiscard]] TimePoint expires() const { return last_seen + std::chrono::seconds{ttl_s}; }
  [[nodiscard]] bool expires_ever() const noexcept { return ttl_s != sd::infinite_ttl_s; }
};

[[nodiscard]] const char* to_string(SeenSubscription::State state) noexcept;

/// Something that happened.
struct Sighting {
  enum class Kind : std::uint8_t {
    offered,     ///< for the first time, or again after it was gone
    changed,     ///< offered with another minor version or other endpoints
    stopped,     ///< withdrawn
    expired,     ///< its TTL ran out; of services and subscriptions
    rebooted,    ///< gone because its host was started anew; of both
    looked_for,  ///< somebody sent a FindService
    subscribed,  ///< somebody sent a SubscribeEventgroup that was not subscribed
    acknowledged,
    refused,
    unsubscribed,
  };
  Kind kind{};
  SeenService service{};  ///< of looked_for: the ids, version, peer and TTL. Of subscriptions: nothing
  std::optional<SeenSubscription> subscription{};
};

[[nodiscard]] const char* to_string(Sighting::Kind kind) noexcept;

/// What a NetworkView took, and what it could not.
struct NetworkViewCounters {
  std::uint64_t messages = 0;   ///< of SD
  std::uint64_t malformed = 0;  ///< datagrams and messages
  std::uint64_t not_kept = 0;   ///< offers and subscriptions beyond the limit
};

/// What can be learned by listening to service discovery. It is no peer: it sends nothing.
class NetworkView {
 public:
  /// @param limit  of services; more are counted and forgotten. As many subscriptions, and pairs of hosts.
  explicit NetworkView(std::size_t limit) : limit_{limit} {}

  /// Takes what went to `to`, a port of SD, and adds what it says that is new.
  void on_datagram(ByteView datagram, const Endpoint& from, const Endpoint& to, TimePoint now,
                   std::vector<Sighting>& sightings);
  /// The same for one SD message.
  void on_message(const someip::Message& message, const Endpoint& from, const Endpoint& to, TimePoint now,
                  std::vector<Sighting>& sightings);
  /// Notices what has expired.
  void on_time(TimePoint now, std::vector<Sighting>& sightings);
  /// Forgets the services and subscriptions that are gone since then or longer.
  void forget_gone(TimePoint since);

  using Key = std::tuple<someip::ServiceId, someip::InstanceId, std::uint8_t, Endpoint>;
  /// By service, instance, major version and peer. Services that are gone stay until forget_gone().
  [[nodiscard]] const std::map<Key, SeenService>& services() const noexcept { return services_; }
  using SubscriptionKey = std::tuple<someip::ServiceId, someip::InstanceId, std::uint8_t,
                                     someip::EventgroupId, Endpoint, Endpoint, std::uint8_t>;
  /// By service, instance, major version, eventgroup, subscriber, server and counter.
  [[nodiscard]] const std::map<SubscriptionKey, SeenSubscription>& subscriptions() const noexcept {
    return subscriptions_;
  }
  [[nodiscard]] const NetworkViewCounters& counters() const noexcept { return counters_; }

 private:
  void on_entry(const sd::SdMessage& message, const sd::Entry& entry, const Endpoint& peer,
                const Endpoint& to, TimePoint now, std::vector<Sighting>& sightings);
  void on_offer(const SeenService& offer, TimePoint now, std::vector<Sighting>& sightings);
  void on_stop_offer(const SeenService& offer, TimePoint now, std::vector<Sighting>& sightings);
  void on_subscribe(const SubscriptionKey& key, const SeenSubscription& wish,
                    std::vector<Sighting>& sightings);
  void on_answer(const SubscriptionKey& key, const SeenSubscription& answer,
                 std::vector<Sighting>& sightings);
  void on_session(const Endpoint& peer, const Endpoint& to, someip::SessionId session, bool reboot,
                  TimePoint now, std::vector<Sighting>& sightings);
  /// The subscription; nothing when there is no room for one more.
  SeenSubscription* subscription_of(const SubscriptionKey& key);

  std::size_t limit_;
  std::map<Key, SeenService> services_;
  std::map<SubscriptionKey, SeenSubscription> subscriptions_;
  /// By sender and receiver: the sender counts for each receiver apart.  [feat_req_someipsd_765]
  std::map<std::pair<Endpoint, Endpoint>, sd::RebootDetector> sessions_;
  NetworkViewCounters counters_;
};

}  // namespace trestle::traffic
