#include "bridge/traffic/live/listener.hpp"

#include <array>

#include "sd/net/clock.hpp"
#include "sd/wire/writer.hpp"

namespace trestle::traffic {

Listener::Listener(boost::asio::io_context& io, const sd::NodeConfig& network, Handler handler)
    : io_{io},
      network_{network},
      handler_{std::move(handler)},
      multicast_{io,
                 {.local = {network.multicast, network.port},
                  .join = network.multicast,
                  .interface = {{network.address, network.multicast_interface}},
                  .sharing = someip::PortSharing::shared}} {
  multicast_.receive([this](ByteView datagram, const Endpoint& from) {
    on_datagram(datagram, from, {network_.multicast, network_.port});
  });
}

bool Listener::open_for_finding() {
  try {
    unicast_.emplace(io_, someip::UdpOptions{.local = {network_.address, network_.port},
                                             .interface = {{network_.address, network_.multicast_interface}},
                                             .sharing = someip::PortSharing::by_address});
  } catch (const someip::NetError&) {
    return false;
  }
  unicast_->receive(
      [this](ByteView datagram, const Endpoint& from) { on_datagram(datagram, from, unicast_->local()); });
  return true;
}

void Listener::find(someip::ServiceId service, someip::InstanceId instance) {
  std::array<std::byte, 256> room{};
  sd::SdWriter writer{room};
  const bool fits = writer.add({.type = sd::EntryType::find_service,
                                .service = service,
                                .instance = instance,
                                .major = sd::any_major,
                                .ttl_s = 3,
                                .tail = sd::any_minor},
                               {});
  if (fits && unicast_) {
    // Each run of the program begins at session 1 with the reboot flag.  [feat_req_someipsd_41]
    const ByteView message = writer.finish(sd::reboot_flag | sd::unicast_flag, someip::SessionId{++session_});
    unicast_->send({network_.multicast, network_.port}, {&message, 1});
  }
}

void Listener::on_datagram(ByteView datagram, const Endpoint& from, const Endpoint& to) {
  if (unicast_ && from == unicast_->local()) {
    return;  // our own FindService
  }
  handler_(datagram, from, to);
}

}  // namespace trestle::traffic
