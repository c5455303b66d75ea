#include "dds_adapter/polled_udp.hpp"

#include <cstring>
#include <utility>

namespace trestle::dds::detail {
namespace {

struct PolledDescriptor final : fast::ForwardingDescriptor {
  PolledDescriptor(std::shared_ptr<SampleSockets> where, const std::shared_ptr<fast::UdpV4Descriptor>& of)
      : fast::ForwardingDescriptor{of}, sockets{std::move(where)}, udp{of} {}

  [[nodiscard]] fast::Transport* create_transport() const override;

  std::shared_ptr<SampleSockets> sockets;
  std::shared_ptr<fast::UdpV4Descriptor> udp;
};

class PolledUdp final : public fast::ForwardingTransport {
 public:
  explicit PolledUdp(const PolledDescriptor& descriptor)
      : fast::ForwardingTransport{descriptor}, sockets_{descriptor.sockets}, udp_{descriptor.udp} {}

  /// Called for the locators of readers and writers, before any of them is opened.
  bool getDefaultUnicastLocators(fast::LocatorList& locators, std::uint32_t port) const override {
    first_port_ = port;
    return low_level_transport_->getDefaultUnicastLocators(locators, port);
  }

  bool OpenInputChannel(const fast::Locator& locator, fast::TransportReceiver* receiver,
                        std::uint32_t max_bytes) override {
    if (!is_for_samples(locator)) {
      return ForwardingTransport::OpenInputChannel(locator, receiver, max_bytes);
    }
    const auto take = [receiver, locator](std::span<const std::byte> datagram, const sockaddr_in& from) {
      fast::Locator remote{locator.kind, ntohs(from.sin_port)};
      std::memcpy(&remote.address[sizeof remote.address - sizeof from.sin_addr], &from.sin_addr,
                  sizeof from.sin_addr);
      receiver->OnDataReceived(reinterpret_cast<const fast::rtps::octet*>(datagram.data()),
                               static_cast<std::uint32_t>(datagram.size()), locator, remote);
    };
    return sockets_->open(port_of(locator), udp_->interfaceWhiteList, udp_->receiveBufferSize, take);
  }

  bool IsInputChannelOpen(const fast::Locator& locator) const override {
    return is_for_samples(locator) ? sockets_->is_open(port_of(locator))
                                   : low_level_transport_->IsInputChannelOpen(locator);
  }

  bool CloseInputChannel(const fast::Locator& locator) override {
    return is_for_samples(locator) ? sockets_->close(port_of(locator))
                                   : low_level_transport_->CloseInputChannel(locator);
  }

 private:
  static std::uint16_t port_of(const fast::Locator& locator) {
    return fast::rtps::IPLocator::getPhysicalPort(locator);
  }

  /// Before each of these ports is one for discovery; if a port is taken, the next but one is tried.
  [[nodiscard]] bool is_for_samples(const fast::Locator& locator) const {
    const std::uint32_t port = port_of(locator);
    return first_port_ != 0 && port >= first_port_ && (port - first_port_) % 2 == 0 &&
           !fast::rtps::IPLocator::isMulticast(locator);
  }

  const std::shared_ptr<SampleSockets> sockets_;
  const std::shared_ptr<fast::UdpV4Descriptor> udp_;
  mutable std::uint32_t first_port_ = 0;  ///< 0: none, because a profile has other locators
};

fast::Transport* PolledDescriptor::create_transport() const {
  return new PolledUdp{*this};
}

}  // namespace

std::shared_ptr<fast::TransportDescriptor> received_by(std::shared_ptr<SampleSockets> sockets,
                                                       std::shared_ptr<fast::UdpV4Descriptor> udp) {
  return std::make_shared<PolledDescriptor>(std::move(sockets), std::move(udp));
}

bool is_polled(const fast::TransportDescriptor& transport) {
  return dynamic_cast<const PolledDescriptor*>(&transport) != nullptr;
}

const fast::UdpDescriptor* udp_of(const fast::TransportDescriptor& transport) {
  const auto* polled = dynamic_cast<const PolledDescriptor*>(&transport);
  return polled != nullptr ? polled->udp.get() : dynamic_cast<const fast::UdpDescriptor*>(&transport);
}

}  // namespace trestle::dds::detail
