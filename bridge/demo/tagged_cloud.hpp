#pragma once
#include <cstdint>
#include <string>
#include <tl/expected.hpp>

#include "bridge/demo/point_cloud.hpp"

/// The demo must know of each cloud which one it is and whether it is still what was sent, on the far side of
/// two bridges that carry nothing but the message. So both stand in the message, as text in
/// `header.frame_id`: "lidar/000123/89abcdef01234567" (sequence number, checksum).
namespace trestle::bridge::demo {

/// XXH64 of `bytes`: any changed byte shows, at several gigabytes a second.
[[nodiscard]] std::uint64_t xxh64(ByteView bytes, std::uint64_t seed = 0) noexcept;

/// Serialises a cloud with its tag. The checksum is over the whole message as it would be without the
/// checksum.
[[nodiscard]] EncodedCloud encode_tagged(const Cloud& cloud, std::uint64_t sequence, std::int64_t stamp_ns);

/// What the tag of a received cloud says, and whether the cloud is what was sent.
struct Tagged {
  std::uint64_t sequence = 0;
  std::int64_t stamp_ns = 0;
  bool intact = false;
  std::string reason;  ///< of not being intact, in words
};

/// Reads a message that encode_tagged() has made.
/// @return what is wrong, in words, when not even the tag can be read.
[[nodiscard]] tl::expected<Tagged, std::string> check_tagged(ByteView cdr);

}  // namespace trestle::bridge::demo
