#include "bridge/describe/sources/sources.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>

#include "bridge/describe/join.hpp"
#include "bridge/describe/read/arxml/arxml.hpp"
#include "bridge/describe/read/fidl/read_fidl.hpp"
#include "bridge/describe/read/vsomeip/read_vsomeip.hpp"
#include "bridge/describe/sources/ros_types.hpp"
#include "bridge/documents/problems.hpp"
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

void add(Reading& to, Reading from) {
  append(to.model, std::move(from.model));
  to.problems.insert(to.problems.end(), std::make_move_iterator(from.problems.begin()),
                     std::make_move_iterator(from.problems.end()));
}

}  // namespace

SourceKind kind_of(std::string_view name, std::string_view text) {
  for (const auto& [ending, kind] : endings) {
    if (name.ends_with(ending)) {
      return kind;
    }
  }
  const std::string_view front = text.substr(0, 4096);
  if (front.find("<AUTOSAR") != std::string_view::npos) {
    return SourceKind::arxml;
  }
  const std::size_t first = front.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && front[first] == '{' ? SourceKind::vsomeip : SourceKind::unknown;
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
    if (kind == SourceKind::unknown) {
      reading.problems.push_back({.file = source.name,
                                  .mark = {},
                                  .text = "is not an interface description: expected FIDL, FDEPL, ARXML, "
                                          "vsomeip JSON, .msg, .srv, .action or .idl"});
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
  }
  return reading;
}

std::vector<SourceText> load_sources(const std::vector<std::string>& paths,
                                     std::vector<documents::Problem>& problems, const SourceLimits& limits) {
  std::vector<SourceText> sources;
  std::size_t left = limits.all_bytes;
  const auto load = [&](const std::string& name) {
    const bool is_short = left < limits.file_bytes;
    if (auto text = load_file(name, is_short ? left : limits.file_bytes,
                              is_short ? ", which is what all files together may still have" : "")) {
      left -= text->size();
      sources.push_back({name, std::move(*text)});
    } else {
      problems.push_back({.file = name, .mark = {}, .text = "cannot be read: " + text.error()});
    }
  };
  for (const std::string& path : paths) {
    std::error_code error;
    if (!fs::is_directory(path, error)) {
      load(path);
      continue;
    }
    std::vector<std::string> names;
    for (fs::recursive_directory_iterator at{path, fs::directory_options::skip_permission_denied, error}, end;
         !error && at != end; at.increment(error)) {
      const std::string name = at->path().string();
      if (at->is_regular_file(error) && kind_of(name, {}) != SourceKind::unknown) {
        names.push_back(name);
      }
    }
    if (error) {
      problems.push_back({.file = path, .mark = {}, .text = "cannot be read: " + error.message()});
    } else if (names.empty()) {
      problems.push_back({.file = path, .mark = {}, .text = "has no interface description in it"});
    }
    std::ranges::sort(names);
    std::ranges::for_each(names, load);
  }
  return sources;
}

bool has_ros_files(const std::string& path) {
  const auto is_ros = [](const std::string& name) { return kind_of(name, {}) == SourceKind::ros; };
  std::error_code error;
  if (!fs::is_directory(path, error)) {
    return is_ros(path);
  }
  for (fs::recursive_directory_iterator at{path, fs::directory_options::skip_permission_denied, error}, end;
       !error && at != end; at.increment(error)) {
    if (is_ros(at->path().string()) && at->is_regular_file(error)) {
      return true;
    }
  }
  return false;
}

Load file_loader() {
  return [](const std::string& name) { return load_file(name, SourceLimits{}.file_bytes, ""); };
}

}  // namespace trestle::describe
