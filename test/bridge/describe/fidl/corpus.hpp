#pragma once
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "bridge/describe/read/fidl/read_fidl.hpp"
#include "test/source_dir.hpp"

/// The real files that lie beside the project.
namespace trestle::describe::corpus {

/// Their folder; nothing where they are not.
inline std::optional<std::filesystem::path> folder() {
  const char* named = std::getenv("TRESTLE_CORPORA");
  const std::filesystem::path source{test::source_dir()};
  for (const std::filesystem::path& path : {std::filesystem::path{named == nullptr ? "" : named},
                                            source / "../shared/corpora", source / "../../shared/corpora"}) {
    if (!path.empty() && std::filesystem::is_directory(path / "files")) {
      return std::filesystem::canonical(path);
    }
  }
  return std::nullopt;
}

inline std::optional<std::string> text_of(const std::filesystem::path& file) {
  std::ifstream in{file, std::ios::binary};
  if (!in || !std::filesystem::is_regular_file(file)) {
    return std::nullopt;
  }
  return std::string{std::istreambuf_iterator<char>{in}, {}};
}

inline tl::expected<std::string, std::string> load(const std::string& name) {
  auto text = text_of(name);
  if (!text) {
    return tl::unexpected{std::string{"there is no such file"}};
  }
  return std::move(*text);
}

/// All files with this ending in the folder `within` of the corpora, sorted.
inline std::vector<std::filesystem::path> files(const std::string& within, const std::string& ending) {
  std::vector<std::filesystem::path> found;
  if (const auto root = folder()) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(*root / within)) {
      if (entry.path().extension() == ending) {
        found.push_back(entry.path());
      }
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

/// FIDL files that a FDEPL file names by a path of somebody's machine are found by their names, anywhere.
inline Reading read(const std::filesystem::path& file) {
  const auto text = text_of(file);
  const SourceText source{file.string(), text.value_or("")};
  const auto load_anywhere = [](const std::string& name) -> tl::expected<std::string, std::string> {
    auto text = load(name);
    if (text || std::filesystem::path{name}.extension() != ".fidl") {
      return text;
    }
    for (const auto& other : files("files", ".fidl")) {
      if (other.filename() == std::filesystem::path{name}.filename()) {
        return load(other.string());
      }
    }
    return text;
  };
  return read_fidl(std::span{&source, 1}, load_anywhere);
}

}  // namespace trestle::describe::corpus
