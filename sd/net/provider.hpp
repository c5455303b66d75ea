#pragma once
#include <functional>
#include <map>
#include <unordered_set>

#include "sd/core/service_discovery.hpp"
#include "sd/net/access_guard.hpp"
#include "sd/net/e2e_channel.hpp"
#include "sd/net/ports.hpp"
#include "sd/net/rare_line.hpp"
#include "sd/net/service_spec.hpp"
#include "sd/net/unproven_receivers.hpp"
#include "someip/core/session_counter.hpp"

namespace trestle::sd {

/// The services that a Node offers: their requests, events and fields.
class Provider {
 public:
  Provider(boost::asio::io_context& io, ServiceDiscovery& discovery, Ports& ports, const NodeConfig& config,
           NodeCounters& counters, AccessGuard& access, DiscoveryLog log, DiscoveryLog warn);

  struct Receiver {
    Endpoint to;
    Transport transport = Transport::udp;
    /// Segments that may leave at once, as its subscriptions tell: the least of them; see burst_into().
    std::optional<std::size_t> burst{};
  };

  OfferHandle offer(ServiceSpec spec, TimePoint now);
  void withdraw(OfferHandle offer, TimePoint now);
  void clear();

  [[nodiscard]] std::size_t subscribers(OfferHandle offer, someip::MethodId event) const;
  /// @param wanted  empty: all subscribers.
  Notified notify(OfferHandle offer, someip::MethodId event, const SubscriberFilter& wanted,
                  std::span<const ByteView> payload, const std::shared_ptr<const void>& keep_alive,
                  const someip::TpPacing& pacing);
  /// Whether an event with so many bytes of payload would be dropped now for a subscriber for which too much
  /// waits.
  [[nodiscard]] bool is_full_for(OfferHandle offer, someip::MethodId event, std::size_t bytes) const;
  [[nodiscard]] bool is_notifier(OfferHandle offer, someip::MethodId event) const;
  using Value = std::shared_ptr<const std::vector<std::byte>>;
  Notified set_field(OfferHandle offer, someip::MethodId field, Value value);
  [[nodiscard]] Value field(OfferHandle offer, someip::MethodId field) const;
  void forget_field(OfferHandle offer, someip::MethodId field);

  /// How large the request may be of which this segment has come. 0: it is not to a method that is offered at
  /// this port, or the method takes no large requests. Then this also answers once, or counts.
  [[nodiscard]] std::size_t room_for(const someip::Message& segment, const Source& source);
  /// A message that is neither a notification nor an answer.
  void on_request(const someip::Message& message, const Source& source);
  void on_event(const SubscriberAdded& event);
  void on_event(const InitialDataRequested& event);
  void on_event(const SubscriberRemoved& event);
  /// Warns of our instances that somebody else offers as well.
  void note_rivals();
  [[nodiscard]] std::vector<SlowSubscriber> slow_subscribers() const;

 private:
  /// A value that is sent by a rule: that of a field, or the last payload of an event that has a rule.
  struct Ruled {
    std::optional<someip::MethodId> event;  ///< nothing: a field without notifier
    someip::UpdateSchedule schedule;
    DifferenceCheck differs;
    someip::TpPacing pacing;
    Value value{};  ///< nothing: none yet
    Value sent{};   ///< with the last notification
  };
  /// What is known of an event.
  struct Sending {
    someip::SessionCounter session;
    someip::WaitRule waits;
  };
  /// A subscriber that was too slow for an event.
  struct Slow {
    SlowSubscriber subscriber;
    std::uint64_t unsaid = 0;
    TimePoint next_line{};
  };
  /// What we offer now, with its ports.
  struct OpenOffer {
    OfferHandle handle;
    ServiceSpec spec;
    std::shared_ptr<UdpPort> udp;
    std::shared_ptr<TcpPort> tcp;
    std::map<someip::MethodId, Sending> events;
    std::vector<Ruled> values;  ///< of the fields as in `spec`, then of the events as in `spec`
    E2eChannels e2e;
  };

