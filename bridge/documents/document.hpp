#pragma once
#include <yaml-cpp/yaml.h>

#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "bridge/documents/problems.hpp"

/// YAML files of ours, the configuration and the lock file: what is before their meaning.
namespace trestle::documents {

/// The text of a file, of which at most one byte more than a document may have is read; or why it cannot be
/// read.
[[nodiscard]] tl::expected<std::string, std::string> read_text_file(const std::string& file);

/// The one document of a file, of up to 1 MiB; an undefined node after telling what is wrong, or an empty
/// one.
/// @param expected  what an empty file should have.
[[nodiscard]] YAML::Node parse_document(const std::string& text, const std::string& expected,
                                        Problems& problems);

/// Tells what is wrong with a text that is no YAML: of a bracket that is never closed, where it was opened.
void tell_of_bad_yaml(const YAML::Exception& error, std::string_view text, Problems& problems);

}  // namespace trestle::documents
