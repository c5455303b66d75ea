#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace trestle::dds::detail {

/// What the system does not grant a UDP socket that asks for buffers of these sizes as Fast DDS does, which
/// never goes beyond the system's limits: a line for each, in words. 0: it does not ask.
[[nodiscard]] std::vector<std::string> buffers_not_granted(std::uint32_t receive_bytes,
                                                           std::uint32_t send_bytes);

/// Asks for a receive buffer, beyond the system's limit where the process may.
void set_receive_buffer(int socket, std::uint32_t bytes) noexcept;
/// What it gets so of these bytes.
[[nodiscard]] std::uint32_t granted_receive_buffer(std::uint32_t bytes) noexcept;

}  // namespace trestle::dds::detail
