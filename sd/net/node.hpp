// sd/net: what an application uses. Boost.Asio, one thread.
//
//   node.hpp          offers and uses services at one address; drives sd/core
//   service_spec.hpp  describes services, subscriptions and calls; node_config.hpp: settings of a Node
//   handles.hpp       Offer and Subscription objects; proxy.hpp: calls with callbacks, futures, coroutines
//   provider.hpp      the server's part of a Node; consumer.hpp: the client's part
//   ports.hpp         its sockets: takes datagrams apart, puts segments together
//   discovery_sender.hpp  sends what sd/core wants to send
//   e2e_spec.hpp, e2e_channel.hpp  end-to-end protection
//   checks.hpp        mistakes in descriptions, with the name of the field
#pragma once
#include "sd/core/service_discovery.hpp"
#include "sd/net/node_config.hpp"
#include "sd/net/service_spec.hpp"
#include "someip/core/call_table.hpp"
#include "someip/core/tp_reassembler.hpp"
#include "someip/net/net_error.hpp"
#include "someip/net/socket_counters.hpp"

namespace boost::asio {
class io_context;
}

namespace trestle::sd {

/// Offers services and uses those of others: SD and the sockets of one address of this host.
///
/// Not thread-safe: use it on the thread that runs the io_context. All handlers are called on that thread,
/// and never from within the call that they were given to. They may call anything here, but not destroy the
/// Node. An exception in a handler leaves io_context::run(), which may be called again: nothing is lost.
class Node {
 public:
  using EventHandler = sd::EventHandler;

  /// Opens SD's sockets and starts.
  /// @throws someip::NetError when they cannot be opened; above all when another SOME/IP stack has the port.
  ///         std::invalid_argument for a configuration that makes no sense: what() names the field.
  /// @param warn  is told, in place of `log`, of socket buffers smaller than configured, and of likely
  ///              mistakes: others offer less, or something else, than is wanted. Empty: `log` is.
  Node(boost::asio::io_context& io, const NodeConfig& config, DiscoveryLog log = {}, DiscoveryLog warn = {});
  /// No handler is called any more; whoever uses the Node's services notices when their time to live is over.
  ~Node();
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  [[nodiscard]] boost::asio::io_context& io() const noexcept;

  // --- Services of ours -----------------------------------------------------------------------------------

  /// Opens the service's ports and offers it.
  /// @throws someip::NetError when a port cannot be opened; std::invalid_argument when the description
  ///         contradicts itself or discovery refuses the service: what() says why.
  OfferHandle offer(ServiceSpec spec);
  void withdraw(OfferHandle offer);
  /// Opens a port, or keeps it open, as long as the result lives, which must end before the Node does. So a
  /// program that offers or subscribes now and then does not lose the port to others in between. Requests
  /// that arrive there meanwhile are answered like those to any unknown service.
  /// @param number  not 0.
  /// @throws someip::NetError
  [[nodiscard]] std::shared_ptr<const void> hold_port(std::uint16_t number, Transport transport);
  /// How many endpoints get this event; a multicast group that is used counts as one.
  [[nodiscard]] std::size_t subscribers(OfferHandle offer, someip::MethodId event) const;

  /// Sends an event to all its subscribers. If the event has an update rule (EventSpec), it is sent only when
  /// the rule says so, and the payload is copied; a cycle repeats it with this `pacing`.
  /// @param payload     slices that together are the payload.
  /// @param keep_alive  owns what the slices point to; released once the message has been sent or dropped.
  ///                    Without it, the slices need only live during the call: what has to wait is copied.
  /// @throws std::invalid_argument for an impossible pacing (what() names the field), and an event in no
  ///         eventgroup of the service. An offer that has ended is no error: nobody gets the event.
  Notified notify(OfferHandle offer, someip::MethodId event, std::span<const ByteView> payload,
                  const std::shared_ptr<const void>& keep_alive = nullptr,
                  const someip::TpPacing& pacing = {});

  /// Sends an event to those subscribers alone for which `wanted` is true, always by unicast. Not for the
  /// notifier of a field, nor for an event with an update rule.  [feat_req_someip_804]
  /// @throws std::invalid_argument for these, and as notify().
  Notified notify_some(OfferHandle offer, someip::MethodId event, const SubscriberFilter& wanted,
                       std::span<const ByteView> payload,
                       const std::shared_ptr<const void>& keep_alive = nullptr,
                       const someip::TpPacing& pacing = {});

  /// Calls `told` once, as soon as there is room for an event with so many bytes of payload: it would not be
  /// dropped for a subscriber because too much waits for that one (Notified::no_room). Also when nobody
  /// subscribes any more, the offer has ended, or there never is room for so much. Offer::room() is the same
  /// for futures and coroutines.
  /// @throws std::invalid_argument without a handler.
  void when_room(OfferHandle offer, someip::MethodId event, std::size_t bytes, std::function<void()> told);

  /// Gives a field a value, and sends it to the subscribers if the field's rule says so (FieldSpec::update).
  /// @param field  its getter, setter or notifier.
  /// @throws std::invalid_argument when the service has no such field.
  Notified set_field(OfferHandle offer, someip::MethodId field, ByteView value);
  /// The same without a copy: the Node keeps this one.
  /// @throws std::invalid_argument also when there is no value.
  Notified set_field(OfferHandle offer, someip::MethodId field,
                     std::shared_ptr<const std::vector<std::byte>> value);
  /// The field's value; nothing if it has none yet.
  [[nodiscard]] std::shared_ptr<const std::vector<std::byte>> field(OfferHandle offer,
                                                                    someip::MethodId field) const;
  /// The field has no value any more, as at first: new subscribers get none. Not for a field with a cycle.
  void forget_field(OfferHandle offer, someip::MethodId field);

