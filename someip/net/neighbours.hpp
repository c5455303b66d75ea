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

  /// Whether the host has answered to its address, by ARP or neighbour discovery. False if nobody can tell:
  /// behind routers, on loopback; over IPv6 also where the system does not tell of a single host (Linux
  /// before 5.0).
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
  [[nodiscard]] bool is_on_link(const IpAddress& host) const noexcept;
  [[nodiscard]] Answer looked_up(const IpAddress& host) const noexcept;
  [[nodiscard]] Answer looked_up_v4(const IpAddress& host) const noexcept;
  [[nodiscard]] Answer looked_up_v6(const IpAddress& host) const noexcept;

  IpAddress own_;
  std::string interface_;
  IpAddress mask_;                      ///< of the subnet; all zero: nobody is asked for link addresses
  Descriptor socket_;                   ///< for ioctl(), over IPv6 of rtnetlink
  mutable unsigned index_ = 0;          ///< of the interface, over IPv6
  mutable std::uint32_t question_ = 0;  ///< number of the last one to rtnetlink
};

}  // namespace trestle::someip
