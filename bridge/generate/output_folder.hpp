#pragma once
#include <filesystem>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "bridge/describe/sources/generated_list.hpp"
#include "bridge/describe/write/written.hpp"

namespace trestle::generate {

/// The folder of `trestle generate -o`, with the list of what was written there. What others have put there
/// or edited is kept.
class OutputFolder {
 public:
  /// @param sources  files that were read: they are neither written over nor removed.
  /// @param force    takes what others have made or edited for our own, but no source.
  /// @param problems gets what is wrong with the list. Then nothing may be written.
  OutputFolder(std::filesystem::path folder, const std::vector<std::string>& sources, bool force,
               std::vector<documents::Problem>& problems);

  /// Before anything is written.
  /// @throws CLI::ValidationError that names what would be lost, and what to do.
  void check(std::span<const describe::TextFile* const> files) const;

  [[nodiscard]] std::filesystem::path path_of(const describe::TextFile& file) const;

  struct Writing {
    bool is_new = false;     ///< else it had this text already
    std::string replaced{};  ///< the origin of what was there and came of other sources
  };
  /// Writes a file as a whole or not at all, and not if it has this text already, so that nothing that
  /// depends on it is made anew. A file of others that has it stays theirs: it does not get into the list.
  /// @param origin  describe::GeneratedFile::origin
  /// @throws std::runtime_error when that fails. The list then has what was written before.
  Writing write(const describe::TextFile& file, const std::string& origin);

  /// A file of an earlier run, which is no longer made.
  struct Leftover {
    std::filesystem::path path;
    std::string
        why_kept{};  ///< "it was edited"; empty: it was removed, and so were folders that became empty
  };
  /// Removes what earlier runs made of the same origins, and writes the list: after everything is written.
  /// Nothing is removed that a symbolic link leads to, nor beside files of other sources, which may need it.
  /// @throws std::runtime_error when the list cannot be written.
  std::vector<Leftover> finish(const std::set<std::string>& origins);

 private:
  [[nodiscard]] bool is_source(const std::filesystem::path& path) const;
  [[nodiscard]] std::string why_kept(const describe::GeneratedFile& file) const;
  void write_list() const;

  std::filesystem::path folder_;
  std::set<std::filesystem::path> sources_{};
  bool force_ = false;
  std::map<std::string, describe::GeneratedFile, std::less<>> before_{};  ///< those that are still there
  std::vector<describe::GeneratedFile> written_{};
};

}  // namespace trestle::generate
