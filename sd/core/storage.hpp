#pragma once
#include <algorithm>
#include <array>
#include <type_traits>

#include "sd/core/configuration.hpp"
#include "sd/core/offer_schedule.hpp"
#include "sd/core/rate_limit.hpp"
#include "sd/core/reboot_detector.hpp"
#include "sd/core/recent_messages.hpp"
#include "sd/core/table.hpp"
#include "sd/wire/offer_options.hpp"
#include "someip/core/session_counter.hpp"

namespace trestle::sd {

/// How much a ServiceDiscovery can hold. What does not fit is refused, of a peer with a Nack if there is one.
struct Limits {
  std::uint16_t max_offers = 64;
  std::uint16_t max_eventgroups = 256;    ///< of all offers together
  std::uint16_t max_subscribers = 512;    ///< of all eventgroups together
  std::uint16_t max_requirements = 64;    ///< required services
  std::uint16_t max_subscriptions = 128;  ///< own ones
  std::uint16_t max_remote_services = 256;
  /// Peers that have said something. There is one more place for a newcomer when all others are taken by
  /// peers that use us or are used, and go on speaking: the newcomer is answered, but refused.
  std::uint16_t max_peers = 64;
  std::uint16_t max_tcp_connections = 64;  ///< of clients, for TCP events
  /// Entries waiting to be sent. A shutdown needs one for each offer and subscription.
  std::uint16_t max_pending_entries = 512;
  /// Different configurations of all services. If a peer's configuration finds no room, its service is known
  /// without it.
  std::uint16_t max_configurations = 64;
  /// The size of one of them, the whole body of its option: two bytes, and one more for each item. Items of a
  /// peer that do not fit are left out.
  std::uint16_t max_configuration_bytes = 256;
  /// Events waiting for poll_event(). When these are too few, something that ends waits in its own place, so
  /// that every loss is told; something new is refused. An offer needs one for each requirement that it fits.
  std::uint16_t max_pending_events = 512;
  /// Hosts of which is remembered that they did not answer for a service that they offer: more of them, who
  /// offer it in turn, begin anew each time. And, as long as nobody has answered, hosts that were asked
  /// beside the first one: an answer counts until so many more were asked.
  std::uint16_t max_silent_hosts = optimised_for_many ? 256 : 2;
};

/// One eventgroup of an offered service.
struct Eventgroup {
  EventgroupId id{};
  /// Whether it has unicast events of that transport: a subscriber must name an endpoint of it. With neither,
  /// all is multicast and no endpoint needed.  [feat_req_someipsd_1179]
  bool udp = true;
  bool tcp = false;
  /// Where multicast events go to, if any do; subscribers learn it from the Ack.  [feat_req_someipsd_763]
  std::optional<Endpoint> multicast{};
};

/// The slots of ServiceDiscovery's tables; only their sizes matter to others.
namespace slots {

/// An empty array, which takes no room in another object.
template <typename Kept>
struct NoneKept {
  [[nodiscard]] static constexpr Kept* begin() noexcept { return nullptr; }
  [[nodiscard]] static constexpr Kept* end() noexcept { return nullptr; }
};
/// Where there is little of everything, none.
template <typename Kept>
using OneOrNone = std::conditional_t<optimised_for_many, std::array<Kept, 1>, NoneKept<Kept>>;
/// The same for what serves only guards.
template <typename Kept>
using OneIfGuarded = std::conditional_t<guards, OneOrNone<Kept>, NoneKept<Kept>>;

/// A service of ours.
struct Offer : SlotBase {
  ServiceId service{};
  InstanceId instance{};
  std::uint8_t major = 0;
  std::uint32_t minor = 0;
  std::uint32_t ttl_s = 0;
  std::optional<Endpoint> udp;
  std::optional<Endpoint> tcp;
  OfferOptions options;
  std::uint16_t configuration = ConfigurationPool::none;
  OfferSchedule schedule;
  TimePoint last_multicast{};
};

/// An eventgroup of one of them.
struct OfferedEventgroup : SlotBase {
  std::uint16_t offer = 0;
  Eventgroup eventgroup;
};

/// A peer's subscription to an eventgroup of ours.
struct Subscriber : SlotBase {
  static constexpr std::uint16_t nobody = 0xffff;  // a configured one, which no peer asked for

