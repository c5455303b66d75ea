#pragma once
#include <cstddef>
#include <string>

#include "bridge/console/shown_message.hpp"

namespace trestle::console {

/// More points than these are not sent: then every second, third and so on is.
inline constexpr std::size_t most_points = 200'000;
/// Pictures of more are made smaller.
inline constexpr std::size_t most_pixels = 1'000'000;
/// Compressed pictures of more are not sent.
inline constexpr std::size_t most_compressed_bytes = std::size_t{8} << 20U;
/// Transforms of one message.
inline constexpr std::size_t most_transforms = 500;

/// Whether there is more to see of messages of this type than values.
[[nodiscard]] bool is_sight(std::string_view type);

/// What there is to see of a message, for the page: four bytes, little-endian, with the size of the JSON
/// that follows, spaces behind it until the size is a multiple of four, and then bytes. The JSON has "route",
/// "at_ns", "size" of the message, "frame" where it has one, and as "kind":
///
/// "cloud"       sensor_msgs/msg/PointCloud2: "points", "sent" of these, "not_finite", "every" (of how many
///               one was taken), "value" (the name of the field beside x, y, z; or ""). Bytes: four floats a
///               point: x, y, z and the value, or z
/// "image"       sensor_msgs/msg/Image: "width", "height", "encoding", "sent_width", "sent_height".
///               Bytes: red, green, blue, alpha
/// "compressed"  sensor_msgs/msg/CompressedImage: "format", "mime". Bytes: a JPEG or PNG file
/// "fix"         sensor_msgs/msg/NavSatFix: "latitude", "longitude", "altitude", "status"
/// "frames"      tf2_msgs/msg/TFMessage: "transforms" of "parent", "child", "translation", "rotation"
/// "none"        "why" there is nothing to see
///
/// @param shown  has a message of a type that is_sight().
[[nodiscard]] std::string sight(const ShownMessage& shown);

}  // namespace trestle::console
