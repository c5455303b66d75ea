#pragma once
#include <optional>

#include "net/ip_stack.hpp"

namespace trestle::net {

/// The SMSC LAN9118 Ethernet controller and its kin (LAN9220 on Arm's MPS2 boards), by polling.
class Lan9118 {
 public:
  /// @param base  where its registers are mapped, on a bus of 32 bits.
  explicit Lan9118(std::uintptr_t base) noexcept : base_{base} {}

  /// Resets the controller and sets its MAC; then it sends and receives.
  /// @return false when it does not answer, or not as one of these.
  [[nodiscard]] bool start(const Mac& mac) noexcept;

  /// The next received frame, without its checksum, or nothing. Those with errors, and those that do not fit,
  /// are dropped and counted.
  [[nodiscard]] std::optional<ByteView> receive(ByteSpan room) noexcept;

  /// @return false when the controller has no room; the frame is dropped and counted.
  bool send(ByteView frame) noexcept;

  [[nodiscard]] std::uint32_t receive_errors() const noexcept { return receive_errors_; }
  [[nodiscard]] std::uint32_t send_errors() const noexcept { return send_errors_; }

 private:
  [[nodiscard]] std::uint32_t read(std::uint32_t offset) const noexcept;
  void write(std::uint32_t offset, std::uint32_t value) const noexcept;
  bool write_mac_register(std::uint32_t index, std::uint32_t value) const noexcept;

  std::uintptr_t base_;
  std::uint32_t receive_errors_ = 0;
  std::uint32_t send_errors_ = 0;
};

}  // namespace trestle::net