  std::uint16_t offer = 0;
  std::uint16_t peer = nobody;
  EventgroupId eventgroup{};
  std::uint8_t counter = 0;
  std::optional<Endpoint> udp;
  std::optional<Endpoint> tcp;
  std::uint32_t receive_buffer_bytes = 0;  // 0: not told
  Endpoint configured_at;                  // of a configured one, instead of a peer
  TimePoint expiry = never;                // which is at the next reboot
};

/// A service that the application needs.
struct Requirement : SlotBase {
  ServiceId service{};
  InstanceId instance{};
  std::uint8_t major = 0;
  std::uint32_t minor = 0;
  std::uint16_t configuration = ConfigurationPool::none;  // the name of what is not SOME/IP
  std::uint16_t told = all;                               // of the remote services, those before this index
  // Of those that answered for such an instance and are not there or not kept, the one that held it longest.
  std::uint16_t holder = 0;  // a hash of its address and the instance; 0: nobody
  std::uint16_t held = 0;    // for how long; see rivals.cpp
  FindSchedule schedule;

  static constexpr std::uint16_t all = 0xffff;
};

/// A peer's offer.
struct Remote : SlotBase {
  static constexpr std::uint16_t none = 0xffff;

  ServiceId service{};
  InstanceId instance{};
  std::uint8_t major = 0;
  bool is_wanted : 1 = false;       // it fits a requirement
  bool has_answered : 1 = false;    // since it was offered first
  bool is_asked : 1 = false;        // and has not answered yet
  bool is_contested : 1 = false;    // somebody else offers it: it is asked until it answers or is mute
  bool goes_on : 1 = false;         // was offered again while a question was open
  bool is_back : 1 = false;         // took its place back from somebody who came while it was away
  std::uint8_t unanswered : 2 = 0;  // see ServiceDiscovery::not_answered(); up to is_mute
  static constexpr std::uint8_t is_mute = 3;
  std::uint32_t minor = 0;
  std::uint16_t peer = 0;
  std::uint16_t configuration = ConfigurationPool::none;
  std::uint16_t announced = Requirement::all;  // to the requirements before this index
  std::uint16_t subscribed_by = none;          // the first of our subscriptions to it
  std::optional<Endpoint> udp;
  std::optional<Endpoint> tcp;
  OfferOptions options;
  TimePoint expiry = never;     // which is at the next reboot
  TimePoint answer_due{};       // when to react to the last offer
  std::uint16_t proof_due = 0;  // in ticks: until when the last question may be answered
  std::uint32_t since = 0;      // it was offered; in the unit of Requirement::held
  // Whether it is kept back, see ServiceDiscovery::be_gateway_to(): it fits no requirement then.
  [[no_unique_address]] OneOrNone<bool> withheld{};

  [[nodiscard]] bool is_withheld() const noexcept {
    return std::ranges::find(withheld, true) != withheld.end();
  }

  // Once it is lost, and has no subscriptions: of that, the requirements before this index.
  [[nodiscard]] std::uint16_t& told() noexcept { return subscribed_by; }
};

/// The service of each place of two tables, by its index, also of places that are not in use any more. A
/// search among thousands reads these, and not the places, which lie far apart.
struct KeptServiceIds {
  std::span<ServiceId> remotes{};
  std::span<ServiceId> requirements{};
};
/// Instead of it where there is no memory for it: always empty.
struct NoServiceIds {
  static constexpr std::span<ServiceId> remotes{};
  static constexpr std::span<ServiceId> requirements{};
};
using ServiceIds = std::conditional_t<optimised_for_many, KeptServiceIds, NoServiceIds>;

/// What is remembered of a host that was asked by a service and did not answer: otherwise each offer that
/// differs would begin the questions anew.
struct Silence {
  std::uint16_t key = 0;             // a hash of the address and the service; 0: none
  std::uint16_t last_seen : 14 = 0;  // see rivals.cpp
  std::uint16_t unanswered : 2 = 0;  // as in Remote
  std::uint16_t proof_due = 0;       // likewise
};
/// Of about a millisecond, 2^20 ns: small processors have no instruction for a division of 64 bits.
[[nodiscard]] constexpr std::uint32_t ticks(TimePoint at) noexcept {
  return static_cast<std::uint32_t>(at.time_since_epoch().count() >> 20U);
}

/// A host that was asked by one of our subscriptions, as it offers the same as one that has not answered yet.
struct Rival {
  std::uint16_t host = 0;  // a hash of the address and the service; 0: none
  std::uint16_t subscription = 0;
  std::uint16_t asked : 15 = 0;  // when, in ticks
  std::uint16_t has_answered : 1 = 0;
};

/// Our subscription to an eventgroup of a peer.
struct Subscription : SlotBase {
  /// `idle`: nothing was sent, or its TTL is over; `requested`: the server's answer is still to come.
  enum class State : std::uint8_t { idle, requested, subscribed, refused };
  static constexpr std::uint16_t no_remote = 0xffff;

