#include "bridge/generate/output_folder.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "bridge/documents/sha256.hpp"

namespace trestle::generate {
namespace {

namespace fs = std::filesystem;

/// A path in a folder, as the list of generated files has it.
std::string path_in_list(const std::string& path) {
  return fs::path{path}.lexically_normal().generic_string();
}

std::string text_of_file(const fs::path& path) {
  std::ifstream file{path, std::ios::binary};
  return {std::istreambuf_iterator<char>{file}, {}};
}

bool has_text(const fs::path& path, const std::string& text) {
  std::error_code ignored;
  return fs::file_size(path, ignored) == text.size() && text_of_file(path) == text;
}

bool is_edited(const fs::path& path, const describe::GeneratedFile& file) {
  return !file.sha256.empty() && documents::sha256(text_of_file(path)) != file.sha256;
}

bool write_text(const fs::path& path, const std::string& text) {
  if (has_text(path, text)) {
    return false;
  }
  fs::create_directories(path.parent_path());
  std::ofstream out{path, std::ios::binary};
  if (!(out << text) || !out.flush()) {
    throw std::runtime_error{fmt::format("{} cannot be written", path.string())};
  }
  return true;
}

}  // namespace

OutputFolder::OutputFolder(fs::path folder, const std::vector<std::string>& sources)
    : folder_{std::move(folder)} {
  std::error_code error;
  for (const std::string& one : sources) {
    sources_.insert(fs::weakly_canonical(one, error));
  }
  for (describe::GeneratedFile& file :
       describe::read_generated_list(text_of_file(folder_ / describe::generated_list_name))) {
    if (fs::exists(folder_ / file.path, error)) {
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

void OutputFolder::check(std::span<const describe::TextFile* const> files, bool force) const {
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
    if (force || !fs::exists(path, error) || has_text(path, file->text)) {
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

bool OutputFolder::write(const describe::TextFile& file, const std::string& origin) {
  const bool is_new = write_text(path_of(file), file.text);
  std::string path = path_in_list(file.path);
  before_.erase(path);
  written_.push_back({std::move(path), documents::sha256(file.text), origin});
  return is_new;
}

std::vector<OutputFolder::Leftover> OutputFolder::finish(const std::set<std::string>& origins) {
  std::vector<Leftover> leftovers;
  std::error_code error;
  for (auto& [path, file] : before_) {
    const fs::path at = folder_ / path;
    const bool is_left = !file.sha256.empty() && origins.contains(file.origin) && !is_source(at);
    if (!is_left || is_edited(at, file)) {
      if (is_left) {
        leftovers.push_back({at, true});
      }
      written_.push_back(std::move(file));
      continue;
    }
    if (!fs::remove(at, error)) {
      throw std::runtime_error{fmt::format("{} cannot be removed", at.string())};
    }
    leftovers.push_back({at, false});
    for (fs::path folder = fs::path{path}.parent_path();
         !folder.empty() && fs::remove(folder_ / folder, error); folder = folder.parent_path()) {
    }
  }
  // The last thing, so that it never has the checksum of something that was not written.
  const fs::path list = folder_ / describe::generated_list_name;
  if (!written_.empty()) {
    write_text(list, describe::generated_list(std::move(written_)));
  } else if (!leftovers.empty()) {
    fs::remove(list, error);
  }
  return leftovers;
}

}  // namespace trestle::generate
