#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/describe/allocate.hpp"
#include "bridge/describe/sources/sources.hpp"
#include "bridge/describe/system.hpp"

/// Ids that no description gives: those that were chosen before lie beside the descriptions, in ids.lock, so
/// that each program that reads these has the same ones.
namespace trestle::describe {

inline constexpr std::string_view kept_ids_name = "ids.lock";

/// What such files say.
struct KeptIds {
  IdLock lock{};                     ///< of all files together
  std::vector<std::string> files{};  ///< that were read
};

/// Such a file, and which of the files and folders that were given it lies beside, or in.
struct KeptIdsFile {
  std::string file{};
  std::string beside{};
};
/// Those that are there in the folders of files, and in folders themselves, each once.
[[nodiscard]] std::vector<KeptIdsFile> kept_ids_files(const std::vector<std::string>& paths);

/// Reads them.
/// @param paths     files and folders.
/// @param problems  gets what is wrong, with its place: two files that contradict each other, too.
[[nodiscard]] KeptIds load_kept_ids(const std::vector<std::string>& paths,
                                    std::vector<documents::Problem>& problems);
/// Reads one such file.
void add_kept_ids(const std::string& file, KeptIds& into, std::vector<documents::Problem>& problems);

/// What a user should know of ids that no description gives, each a line, or empty.
struct OpenIds {
  std::string moved{};     ///< one of ids.lock is not used: a description has given it to something else
  std::string kept{};      ///< those of ids.lock are used
  std::string chosen{};    ///< others were chosen just now
  bool forgotten = false;  ///< a FDEPL file lies beside a FIDL file and was not given; the lines name it
};
/// @param kept   as it was before ids were chosen.
/// @param now    with those that were chosen.
/// @param paths  the files and folders that were given.
[[nodiscard]] OpenIds open_ids_of(const Model& model, const KeptIds& kept, const IdLock& now,
                                  const std::vector<std::string>& paths);

/// Descriptions as tools use them.
struct LoadedSystem {
  System system{};
  OpenIds open_ids{};
};
/// Makes a system of what load_sources() has loaded, with the ids that were chosen before.
/// @param paths  what it was loaded from.
[[nodiscard]] LoadedSystem load_system(std::span<const SourceText> sources,
                                       const std::vector<std::string>& paths,
                                       const SourceOptions& options = {});

/// A FIDL file with the FDEPL files beside it that begin with its name, "Door-SomeIP.fdepl", and the other
/// way round; FIDL first. Of any other file, it alone.
[[nodiscard]] std::vector<std::string> with_those_beside(const std::string& file);

}  // namespace trestle::describe
