#pragma once
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "someip/wire/endpoint.hpp"

namespace trestle::someip {

/// An Endpoint as the socket functions want it.
class SocketAddress {
 public:
  SocketAddress() noexcept = default;
  explicit SocketAddress(const Endpoint& endpoint, unsigned scope = 0) noexcept;

  void assign(const sockaddr& address) noexcept {
    size_ = address.sa_family == AF_INET6 ? sizeof(sockaddr_in6) : sizeof(sockaddr_in);
    std::memcpy(&storage_, &address, size_);
  }
  [[nodiscard]] Endpoint endpoint() const noexcept;
  [[nodiscard]] sockaddr* data() noexcept { return static_cast<sockaddr*>(static_cast<void*>(&storage_)); }
  [[nodiscard]] socklen_t size() const noexcept { return size_; }
  [[nodiscard]] socklen_t& size() noexcept { return size_; }

 private:
  sockaddr_storage storage_{};
  socklen_t size_ = sizeof(sockaddr_storage);
};

/// Index of the network interface that has this address; 0 when none has.
[[nodiscard]] unsigned interface_of(const IpAddress& address);

/// All addresses that interfaces of this host have; of loopback's, only those that are told.
[[nodiscard]] std::vector<IpAddress> own_addresses();

/// The address that the interface of this name has in the subnet of `peer`; nothing when there is none.
[[nodiscard]] std::optional<IpAddress> address_beside(const std::string& interface, const IpAddress& peer);

/// The mask of the subnet that this address of ours is in; all zero where hosts are not asked for their link
/// addresses (ARP, neighbour discovery).
[[nodiscard]] IpAddress mask_with_neighbours(const IpAddress& address);

/// Length of the prefix of the subnet that this host's `address` is in; nothing when the host has no such
/// address, or when it has no subnet: a prefix of the whole address, as of tunnels.
[[nodiscard]] std::optional<std::uint8_t> subnet_prefix_bits(const IpAddress& address);

/// Whether some UDP socket of this network namespace is bound to exactly this address and port.
[[nodiscard]] bool udp_endpoint_in_use(const Endpoint& endpoint);

}  // namespace trestle::someip
