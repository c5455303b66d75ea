#pragma once
#include <cstdint>

namespace trestle::console {

/// Bytes that the other end of a TCP connection has acknowledged, since it began (RFC 4898,
/// tcpEStatsAppHCThruOctetsAcked). 0 where the system does not tell.
[[nodiscard]] std::uint64_t acknowledged_bytes(int descriptor) noexcept;

}  // namespace trestle::console