  // --- Services of others ---------------------------------------------------------------------------------

  /// Looks for a service, to call its methods. `handler` is told of each server that comes and goes.
  /// @throws as offer().
  RequirementId require(const RequireSpec& spec, AvailabilityHandler handler = {});
  /// The service is not needed any more. Calls that are outstanding go on.
  void release(RequirementId requirement);
  /// The servers that offer it now.
  [[nodiscard]] std::vector<RemoteService> available(RequirementId requirement) const;

  /// Whether anybody else is known to offer an instance of the service now. This is for programs that choose
  /// ids. Services that nobody here looks for are remembered only as far as there is room.
  [[nodiscard]] bool is_offered_by_others(someip::ServiceId service) const;
  /// All services that others are known to offer now, likewise: to explain why a service is not there.
  [[nodiscard]] std::vector<SeenOffer> seen_offers() const;
  /// How many other hosts are known to take part in discovery.
  [[nodiscard]] std::size_t seen_hosts() const;
  /// These, one by one.
  [[nodiscard]] std::vector<SeenHost> hosts() const;
  /// Events of a subscription's servers and service which nobody here has asked for; nothing if unknown.
  [[nodiscard]] OtherEvents other_events(SubscriptionId subscription) const;

  /// What a server says about its service: the items of its configuration, in their order, equal keys
  /// included. Nothing once the service is gone.  [feat_req_someipsd_1146] [feat_req_someipsd_1147]
  [[nodiscard]] std::vector<ConfigurationText> configuration(const RemoteService& service) const;

  /// Calls a method of a server that offers the service now. `payload` and `keep_alive` as in notify().
  /// @param handler  called once: with the response, or why not. Not after cancel() or the Node's end.
  /// @throws std::invalid_argument without a handler: then it is for send(); and for a pacing, as notify().
  CallId call(RequirementId requirement, const CallSpec& spec, std::span<const ByteView> payload,
              ResponseHandler handler, std::shared_ptr<const void> keep_alive = nullptr);
  /// The same, but a reason why the request cannot leave is returned at once, not given to the handler.
  [[nodiscard]] someip::Result<CallId, CallFault> try_call(RequirementId requirement, const CallSpec& spec,
                                                           std::span<const ByteView> payload,
                                                           ResponseHandler handler,
                                                           std::shared_ptr<const void> keep_alive = nullptr);
  /// @return false when the call has ended already.
  bool cancel(CallId call);
  /// Calls a method that gives no response: fire and forget.  [feat_req_someip_345]
  /// @return false when the request could not be sent.
  /// @throws std::invalid_argument for a pacing, as notify().
  bool send(RequirementId requirement, const CallSpec& spec, std::span<const ByteView> payload,
            std::shared_ptr<const void> keep_alive = nullptr);

  /// Calls `told` once, as soon as there is room for a request with so many bytes of payload, after one that
  /// could not be sent: CallFault::not_sent. Also when no server is there any more. Proxy::room() is the same
  /// for futures and coroutines.
  /// @throws std::invalid_argument without a handler.
  void when_room(RequirementId requirement, const CallSpec& spec, std::size_t bytes,
                 std::function<void()> told);

  /// Finds the service, subscribes whenever it is offered, and hands its events to `handler`. Several calls
  /// for one eventgroup, port and protocol share one subscription on the wire.
  /// @throws as offer(), and without a handler.
  SubscriptionId subscribe(const SubscribeSpec& spec, EventHandler handler);
  /// The handler is not called any more.
  void unsubscribe(SubscriptionId subscription);
  /// Whether the eventgroup is subscribed to now: a server has acknowledged it.
  [[nodiscard]] bool subscribed(SubscriptionId subscription) const;
  /// Calls `changed` whenever subscribed() may have changed for a subscription, or a server refused one.
  void on_subscriptions(std::function<void()> changed);
  /// Subscriptions that share one on the wire share these, too.
  [[nodiscard]] SubscriptionFaults subscription_faults(SubscriptionId subscription) const;

  /// Tells that the network's link has come up or gone down; it is up at the start. While it is down all
  /// services and subscribers are lost and nothing is sent by discovery; afterwards everything starts anew.
  /// This is for what the Node cannot see by itself, such as the port of a switch. It watches its own network
  /// interface (NodeConfig::watch_link), and the link is up when both say so.  [feat_req_someipsd_23]
  /// [feat_req_someipsd_436] [feat_req_someipsd_437] [feat_req_someipsd_440]
  void link(bool up);

  /// Withdraws all offers and subscriptions: the messages that say so have been sent when it returns. The
  /// Node does nothing afterwards. Events and requests that still wait to be sent are dropped and counted.
  void shutdown();

  // --- What it has done -----------------------------------------------------------------------------------

  [[nodiscard]] NodeCounters counters() const;
  /// How full its tables are, and how much of the memory is taken that all its messages may have.
  [[nodiscard]] std::vector<UsedLimit> used_limits() const;
  /// The last 32 subscribers for which events were dropped because they take them too slowly (EventWait).
  [[nodiscard]] std::vector<SlowSubscriber> slow_subscribers() const;
  [[nodiscard]] const SdCounters& discovery_counters() const noexcept;
  [[nodiscard]] someip::TpCounters reassembly_counters() const;
  [[nodiscard]] const someip::CallCounters& call_counters() const noexcept;
  [[nodiscard]] someip::SenderCounters sender_counters() const;
  [[nodiscard]] someip::TcpServerCounters tcp_server_counters() const;
  [[nodiscard]] someip::TcpClientCounters tcp_client_counters() const;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace trestle::sd
