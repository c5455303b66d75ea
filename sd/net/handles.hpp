#pragma once
#include <utility>

#include "sd/net/node.hpp"
#include "sd/net/room.hpp"
#include "someip/net/parameters.hpp"

/// What an application holds of a Node: it ends when the object does. The Node must outlive it.
namespace trestle::sd {

/// A service that is offered for as long as this object lives.
class Offer {
 public:
  /// @throws as Node::offer().
  Offer(Node& node, ServiceSpec spec) : node_{&node}, handle_{node.offer(std::move(spec))} {}
  ~Offer() { withdraw(); }
  Offer(Offer&& other) noexcept : node_{std::exchange(other.node_, nullptr)}, handle_{other.handle_} {}
  Offer& operator=(Offer&& other) noexcept {
    Offer old{std::move(*this)};
    node_ = std::exchange(other.node_, nullptr);
    handle_ = other.handle_;
    return *this;
  }
  Offer(const Offer&) = delete;
  Offer& operator=(const Offer&) = delete;

  /// Sends an event to its subscribers, as its EventSpec says. Copies the payload; Node::notify() need not.
  Notified notify(someip::MethodId event, ByteView payload) const {
    return node_->notify(handle_, event, {&payload, 1});
  }
  /// Gives a field a value, and tells its subscribers if that is a new one.
  Notified set(someip::MethodId field, ByteView value) const {
    return node_->set_field(handle_, field, value);
  }
  /// Waits until there is room for an event of so many bytes, as Node::when_room(). May be called on any
  /// thread while the io_context runs, unlike all else here.
  /// @param token  what is to be done then, as everywhere in Asio: a function of an error_code, called later;
  ///               boost::asio::use_future, use_awaitable and so on. See RoomSignature.
  template <typename Token>
  auto room(someip::MethodId event, std::size_t bytes, Token&& token) const {
    return async_room(
        node_->io(),
        [node = node_, offer = handle_, event, bytes](std::function<void()> told) {
          node->when_room(offer, event, bytes, std::move(told));
        },
        std::forward<Token>(token));
  }
  /// For the other functions of Node.
  [[nodiscard]] OfferHandle handle() const noexcept { return handle_; }

 private:
  void withdraw() {
    if (node_ != nullptr) {
      node_->withdraw(handle_);
    }
  }

  Node* node_;  ///< none: moved from
  OfferHandle handle_;
};

/// Subscribed, whenever the service is there, for as long as this object lives.
class Subscription {
 public:
  /// @throws as Node::subscribe().
  Subscription(Node& node, const SubscribeSpec& spec, EventHandler handler)
      : node_{&node}, id_{node.subscribe(spec, std::move(handler))} {}
  ~Subscription() {
    if (node_ != nullptr) {
      node_->unsubscribe(id_);
    }
  }
  Subscription(Subscription&& other) noexcept : node_{std::exchange(other.node_, nullptr)}, id_{other.id_} {}
  Subscription& operator=(Subscription&& other) noexcept {
    Subscription old{std::move(*this)};
    node_ = std::exchange(other.node_, nullptr);
    id_ = other.id_;
    return *this;
  }
  Subscription(const Subscription&) = delete;
  Subscription& operator=(const Subscription&) = delete;

  /// Whether a server has acknowledged it now.
  [[nodiscard]] bool active() const { return node_->subscribed(id_); }

 private:
  Node* node_;  ///< none: moved from
  SubscriptionId id_;
};

/// A function of C++ values as the handler of a method; someip::typed() says which functions will do.
///
///     .methods = {{greet, answering([](const std::string& name) { return "Hello, " + name; })}}
template <typename Function>
[[nodiscard]] RequestHandler answering(Function function, const someip::PayloadRules& rules = {}) {
  return [function = someip::typed(std::move(function), rules)](const someip::Message& request,
                                                                Responder responder) {
    auto result = function(request.payload);
    if (result) {
      const auto payload = std::make_shared<const std::vector<std::byte>>(std::move(*result));
      const ByteView bytes{*payload};
      responder.respond({&bytes, 1}, payload);
    } else {
      responder.error(result.error());
    }
  };
}

}  // namespace trestle::sd
