#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>

#include "someip/wire/types.hpp"

namespace trestle::pcaps {

/// Wall-clock time of a recording.
using Timestamp = std::chrono::sys_time<std::chrono::nanoseconds>;

/// What stands before the network layer of a frame.
enum class LinkType : std::uint8_t {
  ethernet,       ///< with any number of VLAN tags
  linux_sll,      ///< Linux "any" device, 16 byte header
  linux_sll2,     ///< the same, 20 byte header
  raw_ip,         ///< nothing: IPv4 or IPv6 at once
  null_loopback,  ///< BSD loopback: address family in either byte order
  wlan,           ///< 802.11: of data frames what is neither encrypted nor in pieces
  ppi,            ///< Per-Packet Information, then any other of these, as it says
  unsupported,
};

/// One recorded frame. `bytes` points into the reader's buffer.
struct Frame {
  std::uint64_t number = 0;  ///< from 1, as in Wireshark
  Timestamp time;
  LinkType link = LinkType::ethernet;
  ByteView bytes;
  std::size_t wire_bytes = 0;  ///< before the recorder cut it to its snap length; at least bytes.size()
};

}  // namespace trestle::pcaps
