#pragma once
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <optional>
#include <vector>

#include <trestle/sd/net/handles.hpp>

#include "ets/schedule.hpp"
#include "ets_client.hpp"

namespace ets {

/// Where the device is on its network.
struct Places {
  trestle::IpAddress address;
  trestle::IpAddress event_group;  ///< multicast, for events
  std::uint16_t port = 30501;  ///< UDP and TCP of the service; the next one is that of its second instance
};

/// The Enhanced Testability Service: methods that echo what they get, fields, and events that can be
/// triggered, so that a tester can look at a SOME/IP stack from outside.
class Service {
 public:
  /// @param client  what it drives.
  Service(boost::asio::io_context& io, sd::Node& node, const Places& places, Client& client);

 private:
  void offer();
  void suspend();
  [[nodiscard]] sd::ServiceSpec description();
  void add_methods(sd::ServiceSpec& spec);
  static void add_echoes(sd::ServiceSpec& spec);
  static void add_fields(sd::ServiceSpec& spec);
  void wait_for_event();

  sd::Node& node_;
  Places places_;
  Client& client_;
  std::optional<sd::Offer> offer_;
  boost::asio::steady_timer resume_;
  Schedule schedule_;
  boost::asio::steady_timer next_event_;
};

/// Each with one echo: the same service once more, as instance 2; the second service, whose offer says more
/// than those of the others, and which sends an event over TCP when it is triggered; and a service in two
/// major versions.
class Companions {
 public:
  Companions(sd::Node& node, const Places& places);

 private:
  [[nodiscard]] sd::ServiceSpec second(sd::ServiceSpec spec);

  std::optional<sd::Offer> second_;
  std::vector<sd::Offer> others_;
};

}  // namespace ets
