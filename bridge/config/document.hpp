#pragma once
#include <yaml-cpp/yaml.h>

#include <string>
#include <tl/expected.hpp>

#include "bridge/config/problems.hpp"

/// YAML files of ours, the configuration and the lock file: what is before their meaning.
namespace trestle::bridge {

/// The text of a file, of which at most one byte more than a document may have is read; or why it cannot be
/// read.
[[nodiscard]] tl::expected<std::string, std::string> read_text_file(const std::string& file);

/// The one document of a file, of up to 1 MiB; an undefined node after telling what is wrong, or an empty
/// one.
/// @param expected  what an empty file should have.
[[nodiscard]] YAML::Node parse_document(const std::string& text, const std::string& expected,
                                        Problems& problems);

}  // namespace trestle::bridge
