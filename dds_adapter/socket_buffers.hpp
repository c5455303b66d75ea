#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace trestle::dds::detail {

/// What the system does not grant a UDP socket that asks for a buffer of this size as Fast DDS does, which
/// never goes beyond the system's limits: a line in words. 0: it does not ask.
[[nodiscard]] std::optional<std::string> receive_buffer_not_granted(std::uint32_t bytes);
[[nodiscard]] std::optional<std::string> send_buffer_not_granted(std::uint32_t bytes);
/// How large a sample has to be to need a larger send buffer than is granted; nothing: all is granted.
[[nodiscard]] std::optional<std::size_t> needs_larger_send_buffer(std::uint32_t bytes) noexcept;

/// Asks for a receive buffer, beyond the system's limit where the process may.
void set_receive_buffer(int socket, std::uint32_t bytes) noexcept;
/// What it gets so of these bytes.
[[nodiscard]] std::uint32_t granted_receive_buffer(std::uint32_t bytes) noexcept;

}  // namespace trestle::dds::detail
