#include "bridge/describe/sources/generated_list.hpp"

#include <algorithm>
#include <filesystem>
#include <tuple>
#include <utility>

namespace trestle::describe {
namespace {

constexpr std::string_view head_of_list =
    "# What `trestle generate` wrote here. A folder that is a source is read without these files.\n"
    "# `sha256sum --check generated.lock` tells which were changed since.\n";
constexpr std::string_view head_of_origin = "# --to ";

/// The checksum in front of a path, which is cut off.
std::string cut_sha256(std::string_view& line) {
  constexpr std::size_t digits = 64;
  constexpr std::string_view gap = "  ";
  if (line.find_first_not_of("0123456789abcdefABCDEF") != digits || line.substr(digits, gap.size()) != gap) {
    return {};
  }
  std::string sum{line.substr(0, digits)};
  std::ranges::transform(sum, sum.begin(),
                         [](char c) { return c < 'A' || c > 'F' ? c : static_cast<char>(c + ('a' - 'A')); });
  line.remove_prefix(digits + gap.size());
  return sum;
}

}  // namespace

std::string generated_list(std::vector<GeneratedFile> files) {
  std::ranges::sort(files, {}, [](const GeneratedFile& one) { return std::tie(one.origin, one.path); });
  std::string text{head_of_list};
  std::string_view origin;
  for (const GeneratedFile& file : files) {
    if (file.origin != origin) {
      text.append(head_of_origin).append(file.origin) += '\n';
      origin = file.origin;
    }
    text += file.sha256.empty() ? file.path + "\n" : file.sha256 + "  " + file.path + "\n";
  }
  return text;
}

std::vector<GeneratedFile> read_generated_list(std::string_view text) {
  std::vector<GeneratedFile> files;
  std::string origin;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.ends_with('\r')) {  // as some checkouts have it
      line.remove_suffix(1);
    }
    if (line.starts_with('#')) {
      if (line.starts_with(head_of_origin)) {
        origin = line.substr(head_of_origin.size());
      }
      continue;
    }
    std::string sum = cut_sha256(line);
    const std::filesystem::path path{line};
    const std::filesystem::path normal = path.lexically_normal();
    if (!path.empty() && !path.is_absolute() && *normal.begin() != "..") {
      files.push_back({.path = normal.string(), .sha256 = std::move(sum), .origin = origin});
    }
  }
  return files;
}

}  // namespace trestle::describe
