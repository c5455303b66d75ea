#include "bridge/carry/runtime/someip_side.hpp"

#include <utility>

namespace trestle::carry {
namespace {

class ProxyClient final : public SomeipClient {
 public:
  ProxyClient(sd::Node& node, const sd::RequireSpec& spec, sd::AvailabilityHandler handler)
      : proxy_{node, spec, std::move(handler)} {}

  [[nodiscard]] std::vector<sd::RemoteService> available() const override { return proxy_.available(); }
  void call(const sd::CallSpec& spec, std::vector<std::byte> payload, std::weak_ptr<CallEnds> ends,
            Caller caller) override {
    proxy_.call(spec, std::move(payload),
                [ends = std::move(ends), caller = std::move(caller)](boost::system::error_code error,
                                                                     const sd::Response& response) {
                  if (const auto told = ends.lock()) {
                    told->on_response(caller, error, response);
                  }
                });
  }
  [[nodiscard]] bool send(const sd::CallSpec& spec, ByteView payload) override {
    return proxy_.send(spec, payload);
  }

 private:
  sd::Proxy proxy_;
};

class NodeSide final : public SomeipSide {
 public:
  explicit NodeSide(sd::Node& node) : node_{node} {}

  sd::OfferHandle offer(const sd::ServiceSpec& spec) override { return node_.offer(spec); }
  void withdraw(sd::OfferHandle offer) override { node_.withdraw(offer); }
  std::shared_ptr<const void> hold_port(std::uint16_t number, Transport transport) override {
    return node_.hold_port(number, transport);
  }
  std::size_t subscribers(sd::OfferHandle offer, someip::MethodId event) const override {
    return node_.subscribers(offer, event);
  }
  sd::Notified notify(sd::OfferHandle offer, someip::MethodId event, std::span<const ByteView> payload,
                      const std::shared_ptr<const void>& keep_alive,
                      const someip::TpPacing& pacing) override {
    return node_.notify(offer, event, payload, keep_alive, pacing);
  }
  void when_room(sd::OfferHandle offer, someip::MethodId event, std::size_t bytes,
                 std::function<void()> told) override {
    node_.when_room(offer, event, bytes, std::move(told));
  }
  sd::Notified set_field(sd::OfferHandle offer, someip::MethodId field,
                         std::shared_ptr<const std::vector<std::byte>> value) override {
    return node_.set_field(offer, field, std::move(value));
  }
  std::shared_ptr<const std::vector<std::byte>> field(sd::OfferHandle offer,
                                                      someip::MethodId field) const override {
    return node_.field(offer, field);
  }
  void forget_field(sd::OfferHandle offer, someip::MethodId field) override {
    node_.forget_field(offer, field);
  }
  sd::RequirementId require(const sd::RequireSpec& spec, sd::AvailabilityHandler handler) override {
    return node_.require(spec, std::move(handler));
  }
  std::vector<sd::RemoteService> available(sd::RequirementId requirement) const override {
    return node_.available(requirement);
  }
  bool is_offered_by_others(someip::ServiceId service) const override {
    return node_.is_offered_by_others(service);
  }
  std::unique_ptr<SomeipClient> client(const sd::RequireSpec& spec,
                                       sd::AvailabilityHandler handler) override {
    return std::make_unique<ProxyClient>(node_, spec, std::move(handler));
  }
  sd::SubscriptionId subscribe(const sd::SubscribeSpec& spec, sd::EventHandler handler) override {
    return node_.subscribe(spec, std::move(handler));
  }
  void unsubscribe(sd::SubscriptionId subscription) override { node_.unsubscribe(subscription); }
  bool subscribed(sd::SubscriptionId subscription) const override { return node_.subscribed(subscription); }
  sd::SubscriptionFaults subscription_faults(sd::SubscriptionId subscription) const override {
    return node_.subscription_faults(subscription);
  }
  sd::OtherEvents other_events(sd::SubscriptionId subscription) const override {
    return node_.other_events(subscription);
  }

 private:
  sd::Node& node_;
};

}  // namespace

std::unique_ptr<SomeipSide> someip_side_of(sd::Node& node) {
  return std::make_unique<NodeSide>(node);
}

}  // namespace trestle::carry
