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
  OutputFolder(std::filesystem::path folder, const std::vector<std::string>& sources);

  /// Before anything is written.
  /// @param force  allows to replace what others have made or edited, but no source.
  /// @throws CLI::ValidationError that names what would be lost, and what to do.
  void check(std::span<const describe::TextFile* const> files, bool force) const;

  [[nodiscard]] std::filesystem::path path_of(const describe::TextFile& file) const;

  /// Writes a file unless it has this text already, so that nothing that depends on it is made anew.
  /// @param origin  describe::GeneratedFile::origin
  /// @return whether it was written.
  /// @throws std::runtime_error when that fails.
  bool write(const describe::TextFile& file, const std::string& origin);

  /// A file of an earlier run, which is no longer made.
  struct Leftover {
    std::filesystem::path path;
    bool is_kept = false;  ///< it was edited; else it is removed, and so are folders that are empty then
  };
  /// Removes what earlier runs made of the same origins, and writes the list: after everything is written.
  /// @throws std::runtime_error when that fails.
  std::vector<Leftover> finish(const std::set<std::string>& origins);

 private:
  [[nodiscard]] bool is_source(const std::filesystem::path& path) const;

  std::filesystem::path folder_;
  std::set<std::filesystem::path> sources_{};
  std::map<std::string, describe::GeneratedFile, std::less<>> before_{};  ///< those that are still there
  std::vector<describe::GeneratedFile> written_{};
};

}  // namespace trestle::generate
