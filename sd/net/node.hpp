#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sd/core/service_discovery.hpp"
#include "someip/core/tp_reassembler.hpp"
#include "someip/net/message_sender.hpp"

namespace trestle::sd {

struct NodeConfig {
  /// Own unicast address: SD listens on it, and it is the endpoint of every offered service.
  IpAddress address;
  std::string multicast_interface{};  ///< for multicast; empty: the one that has `address`
  IpAddress multicast = IpAddress::v4(224, 244, 224, 245);  ///< SD's group
  std::uint16_t port = 30490;  ///< SD's port, of all nodes  [feat_req_someip_676]
  Timing timing{};
  Limits limits{};                                         ///< of service discovery
  std::size_t max_message_bytes = std::size_t{16} << 20U;  ///< payload of a received message
  std::size_t max_reassemblies = 16;                       ///< large messages that may be under way at once
};

/// An eventgroup of an offered service, with the events that its subscribers get.
struct EventgroupSpec {
  someip::EventgroupId id{};
  std::vector<someip::MethodId> events{};
};

/// A service to offer.
struct ServiceSpec {
  someip::ServiceId service{};
  someip::InstanceId instance{};
  std::uint8_t major = 1;
  std::uint32_t minor = 0;
  std::uint16_t port = 0;  ///< UDP; 0: the system chooses. Several services may share one.
  std::vector<EventgroupSpec> eventgroups{};
};

/// An eventgroup to subscribe to.
struct SubscribeSpec {
  someip::ServiceId service{};
  someip::InstanceId instance{};  ///< one, not any
  std::uint8_t major = 1;
  std::uint32_t minor = any_minor;
  someip::EventgroupId eventgroup{};
  std::vector<someip::MethodId> events{};
  std::uint16_t port = 0;  ///< UDP, to receive at; 0: one that all subscriptions of the node share
};

/// Received messages and datagrams that a Node dropped, by reason.
struct NodeCounters {
  std::uint64_t datagrams = 0;           ///< received, SD left out
  std::uint64_t events = 0;              ///< delivered to a subscription
  std::uint64_t malformed = 0;           ///< datagrams that are empty, or bad from some message on
  std::uint64_t overflowed = 0;          ///< datagrams that the system dropped as a receive buffer was full
  std::uint64_t wrong_version = 0;       ///< another interface or protocol version than was subscribed to
  std::uint64_t unexpected = 0;          ///< neither a subscribed event nor a request
  std::uint64_t unknown_sender = 0;      ///< a subscribed event from an endpoint that does not offer it
  std::uint64_t requests_answered = 0;   ///< with an error: nothing is there to be called
  std::uint64_t discovery_not_sent = 0;  ///< SD datagrams that the system would not take
};

/// Names one call of Node::subscribe().
enum class SubscriptionId : std::uint32_t {};

/// Told what discovery did, in words: one line without a line end.
using DiscoveryLog = std::function<void(const std::string& line)>;

/// Offers services with events and subscribes to those of others: SD and the sockets of one address of this
/// host. Not thread-safe: use it on the thread that runs the io_context.
class Node {
 public:
  using EventHandler = std::function<void(const someip::Message& message, const Endpoint& from)>;

  /// Opens SD's sockets and starts.
  /// @throws someip::NetError when they cannot be opened; above all when another SOME/IP stack has the port.
  Node(boost::asio::io_context& io, const NodeConfig& config, DiscoveryLog log = {});
  ~Node();
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  /// Opens the service's port and offers it.
  /// @throws someip::NetError when the port cannot be opened; std::invalid_argument when discovery refuses
  /// the
  ///         service: what() says why.
  OfferHandle offer(const ServiceSpec& spec);
  void withdraw(OfferHandle offer);
  /// How many subscribers get this event.
  [[nodiscard]] std::size_t subscribers(OfferHandle offer, someip::MethodId event) const;

  struct Notified {
    someip::SessionId session{};  ///< of the message that was sent
    std::size_t subscribers = 0;  ///< that it was sent to, or queued for
    std::size_t dropped = 0;      ///< subscribers that did not get it, as the sender's counters tell
  };
  /// Sends an event to all its subscribers. `payload` and `keep_alive` as in MessageSender::send().
  Notified notify(OfferHandle offer, someip::MethodId event, std::span<const ByteView> payload,
                  std::shared_ptr<const void> keep_alive = nullptr, const someip::TpPacing& pacing = {});

  /// Finds the service, subscribes whenever it is offered, and hands its events to `handler`. Several calls
  /// for one eventgroup and port share one subscription on the wire.
  /// @throws as offer().
  SubscriptionId subscribe(const SubscribeSpec& spec, EventHandler handler);
  /// The handler is not called any more. May be called by a handler.
  void unsubscribe(SubscriptionId subscription);
  /// Whether the eventgroup is subscribed to now: the server has acknowledged it.
  [[nodiscard]] bool subscribed(SubscriptionId subscription) const;

  /// Withdraws all offers and subscriptions: the messages that say so have been sent when it returns. The
  /// Node does nothing afterwards.
  /// Events that still wait to be sent are dropped and counted.
  void shutdown();

  [[nodiscard]] NodeCounters counters() const;
  [[nodiscard]] const Counters& discovery_counters() const noexcept;
  [[nodiscard]] const someip::TpCounters& reassembly_counters() const noexcept;
  [[nodiscard]] someip::MessageSender::Counters sender_counters() const;
  /// The smallest receive buffer that the system granted to one of its sockets, in bytes.
  [[nodiscard]] int receive_buffer_bytes() const;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace trestle::sd
