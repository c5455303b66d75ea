#pragma once
#include <cstdint>

#include "bridge/measure/point_cloud.hpp"

/// The demo must know whether each cloud arrives unchanged behind two bridges, which carry nothing but the
/// message. So both ends report the checksum of each cloud, by its stamp.
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
