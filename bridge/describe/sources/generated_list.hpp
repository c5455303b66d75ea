#pragma once
#include <string>
#include <string_view>
#include <vector>

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
[[nodiscard]] std::vector<GeneratedFile> read_generated_list(std::string_view text);

}  // namespace trestle::describe
