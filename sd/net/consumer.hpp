#pragma once
#include <algorithm>
#include <map>
#include <unordered_map>

#include "sd/core/service_discovery.hpp"
#include "sd/net/e2e_channel.hpp"
#include "sd/net/ports.hpp"
#include "sd/net/service_spec.hpp"
#include "someip/core/call_table.hpp"
#include "someip/core/session_counter.hpp"

namespace trestle::sd {

/// The services of others that a Node uses: calls and subscriptions.
class Consumer {
 public:
  /// @param changed  called after something here, not in a call from outside, has asked discovery for more.
  Consumer(boost::asio::io_context& io, ServiceDiscovery& discovery, Ports& ports, const NodeConfig& config,
           NodeCounters& counters, DiscoveryLog log, DiscoveryLog warn, std::function<void()> changed);

  RequirementId require(const RequireSpec& spec, AvailabilityHandler handler, TimePoint now);
  void release(RequirementId id, TimePoint now);
  [[nodiscard]] std::vector<RemoteService> available(RequirementId id) const;

  CallId call(RequirementId id, const CallSpec& spec, std::span<const ByteView> payload,
              std::shared_ptr<const void> keep_alive, ResponseHandler handler);
  /// Takes the handler, unless it says why the request cannot leave.
  [[nodiscard]] someip::Result<CallId, CallFault> try_call(RequirementId id, const CallSpec& spec,
                                                           std::span<const ByteView> payload,
                                                           std::shared_ptr<const void> keep_alive,
                                                           ResponseHandler& handler);
  bool cancel(CallId call);
  /// Whether a request with so many bytes of payload would be dropped now, as too much waits.
  [[nodiscard]] bool is_full_for(RequirementId id, const CallSpec& spec, std::size_t bytes);
  bool send(RequirementId id, const CallSpec& spec, std::span<const ByteView> payload,
            std::shared_ptr<const void> keep_alive);

  SubscriptionId subscribe(const SubscribeSpec& spec, EventHandler handler, TimePoint now);
  void unsubscribe(SubscriptionId id, TimePoint now);
  [[nodiscard]] bool subscribed(SubscriptionId id) const;
  [[nodiscard]] SubscriptionFaults faults(SubscriptionId id) const;
  [[nodiscard]] OtherEvents other_events(SubscriptionId id) const;
  void clear();

  /// How large this event or answer may be, of which a segment has come; 0, and counted: it is not awaited.
  [[nodiscard]] std::size_t room_for(const someip::Header& header, const Source& source);
  void on_notification(const someip::Message& message, const Source& source);
  void on_answer(const someip::Message& message, const Source& source);
  void on_event(const ServiceAvailable& event, TimePoint now);
  void on_event(const ServiceLost& event);
  void on_event(const Subscribed& event);
  void on_event(const SubscriptionRefused& event);
  void on_event(const SubscriptionLost& event);
  /// After the events that came together: lets go what they have left unneeded, and no sooner, for what a
  /// message stops it may also start anew.  [feat_req_someipsd_1170]
  void end_unneeded(TimePoint now);
  /// Warns of services that are looked for and only offered in another version. After all events.
  void note_other_versions();

  [[nodiscard]] const someip::CallCounters& call_counters() const noexcept { return calls_.counters(); }
  [[nodiscard]] std::size_t outstanding_calls() const noexcept { return calls_.size(); }
  [[nodiscard]] someip::TcpClient::Counters tcp_counters() const;

 private:
  /// A service that is looked for, and the servers that offer it now.
  struct Search {
    RequirementHandle handle;
    RequireSpec spec;
    std::vector<RemoteService> servers{};
    std::optional<someip::InstanceId> chosen{};  ///< where calls go that name none
    std::vector<RemoteHandle> others{};          ///< offers in another version, of which has been warned
    std::vector<RemoteService> seen{};           ///< those that are there now; only while they are compared
    SubscriptionFaults faults{};                 ///< of a subscription
  };
  struct Requirement : Search {
    RequirementId id{};
    AvailabilityHandler handler{};
    E2eChannels e2e{};
  };
  /// A part of the application that gets events of a subscription.
  struct Listener {
    SubscriptionId id{};
    std::vector<someip::MethodId> events;
    EventHandler handler;
    E2eChannels e2e{};
    std::optional<std::size_t> max_event_bytes{};  ///< in segments over UDP
    bool active = true;  ///< false once it has unsubscribed, though it may still be in line to be called
  };
  /// A subscription at one server.
  struct AtServer {
    someip::InstanceId instance{};
    std::optional<SubscriptionHandle> handle{};
    std::optional<Endpoint> connection{};  ///< the server's end of the TCP connection that it was made with
    bool subscribed = false;
    bool not_over_tcp = false;  ///< the server does not offer that, of which has been warned
    std::shared_ptr<GroupPort> group{};
  };
  struct SharedSubscription : Search, std::enable_shared_from_this<SharedSubscription> {
    SubscribeSpec wanted{};  ///< whose events count for nothing: each listener has its own
    std::shared_ptr<UdpPort> port{};
    std::vector<std::shared_ptr<Listener>> listeners{};
    std::vector<AtServer> at_servers{};
    OtherEvents others{};
  };
  /// What is to be told of a requirement of discovery: one of the two.
  struct Requirer {
    std::shared_ptr<SharedSubscription> subscription{};
    std::shared_ptr<Requirement> requirement{};
  };
  /// That a listener wants an event.
  struct Wish {
    std::shared_ptr<SharedSubscription> subscription;
    std::shared_ptr<Listener> listener;
  };
  struct Connection {
    std::unique_ptr<someip::TcpClient> client;
    bool called = false;  ///< methods were called over it
  };
  /// Where a call goes, and at which pace.
  struct CallPath {
    const RemoteService* server = nullptr;
    someip::CallTarget target;
    someip::TpPacing pacing;
  };

