#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/documents/problem.hpp"

namespace trestle::describe {

/// In a folder that `trestle generate` has written to: the files that it wrote. So that what comes out of
/// sources does not go in again, folders are read without these, unless they have nothing else.
inline constexpr std::string_view generated_list_name = "generated.lock";

struct GeneratedFile {
  std::string path;      ///< from the folder of the list
  std::string sha256{};  ///< of what was written; empty in lists that say only names
  /// Target and sources, "msg ../Door.fidl": what is made anew of these, and is not this file, takes its
  /// place. Empty in lists that do not tell.
  std::string origin{};
};

/// The text of such a list, sorted, in a form that `sha256sum --check` takes.
[[nodiscard]] std::string generated_list(std::vector<GeneratedFile> files);
/// The files in such a text, of which those that lead out of the folder are left out.
/// @param file      its name.
/// @param problems  gets where the marks of a merge are that nobody has finished. Then no file is told.
[[nodiscard]] std::vector<GeneratedFile> read_generated_list(const std::string& file, std::string_view text,
                                                             std::vector<documents::Problem>& problems);
/// The same of the list in a folder. Where there is none, there are no files.
/// @param problems  gets why it cannot be read, too.
[[nodiscard]] std::vector<GeneratedFile> load_generated_list(const std::filesystem::path& folder,
                                                             std::vector<documents::Problem>& problems);

}  // namespace trestle::describe
