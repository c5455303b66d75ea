#pragma once
#include <yaml-cpp/yaml.h>

#include <cstddef>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "bridge/documents/problems.hpp"

/// Reads the project's YAML files, the configuration and the lock file, and knows nothing of their meaning.
namespace trestle::documents {

/// Far more than any hand-written configuration: a larger file is not a configuration.
inline constexpr std::size_t document_bytes_max = std::size_t{1} << 20U;

/// The text of a file, or why it cannot be read.
/// @param bytes_max  at most one byte more is read, which is enough to know: /dev/zero has no end.
[[nodiscard]] tl::expected<std::string, std::string> read_text_file(
    const std::string& file, std::size_t bytes_max = document_bytes_max);

/// The only document of a file of up to document_bytes_max. Undefined, and reported, if there is an error or
/// the file is empty.
/// @param expected  what an empty file should have.
[[nodiscard]] YAML::Node parse_document(const std::string& text, const std::string& expected,
                                        Problems& problems);

/// Reports why a text is not YAML. For a bracket that is never closed, it says where it was opened.
void tell_of_bad_yaml(const YAML::Exception& error, std::string_view text, Problems& problems);

}  // namespace trestle::documents
