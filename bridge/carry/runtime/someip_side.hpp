#pragma once
#include <boost/system/error_code.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bridge/carry/runtime/interface.hpp"
#include "dds_adapter/service.hpp"
#include "sd/net/proxy.hpp"
#include "sd/net/service_spec.hpp"
#include "someip/core/tp_pacing.hpp"

namespace trestle::carry {

/// The client for which a method is called. It travels with the call, which so needs no other memory.
struct Caller {
  dds::RequestId id{};              ///< of the ROS client's request
  std::vector<std::byte> wanted{};  ///< the value, of a setter that has no getter to ask
  std::string refusal{};            ///< of the call of a getter: why the value of the setter was refused
};

/// Told of the ends of calls.
class CallEnds {
 public:
  /// @param error, response  as of sd::Proxy::call().
  virtual void on_response(const Caller& caller, boost::system::error_code error,
                           const sd::Response& response) = 0;

 protected:
  ~CallEnds() = default;
};

/// A service of others, whose methods are called: sd::Proxy.
class SomeipClient : public Interface {
 public:
  [[nodiscard]] virtual std::vector<sd::RemoteService> available() const = 0;
  /// @param ends  told once, later, unless it is gone by then.
  virtual void call(const sd::CallSpec& spec, std::vector<std::byte> payload, std::weak_ptr<CallEnds> ends,
                    Caller caller) = 0;
  [[nodiscard]] virtual bool send(const sd::CallSpec& spec, ByteView payload) = 0;
};

/// What routes need from SOME/IP. All functions are like those of sd::Node; tests of routes have an
/// implementation without a network.
class SomeipSide : public Interface {
 public:
  // Services of ours.
  virtual sd::OfferHandle offer(const sd::ServiceSpec& spec) = 0;
  virtual void withdraw(sd::OfferHandle offer) = 0;
  [[nodiscard]] virtual std::shared_ptr<const void> hold_port(std::uint16_t number, Transport transport) = 0;
  [[nodiscard]] virtual std::size_t subscribers(sd::OfferHandle offer, someip::MethodId event) const = 0;
  virtual sd::Notified notify(sd::OfferHandle offer, someip::MethodId event,
                              std::span<const ByteView> payload,
                              const std::shared_ptr<const void>& keep_alive,
                              const someip::TpPacing& pacing) = 0;
  virtual void when_room(sd::OfferHandle offer, someip::MethodId event, std::size_t bytes,
                         std::function<void()> told) = 0;
  virtual sd::Notified set_field(sd::OfferHandle offer, someip::MethodId field,
                                 std::shared_ptr<const std::vector<std::byte>> value) = 0;
  [[nodiscard]] virtual std::shared_ptr<const std::vector<std::byte>> field(sd::OfferHandle offer,
                                                                            someip::MethodId field) const = 0;
  virtual void forget_field(sd::OfferHandle offer, someip::MethodId field) = 0;

  // Services of others.
  virtual sd::RequirementId require(const sd::RequireSpec& spec, sd::AvailabilityHandler handler) = 0;
  [[nodiscard]] virtual std::vector<sd::RemoteService> available(sd::RequirementId requirement) const = 0;
  [[nodiscard]] virtual bool is_offered_by_others(someip::ServiceId service) const = 0;
  [[nodiscard]] virtual std::unique_ptr<SomeipClient> client(const sd::RequireSpec& spec,
                                                             sd::AvailabilityHandler handler) = 0;
  virtual sd::SubscriptionId subscribe(const sd::SubscribeSpec& spec, sd::EventHandler handler) = 0;
  virtual void unsubscribe(sd::SubscriptionId subscription) = 0;
  [[nodiscard]] virtual bool subscribed(sd::SubscriptionId subscription) const = 0;
  [[nodiscard]] virtual sd::SubscriptionFaults subscription_faults(sd::SubscriptionId subscription) const = 0;
  [[nodiscard]] virtual sd::OtherEvents other_events(sd::SubscriptionId subscription) const = 0;
};

/// @param node  outlives the result.
[[nodiscard]] std::unique_ptr<SomeipSide> someip_side_of(sd::Node& node);

}  // namespace trestle::carry
