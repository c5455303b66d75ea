#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

namespace trestle::documents {

/// What a file that was replaced outlives, as the old one or the new one and no half of one.
enum class Outlives : std::uint8_t {
  the_program,      ///< killed, say
  a_power_failure,  ///< which takes the time of a disk
};

/// Replaces a file, or the file that a symbolic link of this name points to, by `text`: writes it beside that
/// file, and renames it. Readers see the old text or the new one, never a part. The file keeps its rights.
/// @return why not, with its name; then the file is as before. Also where something is there that is no file,
///         or another process is replacing it at this time.
[[nodiscard]] tl::expected<void, std::string> replace_file(const std::filesystem::path& file,
                                                           std::string_view text, Outlives what);

}  // namespace trestle::documents
