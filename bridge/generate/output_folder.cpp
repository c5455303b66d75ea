#include "bridge/generate/output_folder.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iterator>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include "bridge/documents/document.hpp"
#include "bridge/documents/replace_file.hpp"
#include "bridge/documents/sha256.hpp"

namespace trestle::generate {
namespace {

namespace fs = std::filesystem;

/// A path in a folder, as the list of generated files has it.
std::string path_in_list(const std::string& path) {
  return fs::path{path}.lexically_normal().generic_string();
}

bool has_text(const fs::path& path, const std::string& text) {
  std::error_code ignored;
  return fs::file_size(path, ignored) == text.size() &&
         documents::read_text_file(path.string(), text.size()) == text;
}

bool is_edited(const fs::path& path, const describe::GeneratedFile& file) {
  if (file.sha256.empty()) {
    return false;
  }
  const auto text = documents::read_text_file(path.string(), std::numeric_limits<std::size_t>::max() - 1);
  return !text || documents::sha256(*text) != file.sha256;
}

bool write_text(const fs::path& path, const std::string& text) {
  if (has_text(path, text)) {
    return false;
  }
  std::error_code error;
  if (fs::create_directories(path.parent_path(), error); error) {
    throw std::runtime_error{
        fmt::format("{} cannot be made: {}", path.parent_path().string(), error.message())};
  }
  if (const auto written = documents::replace_file(path, text, documents::Outlives::the_program); !written) {
    throw std::runtime_error{written.error()};
  }
  return true;
}

/// Whether an origin names all that another one does.
bool names_all(const std::string& origin, const std::string& other) {
  const auto words = [](const std::string& text) {
    std::istringstream in{text};
    return std::set<std::string>{std::istream_iterator<std::string>{in}, {}};
  };
  return std::ranges::includes(words(origin), words(other));
}

/// The kept ids and the list are no leftovers, whatever a list says.
bool is_list(const fs::path& path) {
  return path.filename() == describe::generated_list_name || path.filename() == "ids.lock";
}

/// Whether `path` is a file of this folder, and no link leads to it.
bool is_inside(const fs::path& folder, const std::string& path) {
  std::error_code error;
  const fs::path parent = (folder / path).parent_path();
  return fs::symlink_status(folder / path, error).type() == fs::file_type::regular &&
         fs::canonical(parent, error) ==
             (fs::canonical(folder, error) / fs::path{path}.parent_path() / "").parent_path();
}

}  // namespace

OutputFolder::OutputFolder(fs::path folder, const std::vector<std::string>& sources, bool force,
                           std::vector<documents::Problem>& problems)
    : folder_{std::move(folder)}, force_{force} {
  std::error_code error;
  for (const std::string& one : sources) {
    sources_.insert(fs::weakly_canonical(one, error));
  }
  for (describe::GeneratedFile& file : describe::load_generated_list(folder_, problems)) {
    if (fs::is_regular_file(folder_ / file.path, error) && !is_list(file.path)) {
      std::string path = file.path;
      before_.insert_or_assign(std::move(path), std::move(file));
    }
  }
}

bool OutputFolder::is_source(const fs::path& path) const {
  std::error_code error;
  return sources_.contains(fs::weakly_canonical(path, error));
}

fs::path OutputFolder::path_of(const describe::TextFile& file) const {
  return folder_ / file.path;
}

void OutputFolder::check(std::span<const describe::TextFile* const> files) const {
  std::vector<std::string> others;
  std::vector<std::string> edited;
  for (const describe::TextFile* const file : files) {
    const fs::path path = path_of(*file);
    if (is_source(path)) {
      throw CLI::ValidationError{
          "-o",
          fmt::format("{} is a source, and would be written over: expected another folder", path.string())};
    }
    std::error_code error;
    const bool is_there = fs::symlink_status(path, error).type() != fs::file_type::not_found;
    if (force_ || !is_there || has_text(path, file->text)) {
      continue;
    }
    const auto known = before_.find(path_in_list(file->path));
    if (known == before_.end()) {
      others.push_back(path.string());
    } else if (is_edited(path, known->second)) {
      edited.push_back(path.string());
    }
  }
  std::vector<std::string> faults;
  if (!others.empty()) {
    faults.push_back(
        fmt::format("{} {} not made by `trestle generate`, and would be replaced: expected another folder, "
                    "or --force",
                    fmt::join(others, ", "), others.size() == 1 ? "is" : "are"));
  }
  if (!edited.empty()) {
    faults.push_back(fmt::format(
        "{} {} edited since `trestle generate` wrote {}, and would be replaced: move {} away, or give "
        "--force",
        fmt::join(edited, ", "), edited.size() == 1 ? "was" : "were", edited.size() == 1 ? "it" : "them",
        edited.size() == 1 ? "it" : "them"));
  }
  if (!faults.empty()) {
    throw CLI::ValidationError{"-o", fmt::format("{}", fmt::join(faults, "\n-o: "))};
  }
}

OutputFolder::Writing OutputFolder::write(const describe::TextFile& file, const std::string& origin) {
  Writing result;
  try {
    result.is_new = write_text(path_of(file), file.text);
  } catch (const std::runtime_error&) {
    try {  // what was written before is known to the next run
      write_list();
    } catch (const std::runtime_error&) {  // the first error tells more
    }
    throw;
  }
  std::string path = path_in_list(file.path);
  const auto before = before_.find(path);
  if (before != before_.end()) {
    if (result.is_new && !names_all(origin, before->second.origin)) {
      result.replaced = before->second.origin;
    }
    before_.erase(before);
  } else if (!result.is_new && !force_) {
    return result;
  }
  written_.push_back({std::move(path), documents::sha256(file.text), origin});
  return result;
}

std::string OutputFolder::why_kept(const describe::GeneratedFile& file) const {
  if (is_edited(folder_ / file.path, file)) {
    return "it was edited";
  }
  if (!is_inside(folder_, file.path)) {
    return "a link leads to it";
  }
  // A package of ROS is a folder, and what describes it there is for all its files.
  const std::string parent = fs::path{file.path}.parent_path().generic_string() + "/";
  const auto is_beside = [&](const describe::GeneratedFile& other) {
    return other.origin != file.origin && other.path.starts_with(parent);
  };
  if (parent != "/" && (std::ranges::any_of(written_, is_beside) ||
                        std::ranges::any_of(
                            before_, is_beside, [](const auto& one) -> const auto& { return one.second; }))) {
    return "files of other sources are beside it";
  }
  return {};
}

void OutputFolder::write_list() const {
  std::vector<describe::GeneratedFile> files = written_;
  for (const auto& [path, file] : before_) {
    files.push_back(file);
  }
  const fs::path list = folder_ / describe::generated_list_name;
  std::error_code error;
  if (!files.empty()) {
    write_text(list, describe::generated_list(std::move(files)));
  } else if (fs::is_regular_file(list, error)) {
    fs::remove(list, error);
  }
}

std::vector<OutputFolder::Leftover> OutputFolder::finish(const std::set<std::string>& origins) {
  std::vector<std::string> paths;
  for (const auto& [path, file] : before_) {
    if (!file.sha256.empty() && origins.contains(file.origin) && !is_source(folder_ / path)) {
      paths.push_back(path);
    }
  }
  std::vector<Leftover> leftovers;
  for (const std::string& path : paths) {  // before any is removed, beside which others are
    leftovers.push_back({folder_ / path, why_kept(before_.at(path))});
  }
  std::set<fs::path> folders;
  std::error_code error;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    if (!leftovers[i].why_kept.empty()) {
      continue;
    }
    if (fs::remove(leftovers[i].path, error); error) {
      leftovers[i].why_kept = "it cannot be removed: " + error.message();
      continue;
    }
    before_.erase(paths[i]);
    for (fs::path folder = fs::path{paths[i]}.parent_path(); !folder.empty(); folder = folder.parent_path()) {
      folders.insert(folder);
    }
  }
  for (auto folder = folders.rbegin(); folder != folders.rend(); ++folder) {  // inner ones first
    fs::remove(folder_ / *folder, error);                                     // if it is empty
  }
  // The last thing, so that it never has the checksum of something that was not written.
  write_list();
  return leftovers;
}

}  // namespace trestle::generate
