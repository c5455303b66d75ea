#include "bridge/describe/sources/generated_list.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>
#include <tuple>
#include <utility>

#include "bridge/documents/document.hpp"
#include "bridge/documents/format.hpp"

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

/// A line that a merge leaves where two sides differ; its mark, or nothing.
std::string_view mark_of_merge(std::string_view line) {
  for (const std::string_view mark : {"<<<<<<<", "|||||||", "=======", ">>>>>>>"}) {
    if (line.starts_with(mark) && (line.size() == mark.size() || line[mark.size()] == ' ')) {
      return mark;
    }
  }
  return {};
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

std::vector<GeneratedFile> read_generated_list(const std::string& file, std::string_view text,
                                               std::vector<documents::Problem>& problems) {
  std::vector<GeneratedFile> files;
  std::string origin;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.ends_with('\r')) {  // as some checkouts have it
      line.remove_suffix(1);
    }
    if (const std::string_view mark = mark_of_merge(line); !mark.empty()) {
      problems.push_back(
          {.file = file,
           .mark = {number, 1},
           .text = fmt::format("'{}' is what a merge has left: keep the lines of one side, and "
                               "run `trestle generate` again",
                               mark)});
      return {};
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

std::vector<GeneratedFile> load_generated_list(const std::filesystem::path& folder,
                                               std::vector<documents::Problem>& problems) {
  constexpr std::size_t bytes_max = std::size_t{16} << 20U;
  const std::filesystem::path file = folder / generated_list_name;
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    return {};
  }
  const auto text = documents::read_text_file(file.string(), bytes_max);
  if (!text || text->size() > bytes_max) {
    problems.push_back(
        {.file = file.string(),
         .mark = {},
         .text = text ? fmt::format("the file is larger than {}", documents::bytes_to_string(bytes_max))
                      : text.error()});
    return {};
  }
  return read_generated_list(file.string(), *text, problems);
}

}  // namespace trestle::describe