  std::uint16_t requirement = 0;
  InstanceId instance{};
  EventgroupId eventgroup{};
  std::uint8_t counter = 0;
  State state = State::idle;
  bool needs_connection = false;  // waits for reconnected()
  bool is_requested = false;      // a Subscribe waits to be sent
  std::uint32_t ttl_s = 0;
  std::optional<Endpoint> udp;
  std::optional<Endpoint> tcp;
  std::uint32_t receive_buffer_bytes = 0;  // of `udp`, to be told; 0: not
  std::uint16_t remote = no_remote;        // the offer it is for
  std::uint16_t next = Remote::none;       // of those that are for it
  bool ack_overdue = false;  // the last Subscribe was the answer to a multicast offer, and is not answered
  bool asked = false;        // a Subscribe was sent that is neither refused nor, with its TTL, over
  // Initial events were asked for, not by the last Subscribe, and it is not answered.
  bool initial_open = false;
  std::optional<Endpoint> multicast;
  TimePoint expiry = never;
  Duration silence_timeout{};   // 0: none
  TimePoint silent_at = never;  // when to ask anew, unless an event comes
  // Of questions to others that offer the same.
  [[no_unique_address]] std::conditional_t<guards, std::array<RateLimit, 1>, NoneKept<RateLimit>> questions{};
};

/// An Offer to a client, at a time that nobody can foresee, to see whether it hears it. In ticks.
struct Probe {
  static constexpr std::uint16_t time_to_prove = 50;    // by an answer that nobody can guess
  static constexpr std::uint16_t time_to_answer = 200;  // else it has failed
  static constexpr std::uint16_t not_due = 0xfc00;      // from here on: a time before `due`

  std::uint16_t asked = 0;
  std::uint16_t due = 0;
  bool has_failed = false;  // the one before was not answered in time
  [[nodiscard]] bool was_sent() const noexcept { return asked != due; }
};

/// A node that has sent SD messages, or that we send some.
struct Peer : SlotBase {
  std::uint16_t subscribers = 0;  // slots that name it, lost ones included
  std::uint16_t remotes = 0;      // likewise
  // From its first message to the last one, up to a minute. In units of 2^20 ns, about a millisecond, as
  // small processors have no instruction for a division of 64 bits.
  std::uint16_t heard = 0;
  Endpoint endpoint;
  RebootDetector reboots;
  [[no_unique_address]] RecentMessages recent;
  someip::SessionCounter sessions{};  // of what we send there by unicast  [feat_req_someipsd_765]
  bool explicit_initial_data : 1 = false;
  bool is_to_prove : 1 = false;  // that it hears us, as there is no room for all; afterwards it is in doubt
  bool is_in_doubt : 1 = false;  // it is to prove that beyond guessing: see ServiceDiscovery::probe()
  bool is_probed : 1 = false;    // and has not answered yet
  std::uint8_t proofs : 3 = 0;   // by answers in time; less those that came at other times
  static constexpr std::uint8_t is_proven = 4;
  bool is_used = false;    // scratch of the search for one to forget
  std::uint16_t held = 0;  // scratch of the search for the one that holds most
  // The last one. Where there are few places, nobody is asked.
  [[no_unique_address]] OneIfGuarded<Probe> probe{};
  TimePoint last_seen{};
  RateLimit entries;
  RateLimit real_reboots;
};

/// A connection of a client to one of our services, which subscriptions may need.
struct TcpConnection : SlotBase {
  Endpoint own;
  Endpoint remote;
  bool peer_spoke = false;  // a message of the client's node came while it stood
};

/// An entry to be sent, with what it references.
struct PendingEntry {
  static constexpr std::uint16_t to_multicast = 0xffff;

  TimePoint due{};
  std::uint16_t peer = to_multicast;
  bool with_next = false;  // must stand in the same message as the next one  [feat_req_someipsd_1178]
  bool first = false;      // of a Subscribe: not the renewal of another one
  std::uint16_t subscription = Remote::none;  // whose it is, unless that has ended
  std::uint8_t option_count = 0;
  std::uint16_t configuration = ConfigurationPool::none;
  std::uint32_t receive_buffer_bytes = 0;  // to be told in a configuration option, if there is no other one
  Entry entry;
  std::array<OwnedOption, 3 + offer_option_kinds> options{};  // endpoints: UDP, TCP, multicast

