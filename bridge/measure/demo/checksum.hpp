#pragma once
#include <cstdint>

#include "bridge/measure/point_cloud.hpp"

/// The demo must know of each cloud whether it is still what was sent, on the far side of two bridges that
/// carry nothing but the message. So both ends tell the checksum of what they have sent and received, by its
/// stamp.
namespace trestle::measure::demo {

/// XXH64 of `bytes`: any changed byte shows, at several gigabytes a second.
[[nodiscard]] std::uint64_t xxh64(ByteView bytes, std::uint64_t seed = 0) noexcept;

/// Over all that a cloud says, its stamp and frame too.
[[nodiscard]] std::uint64_t checksum(const EncodedCloud& cloud) noexcept;

/// Of a cloud that was received: over what it would be if it were written here. So padding and the byte order
/// of the message do not count.
/// @param cloud  whose points are little-endian.
[[nodiscard]] std::uint64_t checksum(const CloudView& cloud);

}  // namespace trestle::measure::demo
