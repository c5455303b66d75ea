#pragma once
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "bridge/measure/point_cloud.hpp"

namespace trestle::measure::demo {

/// The most that the points of a file may take.
inline constexpr std::size_t max_pcd_bytes = std::size_t{64} << 20U;

/// Reads a point cloud in the Point Cloud Library's PCD format, version 0.6 or 0.7, with data as ascii,
/// binary or binary_compressed. Points are laid out as the file says; padding (fields named "_") is kept, but
/// not listed. The cloud counts as dense when no number in it is a NaN.
/// @param name  the file's name for messages.
/// @return what is wrong: "name:7: ..." for a line, "name: byte 123: ..." in binary data.
[[nodiscard]] tl::expected<Cloud, std::string> parse_pcd(std::string_view text, const std::string& name);

/// As above, from a file; one that can't be read is an error too.
[[nodiscard]] tl::expected<Cloud, std::string> load_pcd(const std::string& file);

/// Expands LZF-compressed bytes, as PCD files have them, into exactly the whole of `to`.
/// @return false when they are damaged, or more or fewer bytes come out.
[[nodiscard]] bool expand_lzf(ByteView from, ByteSpan to) noexcept;

}  // namespace trestle::measure::demo