  void add(const OwnedOption& option) noexcept { options[option_count++] = option; }
  void add(EndpointRole role, const std::optional<Endpoint>& endpoint, Transport transport) noexcept {
    if (endpoint) {
      add(EndpointOption{role, *endpoint, transport}.encode());
    }
  }
};

}  // namespace slots

/// Views of the memory of a ServiceDiscovery: the sizes are its limits.
struct StorageView {
  std::span<slots::Offer> offers;
  std::span<slots::OfferedEventgroup> eventgroups;
  std::span<slots::Subscriber> subscribers;
  std::span<slots::Requirement> requirements;
  std::span<slots::Subscription> subscriptions;
  std::span<slots::Remote> remotes;
  std::span<slots::Peer> peers;
  std::span<slots::TcpConnection> tcp_connections;
  std::span<slots::PendingEntry> pending_entries;
  std::span<Happening> pending_events;
  std::span<std::byte> configuration_bytes;
  std::span<slots::ConfigurationBlock> configurations;
  std::span<slots::Silence> silences;
  std::span<slots::Rival> rivals;
  [[no_unique_address]] slots::ServiceIds ids{};  ///< for each of `remotes` and `requirements`, or none
};

/// The memory of one ServiceDiscovery, about 280 KB with the default limits: have it as a static, a member,
/// or on the heap. Must outlive the ServiceDiscovery and serves no other.
///
///     static Storage<Limits{.max_offers = 4, .max_peers = 8}> storage;
///     ServiceDiscovery discovery{settings, storage.view()};
template <Limits limits = Limits{}>
class Storage {
  static_assert(limits.max_pending_entries >= limits.max_offers + limits.max_subscriptions,
                "a shutdown must find room for all its Stop entries");

 public:
  [[nodiscard]] StorageView view() noexcept {
    return {memory_.offers.view(),         memory_.eventgroups.view(),     memory_.subscribers.view(),
            memory_.requirements.view(),   memory_.subscriptions.view(),   memory_.remotes.view(),
            memory_.peers.view(),          memory_.tcp_connections.view(), memory_.pending.view(),
            memory_.pending_events.view(), memory_.configuration_bytes,    memory_.configurations.view(),
            memory_.silences.view(),       memory_.rivals.view(),          memory_.ids_view()};
  }

 private:
  // Zeros are slots that nobody uses; what they hold is made when they are taken. So a static Storage takes
  // no flash memory to be copied from, and making one is a memset().
  template <typename Slot, std::size_t count>
  struct Slots {
    static_assert(std::is_trivially_copyable_v<Slot>, "its bytes are to be an object of it");
    std::span<Slot> view() noexcept { return {static_cast<Slot*>(static_cast<void*>(bytes.data())), count}; }
    alignas(Slot) std::array<std::byte, count * sizeof(Slot)> bytes;
  };
  struct Memory {
    Slots<slots::Offer, limits.max_offers> offers;
    Slots<slots::OfferedEventgroup, limits.max_eventgroups> eventgroups;
    Slots<slots::Subscriber, limits.max_subscribers> subscribers;
    Slots<slots::Requirement, limits.max_requirements> requirements;
    Slots<slots::Subscription, limits.max_subscriptions> subscriptions;
    Slots<slots::Remote, limits.max_remote_services> remotes;
    Slots<slots::Peer, limits.max_peers + std::size_t{1}> peers;
    Slots<slots::TcpConnection, limits.max_tcp_connections> tcp_connections;
    Slots<slots::PendingEntry, limits.max_pending_entries> pending;
    Slots<Happening, limits.max_pending_events> pending_events;
    std::array<std::byte, (limits.max_configurations + std::size_t{1}) * limits.max_configuration_bytes>
        configuration_bytes;
    Slots<slots::ConfigurationBlock, limits.max_configurations> configurations;
    Slots<slots::Silence, guards ? limits.max_silent_hosts : std::uint16_t{0}> silences;
    Slots<slots::Rival, guards ? limits.max_silent_hosts : std::uint16_t{0}> rivals;
    struct Ids {
      Slots<ServiceId, limits.max_remote_services> remotes;
      Slots<ServiceId, limits.max_requirements> requirements;
    };
    [[no_unique_address]] std::conditional_t<optimised_for_many, Ids, slots::NoServiceIds> ids;

    slots::ServiceIds ids_view() noexcept {
      if constexpr (optimised_for_many) {
        return {ids.remotes.view(), ids.requirements.view()};
      } else {
        return {};
      }
    }
  };

  Memory memory_{};
};

}  // namespace trestle::sd
