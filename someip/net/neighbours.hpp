#pragma once
#include <cstdint>
#include <string>

#include "someip/net/socket_calls.hpp"
#include "someip/wire/endpoint.hpp"

namespace trestle::someip {

/// The hosts that the system knows on the link. What is sent to them leaves at once, and does not wait in the
/// send buffer until somebody answers or, for seconds, nobody.
class Neighbours {
 public:
  /// @param own        an own address: the interface that has it, unless `interface` says otherwise.
  /// @param interface  its name, or empty.
  Neighbours(const IpAddress& own, std::string interface);

  /// Whether the host has answered by ARP. False if nobody can tell: behind routers, on loopback, over IPv6.
  [[nodiscard]] bool known(const IpAddress& host) const noexcept;
  enum class Answer : std::uint8_t {
    came,     ///< what is sent there leaves at once
    awaited,  ///< the system has asked; what is sent there waits
    unasked,  ///< the system has not asked for this host on this interface
    untold,   ///< nobody can tell: as for known(), and an own address
  };
  /// Whether the host has answered to its address.
  [[nodiscard]] Answer answer_of(const IpAddress& host) const noexcept;
  /// The same by one system call, where an own address is `unasked`, too.
  [[nodiscard]] Answer entry_of(const IpAddress& host) const noexcept;

 private:
  [[nodiscard]] Answer looked_up(const IpAddress& host) const noexcept;

  IpAddress own_;
  std::string interface_;
  std::uint32_t mask_ = 0;  ///< of the subnet, in network order; 0: there is no ARP
  Descriptor socket_;
};

}  // namespace trestle::someip
