#include "net/lan9118.hpp"

#include <cstring>

#include <trestle/someip/wire/bytes.hpp>

namespace trestle::net {
namespace {

// Registers, from the LAN9118 data sheet, chapter 5.
constexpr std::uint32_t rx_data = 0x00;
constexpr std::uint32_t tx_data = 0x20;
constexpr std::uint32_t rx_status = 0x40;
constexpr std::uint32_t tx_status = 0x48;
constexpr std::uint32_t interrupt_status = 0x58;
constexpr std::uint32_t interrupt_enable = 0x5c;
constexpr std::uint32_t byte_test = 0x64;
constexpr std::uint32_t rx_config = 0x6c;
constexpr std::uint32_t tx_config = 0x70;
constexpr std::uint32_t hardware_config = 0x74;
constexpr std::uint32_t rx_control = 0x78;
constexpr std::uint32_t rx_fifo = 0x7c;
constexpr std::uint32_t tx_fifo = 0x80;
constexpr std::uint32_t mac_command = 0xa4;
constexpr std::uint32_t mac_data = 0xa8;

// Registers of the MAC, behind mac_command and mac_data.
constexpr std::uint32_t mac_control = 1;
constexpr std::uint32_t mac_address_high = 2;
constexpr std::uint32_t mac_address_low = 3;

constexpr std::uint32_t busy = 1U << 31U;             // mac_command, rx_control
constexpr std::uint32_t soft_reset = 1U;              // hardware_config
constexpr std::uint32_t must_be_one = 1U << 20U;      // hardware_config
constexpr std::uint32_t tx_fifo_5_kb = 5U << 16U;     // hardware_config; the rest, 10560 bytes, receives
constexpr std::uint32_t dump = 3U << 14U;             // tx_config: data and status
constexpr std::uint32_t rx_dump = 1U << 15U;          // rx_config
constexpr std::uint32_t transmitter_on = 1U << 1U;    // tx_config
constexpr std::uint32_t fast_forward = 1U << 31U;     // rx_control: skip the rest of a frame
constexpr std::uint32_t rx_error = 1U << 15U;         // rx_status
constexpr std::uint32_t rx_runt = 1U << 11U;          // rx_status
constexpr std::uint32_t full_duplex = 1U << 20U;      // mac_control
constexpr std::uint32_t pass_all_groups = 1U << 19U;  // mac_control: IpStack chooses
constexpr std::uint32_t mac_transmitter = 1U << 3U;   // mac_control
constexpr std::uint32_t mac_receiver = 1U << 2U;      // mac_control
constexpr std::uint32_t whole_frame = 3U << 12U;      // command A: the first and the last segment of a frame
constexpr std::size_t frame_checksum = 4;
constexpr int patience = 1'000'000;  // reads of a register before the controller counts as dead

}  // namespace

// NOLINTBEGIN(performance-no-int-to-ptr): registers stand where the hardware has them
std::uint32_t Lan9118::read(std::uint32_t offset) const noexcept {
  return *reinterpret_cast<volatile const std::uint32_t*>(base_ + offset);
}

void Lan9118::write(std::uint32_t offset, std::uint32_t value) const noexcept {
  *reinterpret_cast<volatile std::uint32_t*>(base_ + offset) = value;
}
// NOLINTEND(performance-no-int-to-ptr)

bool Lan9118::write_mac_register(std::uint32_t index, std::uint32_t value) const noexcept {
  write(mac_data, value);
  write(mac_command, busy | index);
  for (int i = 0; i < patience; ++i) {
    if ((read(mac_command) & busy) == 0) {
      return true;
    }
  }
  return false;
}

bool Lan9118::start(const Mac& mac) noexcept {
  if (read(byte_test) != 0x8765'4321) {
    return false;
  }
  write(hardware_config, soft_reset);
  for (int i = 0; (read(hardware_config) & soft_reset) != 0; ++i) {
    if (i == patience) {
      return false;
    }
  }
  write(hardware_config, must_be_one | tx_fifo_5_kb);
  write(interrupt_enable, 0);
  write(interrupt_status, ~0U);
  write(tx_config, dump);
  write(rx_config, rx_dump);
  const std::uint32_t low = static_cast<std::uint32_t>(mac[0]) | static_cast<std::uint32_t>(mac[1]) << 8U |
                            static_cast<std::uint32_t>(mac[2]) << 16U |
                            static_cast<std::uint32_t>(mac[3]) << 24U;
  const std::uint32_t high = static_cast<std::uint32_t>(mac[4]) | static_cast<std::uint32_t>(mac[5]) << 8U;
  if (!write_mac_register(mac_address_low, low) || !write_mac_register(mac_address_high, high) ||
      !write_mac_register(mac_control, full_duplex | pass_all_groups | mac_transmitter | mac_receiver)) {
    return false;
  }
  write(tx_config, transmitter_on);
  return true;
}

std::optional<ByteView> Lan9118::receive(ByteSpan room) noexcept {
  while ((read(rx_fifo) >> 16U & 0xffU) != 0) {  // the number of frames with a status
    const std::uint32_t status = read(rx_status);
    const std::size_t size = status >> 16U & 0x3fffU;  // with the frame's checksum
    const std::size_t words = (size + 3) / 4;
    if ((status & (rx_error | rx_runt)) != 0 || size <= frame_checksum || words * 4 > room.size()) {
      ++receive_errors_;
      if (words >= 4) {  // fast forward is for no less
        write(rx_control, fast_forward);
        for (int i = 0; i < patience && (read(rx_control) & busy) != 0; ++i) {
        }
      } else {
        for (std::size_t i = 0; i < words; ++i) {
          static_cast<void>(read(rx_data));
        }
      }
      continue;
    }
    for (std::size_t i = 0; i < words; ++i) {
      someip::store(room.data() + 4 * i, read(rx_data), std::endian::little);
    }
    return room.first(size - frame_checksum);
  }
  return std::nullopt;
}

bool Lan9118::send(ByteView frame) noexcept {
  // The status of each sent frame takes room until it is read.
  while ((read(tx_fifo) >> 16U & 0xffU) != 0) {
    if ((read(tx_status) & 1U << 15U) != 0) {
      ++send_errors_;
    }
  }
  const std::size_t words = (frame.size() + 3) / 4;
  if ((read(tx_fifo) & 0xffffU) < 4 * (words + 2)) {
    ++send_errors_;
    return false;
  }
  const auto size = static_cast<std::uint32_t>(frame.size());
  write(tx_data, whole_frame | size);
  write(tx_data, size);
  for (std::size_t at = 0; at < frame.size(); at += 4) {
    std::array<std::byte, 4> word{};
    std::memcpy(word.data(), frame.data() + at, std::min(word.size(), frame.size() - at));
    write(tx_data, someip::load<std::uint32_t>(word.data(), std::endian::little));
  }
  return true;
}

}  // namespace trestle::net
