#pragma once
#include <optional>

#include "bridge/conform/trial.hpp"

namespace trestle::conform {

/// A service that the tester offers, for a device that uses it. Nothing goes out that a case does not ask
/// for.
class OurService {
 public:
  /// @param with_tcp  it is offered over TCP, too.
  OurService(Trial& trial, const UsedService& used, bool with_tcp = false);

  [[nodiscard]] const UsedService& used() const { return used_; }
  [[nodiscard]] Endpoint udp() const { return t_.tester.local(udp_); }
  /// Where connections come in; only with TCP.
  [[nodiscard]] PortId listening() const { return *tcp_; }

  /// A right offer, for cases that spoil it.
  [[nodiscard]] SdStimulus offer_message(std::uint32_t ttl_s = 30) const;
  void offer(std::uint32_t ttl_s = 30) { t_.offer_ours(offer_message(ttl_s)); }
  void withdraw() { t_.withdraw(offer_message()); }
  /// The tester seems to have been restarted. The same session twice might be one datagram that came twice,
  /// so another offer goes out before.
  void reboot();
  /// At another UDP port from now on.
  void move();

  /// A Subscribe (not its end) of the service that came since then.
  [[nodiscard]] std::optional<SeenEntry> subscribe_since(std::size_t since, Duration within,
                                                         std::optional<someip::EventgroupId> group = {});
  /// Offers the service up to three times. Ends the case when the device does not subscribe.
  SeenEntry subscribed(std::optional<someip::EventgroupId> group = {}) {
    return subscribed_to(offer_message(), group);
  }
  SeenEntry subscribed_to(const SdStimulus& offer, std::optional<someip::EventgroupId> group = {});
  /// Acknowledges it, or refuses it.
  /// @param multicast  the group that the events go to.
  void answer(const SeenEntry& subscribe, bool good = true, std::optional<Endpoint> multicast = {});
  /// Acknowledges all eventgroups that the device subscribes to within the time.
  void acknowledge_all(std::size_t since, std::size_t count, std::optional<Endpoint> multicast = {});
  /// An event with one byte, to an endpoint over UDP.
  void notify(someip::MethodId event, std::uint8_t value, const Endpoint& to);
  /// The same on a TCP connection.
  void notify(someip::MethodId event, std::uint8_t value, PortId connection);

  /// FindService entries for it since then.
  [[nodiscard]] Trial::EntryIs is_find() const;

 private:
  [[nodiscard]] Trial::EntryIs is_subscribe(std::optional<someip::EventgroupId> group) const;
  [[nodiscard]] Bytes event_message(someip::MethodId event, std::uint8_t value);

  Trial& t_;
  const UsedService& used_;
  PortId udp_;
  std::optional<PortId> tcp_;
  std::uint16_t session_ = 0;
};

/// The first service that the device uses by itself, or when it is told to.
[[nodiscard]] const UsedService& used_service(Trial& t, bool by_ets);

}  // namespace trestle::conform