  /// Where offered_ has an instance.
  [[nodiscard]] static constexpr std::uint64_t key_of(ServiceId service, InstanceId instance,
                                                      std::uint8_t major) noexcept {
    return std::uint64_t{value(service)} << 32U | std::uint64_t{value(instance)} << 8U | major;
  }
  [[nodiscard]] std::shared_ptr<OpenOffer> find(OfferHandle handle) const;
  /// The field with this getter, setter or notifier, as an index.
  [[nodiscard]] static std::optional<std::size_t> field_of(const OpenOffer& offer, someip::MethodId any);
  [[nodiscard]] static Transport transport_of(const ServiceSpec& spec, someip::MethodId event);
  [[nodiscard]] static Eventgroup eventgroup_of(const ServiceSpec& spec, const EventgroupSpec& group);
  /// Fills receivers_ with all that get this event, each once.
  void find_receivers(const OpenOffer& offer, someip::MethodId event, const SubscriberFilter& wanted) const;
  Notified send_event(OpenOffer& offer, someip::MethodId event, const SubscriberFilter& wanted,
                      std::span<const ByteView> payload, const std::shared_ptr<const void>& keep_alive,
                      const someip::TpPacing& pacing);
  [[nodiscard]] static someip::SessionId session_of(OpenOffer& offer, someip::MethodId event,
                                                    std::size_t bytes);
  Notified send_to_receivers(OpenOffer& offer, const someip::Header& header,
                             std::span<const ByteView> payload, const std::shared_ptr<const void>& keep_alive,
                             const someip::TpPacing& pacing);
  /// Follows the event's rule for slow subscribers.
  void send_to_receiver(OpenOffer& offer, const Receiver& receiver, const someip::Header& header,
                        std::span<const ByteView> payload, const std::shared_ptr<const void>& keep_alive,
                        const someip::TpPacing& pacing, Notified& result);
  [[nodiscard]] static bool is_full_for(const OpenOffer& offer, const Receiver& receiver, std::size_t bytes);
  void note_slow(const OpenOffer& offer, const Receiver& receiver, const someip::Header& header,
                 std::size_t overtaken);
  /// A request as it is judged by its header.
  struct Judged {
    std::shared_ptr<OpenOffer> offer;  ///< that it is to, if it has no fault
    const someip::AnswerRules* rules;  ///< of the interface that it is for, if there is any
    someip::RequestCheck check;
    bool is_allowed = true;  ///< else `check` tells what to answer
  };
  [[nodiscard]] Judged judge(const someip::Header& header, const Source& source);
  void refuse(const Judged& judged, const Source& source);
  [[nodiscard]] ReplyPath reply_path(const Source& source, bool in_segments);
  /// Whether so large an answer may go there over UDP: a host in whose name others may ask gets little.
  [[nodiscard]] bool may_receive(const Endpoint& to, std::size_t bytes);
  void say_who_is_silent(const IpAddress& to);
  [[nodiscard]] someip::MethodKind kind_of(const OpenOffer& offer, someip::MethodId method) const;
  /// Of what a method, getter or setter answers.
  [[nodiscard]] someip::TpPacing pacing_of(const ServiceSpec& spec, someip::MethodId method) const;
  void handle(const std::shared_ptr<OpenOffer>& offer, const someip::Message& message, Responder responder);
  // With end-to-end protection: provider_e2e.cpp.
  [[nodiscard]] static E2eChannels channels_of(const ServiceSpec& spec);
  Notified notify_protected(OpenOffer& offer, E2eChannel& channel, const someip::Header& header,
                            std::span<const ByteView> payload, const someip::TpPacing& pacing);
  void handle_checked(const std::shared_ptr<OpenOffer>& offer, E2eChannel& channel, someip::Message message,
                      const Source& source, ReplyPath path);
  // Values: provider_values.cpp.
  /// Takes the initial values out of `spec`.
  [[nodiscard]] std::vector<Ruled> values_of(ServiceSpec& spec, TimePoint now) const;
  [[nodiscard]] static Ruled* event_with_rule(OpenOffer& offer, someip::MethodId event);
  void call_setter(const OpenOffer& offer, std::size_t field, ByteView wanted, Responder& responder);
  Notified store(OpenOffer& offer, Ruled& ruled, Value value);
  Notified send_value(OpenOffer& offer, Ruled& ruled);
  void send_cyclic_values();
  void arm_cycle();

  void send_initial_values(OfferHandle handle, EventgroupId eventgroup, const Subscriber& subscriber);
  [[nodiscard]] bool may_be_repeated(const OpenOffer& offer, someip::MethodId event, const Endpoint& to,
                                     std::size_t bytes);
  template <typename SubscriberEvent>
  void log_subscriber(const SubscriberEvent& event, const std::string& what) const;

  ServiceDiscovery& discovery_;
  Ports& ports_;
  const NodeConfig& config_;
  NodeCounters& counters_;
  AccessGuard& access_;
  UnprovenReceivers unproven_;
  RepeatedValues repeated_;
  std::function<bool(const Endpoint& to, std::size_t bytes)> may_be_sent_;  ///< for each ReplyPath
  std::function<void(const IpAddress& to)> not_there_;                      ///< likewise
  RareLine refused_answers_;
  RareLine repeated_values_;
  RareLine answers_to_silent_;
  DiscoveryLog log_;
  DiscoveryLog warn_;
  std::vector<std::shared_ptr<OpenOffer>> offers_;
  std::unordered_set<std::uint64_t> offered_;  ///< the instances of offers_, but for other protocols
  std::vector<RemoteHandle> rivals_;           ///< offers of the same by others, of which has been warned
  std::vector<Slow> slow_;                     ///< the one that was so last is last
  TimePoint next_slow_line_{};                 ///< about any of them
  DeadlineTimer cycle_;                        ///< of all values that are sent cyclically
  // Of one event; kept to reuse their memory, empty while it is sent.
  mutable std::vector<Receiver> receivers_;
  /// Subscribers that get it by multicast: their UDP endpoints, or SD endpoints if they need no other.
  mutable std::vector<Endpoint> by_multicast_;
};

}  // namespace trestle::sd