  /// Where the wishes for an event are found.
  [[nodiscard]] static constexpr std::uint32_t key_of(someip::ServiceId service,
                                                      someip::MethodId event) noexcept {
    return std::uint32_t{value(service)} << 16U | value(event);
  }
  /// The one that sends from there, if any.
  [[nodiscard]] static const RemoteService* server_at(const SharedSubscription& subscription,
                                                      const Source& source);
  void note_other_event(const someip::Header& header, const Source& source);
  /// Puts the listeners of this event into called_. If there is none, counts why.
  [[nodiscard]] bool find_listeners(const someip::Header& header, const Source& source);
  [[nodiscard]] std::shared_ptr<Requirement> find(RequirementId id) const;
  [[nodiscard]] std::shared_ptr<SharedSubscription> find(SubscriptionId id) const;
  [[nodiscard]] AtServer* find(SubscriptionHandle handle, SharedSubscription** owner = nullptr) const;
  [[nodiscard]] RequirementHandle look_for(const RequireSpec& spec, TimePoint now);
  [[nodiscard]] Requirer find(RequirementHandle handle) const;
  void add(Search& search, Requirer requirer);
  void remove(Search& search);
  /// Whether `is_true` for any search for the service, so that what concerns several is logged once.
  template <typename Test>
  [[nodiscard]] bool any_search(someip::ServiceId service, Test is_true) const {
    const auto found = searches_.find(service);
    return found != searches_.end() &&
           std::ranges::any_of(found->second, [&](const Search* search) { return is_true(*search); });
  }

  void warn_of_others(Search& search);

  [[nodiscard]] std::optional<CallPath> route(Search& search, const CallSpec& spec, std::size_t bytes);
  void choose(Search& search);
  [[nodiscard]] std::optional<CallFault> transmit(const CallPath& route, const Requirement& requirement,
                                                  const someip::Header& header,
                                                  std::span<const ByteView> payload,
                                                  std::shared_ptr<const void> keep_alive);
  [[nodiscard]] std::optional<CallFault> transmit_bytes(const CallPath& route, const RequireSpec& spec,
                                                        const someip::Header& header,
                                                        std::span<const ByteView> payload,
                                                        std::shared_ptr<const void> keep_alive);
  // End-to-end protection: consumer_e2e.cpp.
  [[nodiscard]] E2eChannels channels_of(const RequireSpec& spec) const;
  [[nodiscard]] static E2eChannels channels_of(const SubscribeSpec& spec);
  [[nodiscard]] std::optional<CallFault> transmit_protected(E2eChannel& channel, const CallPath& route,
                                                            const RequireSpec& spec,
                                                            const someip::Header& header,
                                                            std::span<const ByteView> payload);
  [[nodiscard]] ResponseHandler checked(E2eChannel& channel, const someip::CallTarget& target,
                                        ResponseHandler handler);
  void deliver_checked(const Listener& listener, E2eChannel& channel, someip::Message message,
                       const Source& source);
  void note_event(const SharedSubscription& subscription, const someip::InstanceId& instance, TimePoint now);
  void fail_later(ResponseHandler handler, CallFault fault);
  void finish(someip::CallHandle call, const CallResult& result);
  void time_out(someip::CallHandle call);

  Connection& connection_to(const Endpoint& remote);
  void connected(const Endpoint& remote);
  void disconnected(const Endpoint& remote, const std::string& why);
  void note_not_connected(const Endpoint& remote);
  void disconnect(const Endpoint& remote);
  [[nodiscard]] bool is_needed(const Endpoint& remote, const Connection& connection) const;
  void subscribe_at(SharedSubscription& subscription, const RemoteService& server, TimePoint now);
  void unsubscribe_at(AtServer& at_server, TimePoint now);

  boost::asio::io_context& io_;
  ServiceDiscovery& discovery_;
  Ports& ports_;
  const NodeConfig& config_;
  NodeCounters& counters_;
  DiscoveryLog log_;
  DiscoveryLog warn_;
  std::function<void()> changed_;
  std::vector<std::shared_ptr<Requirement>> requirements_;  ///< by id
  std::vector<std::shared_ptr<SharedSubscription>> subscriptions_;
  std::vector<Requirer> requirers_;                        ///< by the index of a handle, as those below
  std::vector<std::weak_ptr<SharedSubscription>> owners_;  ///< owners of discovery's, past ones too
  std::unordered_map<someip::ServiceId, std::vector<Search*>> searches_;
  std::vector<Search*> with_others_;                             ///< searches whose `others` are not empty
  bool perhaps_unneeded_ = false;                                ///< something may be unneeded now
  std::unordered_map<std::uint32_t, std::vector<Wish>> wishes_;  ///< by event: asked for each segment
  /// What is subscribed to.
  std::unordered_map<someip::ServiceId, std::vector<SharedSubscription*>> by_service_;
  std::map<Endpoint, Connection> connections_;  ///< by the server's end  [feat_req_someip_645]
  someip::TcpClient::Counters past_connections_;
  std::shared_ptr<UdpPort> call_port_;
  std::vector<someip::CallSlot> call_slots_;
  someip::CallTable calls_;
  std::vector<ResponseHandler> waiting_;  ///< of each outstanding call, by its index
  std::vector<RemoteHandle> asked_;       ///< likewise
  DeadlineTimer call_timer_;
  someip::SessionCounter tell_sessions_;  ///< of fire and forget
  std::uint32_t next_id_ = 1;
  std::vector<std::shared_ptr<Listener>> called_;  ///< of one message; kept to reuse its memory
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace trestle::sd
