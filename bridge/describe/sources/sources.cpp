#include "bridge/describe/sources/sources.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <set>
#include <sstream>
#include <utility>

#include "bridge/describe/join.hpp"
#include "bridge/describe/model_json.hpp"
#include "bridge/describe/read/arxml/arxml.hpp"
#include "bridge/describe/read/fidl/read_fidl.hpp"
#include "bridge/describe/read/vsomeip/json_tree.hpp"
#include "bridge/describe/read/vsomeip/read_vsomeip.hpp"
#include "bridge/describe/sources/generated_list.hpp"
#include "bridge/describe/sources/ros_types.hpp"
#include "bridge/documents/problems.hpp"
#include "bridge/documents/quote_path.hpp"
#include "bridge/documents/utf8.hpp"

namespace trestle::describe {
namespace {

namespace fs = std::filesystem;

constexpr std::array endings{
    std::pair{".fidl", SourceKind::fidl},   std::pair{".fdepl", SourceKind::fidl},
    std::pair{".arxml", SourceKind::arxml}, std::pair{".json", SourceKind::vsomeip},
    std::pair{".msg", SourceKind::ros},     std::pair{".srv", SourceKind::ros},
    std::pair{".action", SourceKind::ros},  std::pair{".idl", SourceKind::ros},
};

std::string size_text(std::uintmax_t bytes) {
  constexpr std::uintmax_t mega = 1'000'000;
  return bytes < mega ? fmt::format("{} bytes", bytes) : fmt::format("{} MB", bytes / mega);
}

/// The text of a file, or why it cannot be read.
/// @param room  most bytes of it.
tl::expected<std::string, std::string> load_file(const std::string& name, std::size_t room,
                                                 std::string_view of_what) {
  std::error_code error;
  const auto size = fs::file_size(name, error);
  if (error) {
    return tl::unexpected{error.message()};
  }
  if (size > room) {
    return tl::unexpected{
        fmt::format("it has {}; expected at most {}{}", size_text(size), size_text(room), of_what)};
  }
  std::ifstream file{name, std::ios::binary};
  std::string text(size, '\0');
  file.read(text.data(), static_cast<std::streamsize>(size));
  if (file.bad() || !file.is_open()) {
    return tl::unexpected{std::string{"it cannot be opened"}};
  }
  text.resize(static_cast<std::size_t>(file.gcount()));
  return text;
}

SourceKind kind_of_json(std::string_view text) {
  const auto names = names_of_root(text);
  if (names && is_model(*names)) {
    return SourceKind::model;
  }
  return !names || is_vsomeip(text) ? SourceKind::vsomeip : SourceKind::unknown;
}

/// What is in a folder and below.
struct Folder {
  std::vector<std::string> sources{};    ///< sorted
  std::vector<std::string> generated{};  ///< likewise: those that `trestle generate` wrote
  std::error_code error{};
  std::vector<documents::Problem> problems{};  ///< of lists of these
};

Folder look_into(const std::string& path) {
  Folder folder;
  std::vector<std::string> names;
  std::set<std::string, std::less<>> generated;
  for (fs::recursive_directory_iterator at{path, fs::directory_options::skip_permission_denied, folder.error},
       end;
       !folder.error && at != end; at.increment(folder.error)) {
    if (!at->is_regular_file(folder.error)) {
      continue;
    }
    if (at->path().filename() == generated_list_name) {
      const fs::path place = at->path().parent_path();
      for (const GeneratedFile& one : load_generated_list(place, folder.problems)) {
        generated.insert((place / one.path).lexically_normal().string());
      }
    } else if (kind_of(at->path().string(), {}) != SourceKind::unknown) {
      names.push_back(at->path().string());
    }
  }
  std::ranges::sort(names);
  for (std::string& name : names) {
    const bool is_ours = !generated.empty() && generated.contains(fs::path{name}.lexically_normal().string());
    (is_ours ? folder.generated : folder.sources).push_back(std::move(name));
  }
  return folder;
}

/// "a.json and 3 others"
std::string some_of(const std::vector<std::string>& names) {
  const std::string first = documents::quote_path(names.front());
  const std::size_t others = names.size() - 1;
  return others == 0 ? first : fmt::format("{} and {} other{}", first, others, others == 1 ? "" : "s");
}

void add(Reading& to, Reading from) {
  append(to.model, std::move(from.model));
  to.problems.insert(to.problems.end(), std::make_move_iterator(from.problems.begin()),
                     std::make_move_iterator(from.problems.end()));
}

}  // namespace

SourceKind kind_of(std::string_view name, std::string_view text) {
  for (const auto& [ending, kind] : endings) {
    if (name.ends_with(ending)) {
      return kind == SourceKind::vsomeip && !text.empty() ? kind_of_json(text) : kind;
    }
  }
  const std::string_view front = text.substr(0, 4096);
  if (front.find("<AUTOSAR") != std::string_view::npos) {
    return SourceKind::arxml;
  }
  const std::size_t first = front.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && front[first] == '{' ? kind_of_json(text) : SourceKind::unknown;
}

Reading read_sources(std::span<const SourceText> sources, const Load& load, const SourceOptions& options) {
  Reading reading;
  const auto make_utf8 = [&](SourceText& source) {
    if (auto warning = documents::make_utf8(source.text, source.name)) {
      reading.problems.push_back(std::move(*warning));
    }
  };
  std::array<std::vector<SourceText>, 4> by_kind;
  for (const SourceText& source : sources) {
    const SourceKind kind = kind_of(source.name, source.text);
    if (kind == SourceKind::model || kind == SourceKind::unknown) {
      const bool is_json = names_of_root(source.text).has_value();
      const char* const text =
          kind == SourceKind::model
              ? "this is a model that `trestle generate --to json` wrote, which is not read again: name the "
                "files that it was made of"
          : is_json
              ? "there is nothing of a vsomeip configuration: expected \"services\", \"clients\", "
                "\"unicast\", \"service-discovery\" or another of its keys"
              : "is not an interface description: expected FIDL, FDEPL, ARXML, vsomeip JSON, .msg, .srv, "
                ".action or .idl";
      reading.problems.push_back(
          {.file = source.name, .mark = is_json ? documents::Mark{1, 1} : documents::Mark{}, .text = text});
    } else {
      SourceText& mended = by_kind.at(static_cast<std::size_t>(kind)).emplace_back(source);
      if (kind != SourceKind::arxml) {  // XML says itself how it is encoded
        make_utf8(mended);
      }
    }
  }
  const Load load_utf8 = [&](const std::string& name) {
    auto text = load(name);
    if (text) {
      SourceText mended{name, std::move(*text)};
      make_utf8(mended);
      *text = std::move(mended.text);
    }
    return text;
  };
  const auto of = [&](SourceKind kind) -> const std::vector<SourceText>& {
    return by_kind.at(static_cast<std::size_t>(kind));
  };
  if (!of(SourceKind::fidl).empty()) {
    add(reading, read_fidl(of(SourceKind::fidl), load ? load_utf8 : load));
  }
  if (auto& arxml = by_kind.at(static_cast<std::size_t>(SourceKind::arxml)); !arxml.empty()) {
    std::vector<std::istringstream> streams;
    std::vector<ArxmlInput> inputs;
    streams.reserve(arxml.size());
    for (SourceText& source : arxml) {
      inputs.push_back({source.name, streams.emplace_back(std::move(source.text))});
    }
    add(reading, read_arxml(inputs, {.set_event_bit = options.set_event_bit}));
  }
  if (!of(SourceKind::vsomeip).empty()) {
    add(reading, read_vsomeip(of(SourceKind::vsomeip)));
  }
  if (!of(SourceKind::ros).empty()) {
    add(reading, read_ros_files(of(SourceKind::ros), options.type_folders, options.look_beside));
  }
  if (reading.ok()) {
    std::vector<documents::Problem> problems = join(reading.model);
    reading.problems.insert(reading.problems.end(), std::make_move_iterator(problems.begin()),
                            std::make_move_iterator(problems.end()));
  } else {
    join_with_errors(reading.model, reading.problems);
  }
  return reading;
}

std::vector<SourceText> load_sources(const std::vector<std::string>& paths,
                                     std::vector<documents::Problem>& problems, const SourceLimits& limits) {
  std::vector<SourceText> sources;
  std::size_t left = limits.all_bytes;
  const auto load = [&](const std::string& name) -> std::optional<SourceText> {
    const bool is_short = left < limits.file_bytes;
    auto text = load_file(name, is_short ? left : limits.file_bytes,
                          is_short ? ", which is what all files together may still have" : "");
    if (!text) {
      problems.push_back({.file = name, .mark = {}, .text = "cannot be read: " + text.error()});
      return std::nullopt;
    }
    return SourceText{name, std::move(*text)};
  };
  const auto take = [&](SourceText source) {
    left -= source.text.size();
    sources.push_back(std::move(source));
  };
  for (const std::string& path : paths) {
    std::error_code error;
    if (!fs::is_directory(path, error)) {
      if (auto source = load(path)) {
        take(std::move(*source));
      }
      continue;
    }
    Folder folder = look_into(path);
    if (folder.sources.empty()) {
      folder.sources = std::exchange(folder.generated, {});  // who names it means these
    }
    const std::size_t taken_before = sources.size();
    const std::size_t told_before = problems.size();
    std::ranges::move(folder.problems, std::back_inserter(problems));
    if (folder.error) {
      problems.push_back({.file = path, .mark = {}, .text = "cannot be read: " + folder.error.message()});
    }
    std::vector<std::string> others;
    for (const std::string& name : folder.sources) {
      auto source = load(name);
      if (!source) {
        continue;
      }
      const bool is_json = kind_of(name, {}) == SourceKind::vsomeip;
      if (is_json && kind_of(name, source->text) == SourceKind::model) {
        folder.generated.push_back(name);
      } else if (is_json && !is_vsomeip(source->text)) {
        others.push_back(fs::path{name}.lexically_relative(path).string());
      } else {
        take(std::move(*source));
      }
    }
    if (sources.size() == taken_before && problems.size() == told_before) {
      problems.push_back({.file = path, .mark = {}, .text = "has no interface description in it"});
    }
    const auto leave_out = [&](const std::string& what) {
      problems.push_back(
          {.severity = documents::Problem::Severity::warning, .file = path, .mark = {}, .text = what});
    };
    if (!folder.generated.empty()) {
      const std::size_t count = folder.generated.size();
      leave_out(
          fmt::format("has {} that `trestle generate` wrote, which {} left out: name what is to be read",
                      count == 1 ? "a file" : fmt::format("{} files", count), count == 1 ? "is" : "are"));
    }
    if (!others.empty()) {
      leave_out("has JSON with nothing of a vsomeip configuration, which is left out: " + some_of(others));
    }
  }
  return sources;
}

bool has_ros_files(const std::string& path) {
  const auto is_ros = [](const std::string& name) { return kind_of(name, {}) == SourceKind::ros; };
  std::error_code error;
  if (!fs::is_directory(path, error)) {
    return is_ros(path);
  }
  const Folder folder = look_into(path);
  return std::ranges::any_of(folder.sources.empty() ? folder.generated : folder.sources, is_ros);
}

Load file_loader() {
  return [](const std::string& name) { return load_file(name, SourceLimits{}.file_bytes, ""); };
}

}  // namespace trestle::describe
