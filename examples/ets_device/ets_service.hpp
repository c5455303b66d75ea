#pragma once
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <trestle/sd/net/handles.hpp>

#include "ets_client.hpp"

namespace ets {

/// Where the device is on its network.
struct Places {
  trestle::IpAddress address;
  trestle::IpAddress event_group;  ///< multicast, for events
  std::uint16_t port = 30501;  ///< UDP and TCP of the service; the next one is that of its second instance
};

constexpr ServiceId service{0x0101};         // as the specification reserves it
constexpr ServiceId second_service{0x0102};  // shares the ports of the first
constexpr ServiceId old_and_new{0x0103};     // in two major versions

/// The Enhanced Testability Service: methods that echo what they get, fields, and events that can be
/// triggered, so that a tester can look at a SOME/IP stack from outside.
class Service {
 public:
  /// @param client  what it drives.
  Service(boost::asio::io_context& io, sd::Node& node, const Places& places, Client& client);

 private:
  struct Trigger;

  void offer();
  void suspend();
  [[nodiscard]] sd::ServiceSpec description();
  void add_methods(sd::ServiceSpec& spec);
  void add_echoes(sd::ServiceSpec& spec);
  void add_fields(sd::ServiceSpec& spec) const;
  static void add_protected(sd::ServiceSpec& spec);
  void trigger(const Message& request, MethodId event, std::vector<std::byte> payload);
  void fire(const std::shared_ptr<Trigger>& trigger);

  boost::asio::io_context& io_;
  sd::Node& node_;
  Places places_;
  Client& client_;
  std::optional<sd::Offer> offer_;
  boost::asio::steady_timer resume_;
};

/// Each with one echo: the same service once more, as instance 2; the second service, whose offer says more
/// than those of the others; and a service in two major versions.
[[nodiscard]] std::vector<sd::ServiceSpec> companions(const Places& places);

}  // namespace ets
