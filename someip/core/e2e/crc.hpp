#pragma once
#include <cstdint>

#include "someip/wire/types.hpp"

/// The checksums of AUTOSAR's CRC library that the E2E profiles use.
///
/// `previous` is the result for the bytes before these, so that a message in several pieces is summed piece
/// by piece: crc32(b, crc32(a)) is the CRC of a and b. Its default starts a new sum with AUTOSAR's initial
/// value. All are table-driven; those of 32 and 64 bits take eight bytes a step, as they run over megabytes.
namespace trestle::someip::e2e {

/// CRC-8 SAE J1850: polynomial 0x1d, initial value and final XOR 0xff. Check value 0x4b.
[[nodiscard]] std::uint8_t crc8(ByteView bytes, std::uint8_t previous = 0) noexcept;

/// CRC-8 with polynomial 0x2f ("8H2F"), initial value and final XOR 0xff. Check value 0xdf.
[[nodiscard]] std::uint8_t crc8_h2f(ByteView bytes, std::uint8_t previous = 0) noexcept;

/// CRC-16 CCITT-FALSE: polynomial 0x1021, initial value 0xffff, no final XOR. Check value 0x29b1.
[[nodiscard]] std::uint16_t crc16(ByteView bytes, std::uint16_t previous = 0xffff) noexcept;

/// CRC-32 of Ethernet: polynomial 0x04c11db7 reflected, initial value and final XOR all ones. Check value
/// 0xcbf43926. No AUTOSAR profile uses it; vsomeip's "CRC32" protection does.
[[nodiscard]] std::uint32_t crc32(ByteView bytes, std::uint32_t previous = 0) noexcept;

/// CRC-32P4: polynomial 0xf4acfb13 reflected, initial value and final XOR all ones. Check value 0x1697d06a.
[[nodiscard]] std::uint32_t crc32_p4(ByteView bytes, std::uint32_t previous = 0) noexcept;

/// CRC-64 with the ECMA polynomial 0x42f0e1eba9ea3693 reflected, initial value and final XOR all ones (also
/// known as CRC-64/XZ). Check value 0x995dc9bbdf1939fa.
[[nodiscard]] std::uint64_t crc64(ByteView bytes, std::uint64_t previous = 0) noexcept;

}  // namespace trestle::someip::e2e
