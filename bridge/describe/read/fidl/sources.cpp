#include "bridge/describe/read/fidl/sources.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "bridge/documents/problems.hpp"
#include "bridge/documents/quote_path.hpp"

namespace trestle::describe::fidl {
namespace {

std::string_view base_name(std::string_view name) {
  const std::size_t slash = name.find_last_of("/\\");
  return slash == std::string_view::npos ? name : name.substr(slash + 1);
}

/// The version of CommonAPI's specification that a file of this name is; 0 when it is none of them.
int specification_version(std::string_view name) {
  const std::string_view base = base_name(name);
  if (!base.starts_with("CommonAPI") || base.find("deployment") == std::string_view::npos) {
    return 0;
  }
  return base.find("-4") != std::string_view::npos ? 2 : 1;
}

/// A specification for another protocol, as that for D-Bus, is not needed. Those of CommonAPI's early
/// releases have no "_spec" in their names, and what is in a plug-in of Eclipse is not at hand.
bool is_specification(std::string_view name) {
  const std::string_view base = base_name(name);
  const bool is_deployment = base.ends_with(".fdepl") && base.find("deployment") != std::string_view::npos;
  return base.find("deployment_spec") != std::string_view::npos ||
         (is_deployment && (base.starts_with("CommonAPI") || name.starts_with("platform:/plugin/")));
}

bool is_someip(std::string_view name) {
  const std::string_view base = base_name(name);
  return base.find("SOMEIP") != std::string_view::npos || base.find("SomeIP") != std::string_view::npos;
}

bool is_fdepl(const std::string& name, std::string_view text) {
  if (name.ends_with(".fidl")) {
    return false;
  }
  return name.ends_with(".fdepl") || text.find("define ") != std::string_view::npos;
}

/// An empty file is no copy of another one.
constexpr std::size_t least_copy_bytes = 8;

class Loader {
 public:
  Loader(const Load& load, const FidlLimits& limits, Problems& findings)
      : load_{load}, limits_{limits}, findings_{findings} {}

  Sources all(std::span<const SourceText> files);

 private:
  /// Index of a file that is given, or loaded now; nothing when there is none.
  std::optional<std::uint32_t> file_for(std::string_view import, std::uint32_t from, Place place);
  std::optional<std::uint32_t> below_a_root(std::string_view import, std::uint32_t from);
  std::optional<std::uint32_t> add(std::string name, std::string text, Place place);
  void parse(std::uint32_t file);
  void follow(const ImportTree& import, std::uint32_t from, FdeplSource* into);
  void find_versions();
  void tell_of_circles();

  const Load& load_;
  const FidlLimits& limits_;
  Problems& findings_;
  Sources sources_;
  std::map<std::string, std::uint32_t, std::less<>> files_;
  std::vector<std::string> texts_;                ///< until they are parsed
  std::map<std::string, std::uint32_t> by_text_;  ///< files
  std::vector<std::vector<std::pair<std::uint32_t, Place>>> imports_;
  std::size_t bytes_ = 0;
  TokenCount tokens_{.most = limits_.tokens};
};

std::optional<std::uint32_t> Loader::add(std::string name, std::string text, Place place) {
  // Trees of sources have copies of files that several of their parts need.
  if (const auto first = by_text_.find(text); first != by_text_.end()) {
    findings_.warning(Place{first->second, {}},
                      fmt::format("{} has the same text, and is left out", documents::quote_path(name)));
    files_.emplace(beside("", name), first->second);
    return first->second;
  }
  if (texts_.size() >= limits_.files || text.size() > limits_.bytes - bytes_) {
    const std::string quoted = documents::quote_path(name);
    findings_.error(
        place, texts_.size() >= limits_.files
                   ? fmt::format("{} is one file too many: at most {} FIDL and FDEPL files are read", quoted,
                                 limits_.files)
                   : fmt::format("{} has {} bytes; expected at most {}, of all FIDL and FDEPL files together",
                                 quoted, text.size(), limits_.bytes));
    sources_.too_much = true;
    return std::nullopt;
  }
  bytes_ += text.size();
  if (text.size() >= least_copy_bytes) {
    by_text_.emplace(text, static_cast<std::uint32_t>(texts_.size()));
  }
  const auto index = static_cast<std::uint32_t>(texts_.size());
  files_.emplace(beside("", name), index);
  sources_.names.push_back(std::move(name));
  texts_.push_back(std::move(text));
  imports_.emplace_back();
  return index;
}

Sources Loader::all(std::span<const SourceText> files) {
  for (const SourceText& file : files) {
    if (files_.contains(beside("", file.name))) {
      continue;
    }
    if (!add(file.name, file.text, {static_cast<std::uint32_t>(texts_.size()), {}})) {
      sources_.names.push_back(file.name);  // for the place of the error
      return std::move(sources_);
    }
  }
  for (std::uint32_t file = 0; file < texts_.size() && !sources_.too_much; ++file) {
    parse(file);
    sources_.too_much = sources_.too_much || tokens_.too_many;
  }
  tell_of_circles();
  find_versions();
  return std::move(sources_);
}

void Loader::parse(std::uint32_t file) {
  const std::string text = std::move(texts_[file]);
  texts_[file].clear();
  if (is_fdepl(sources_.names[file], text)) {
    FdeplSource& source = sources_.fdepl.emplace_back();
    source.file = file;
    source.tree = parse_fdepl(text, file, tokens_, findings_);
    for (const ImportTree& import : source.tree.imports) {
      follow(import, file, &source);
    }
  } else {
    FidlSource& source = sources_.fidl.emplace_back();
    source.file = file;
    source.tree = parse_fidl(text, file, tokens_, findings_);
    for (const ImportTree& import : source.tree.imports) {
      follow(import, file, nullptr);
    }
  }
}

void Loader::follow(const ImportTree& import, std::uint32_t from, FdeplSource* into) {
  if (import.file.empty()) {
    return;  // of a specification by its name
  }
  if (into != nullptr && is_specification(import.file)) {
    // The specifications of CommonAPI are known; what others say is not needed.
    if (is_someip(import.file)) {
      into->version = specification_version(import.file);
    }
    return;
  }
  if (const auto file = file_for(import.file, from, import.place)) {
    imports_[from].emplace_back(*file, import.place);
    if (into != nullptr) {
      into->imports.push_back(*file);
    }
  }
}

std::optional<std::uint32_t> Loader::file_for(std::string_view import, std::uint32_t from, Place place) {
  const std::size_t scheme = import.find(":/");
  const std::string wanted = scheme != std::string_view::npos && scheme > 1
                                 ? std::string{import}
                                 : beside(sources_.names[from], import);
  if (const auto known = files_.find(wanted); known != files_.end()) {
    return known->second;
  }
  auto text = load_ ? load_(wanted) : tl::unexpected{std::string{"there is no such file here"}};
  if (text) {
    return add(wanted, std::move(*text), place);
  }
  // Paths of another machine: a file of that name that is at hand is meant.
  const std::string_view base = base_name(import);
  for (const auto& [name, index] : files_) {
    if (base_name(name) == base) {
      findings_.warning(place,
                        fmt::format("{} cannot be read ({}); {} is taken", documents::quote_path(wanted),
                                    documents::printable(text.error()), documents::quote_path(name)));
      return index;
    }
  }
  if (const auto found =
          scheme > 1 && scheme != std::string_view::npos ? below_a_root(import, from) : std::nullopt) {
    return found;
  }
  const std::string near = beside(sources_.names[from], base);
  if (near != wanted && load_) {
    if (auto other = load_(near)) {
      findings_.warning(place,
                        fmt::format("{} cannot be read ({}); {} is taken", documents::quote_path(wanted),
                                    documents::printable(text.error()), documents::quote_path(near)));
      return add(near, std::move(*other), place);
    }
  }
  const std::string cannot =
      fmt::format("{} cannot be read: {}", documents::quote_path(wanted), documents::printable(text.error()));
  if (sources_.names[from].ends_with(".fidl")) {
    findings_.warning(place, cannot + "; what needs it is told below");
  } else {
    findings_.error(place, cannot);
  }
  return std::nullopt;
}

/// "classpath:/org/example/Door.fidl" and "platform:/resource/PROJECT/src/Door.fidl": the file of that path
/// below one of the folders that the importing file is in.
std::optional<std::uint32_t> Loader::below_a_root(std::string_view import, std::uint32_t from) {
  constexpr std::size_t most_folders = 40;
  std::string_view path = import.substr(import.find(":/") + 2);
  if (constexpr std::string_view resource = "resource/"; path.starts_with(resource)) {
    path.remove_prefix(std::min(path.size(), path.find('/', resource.size())));
  }
  path.remove_prefix(std::min(path.size(), path.find_first_not_of('/')));
  std::string folder = sources_.names[from];
  for (std::size_t i = 0; i < most_folders && !folder.empty(); ++i) {
    const std::size_t slash = folder.find_last_of("/\\");
    folder.erase(slash == std::string::npos ? 0 : slash);
    const std::string wanted =
        beside("", folder.empty() ? std::string{path} : fmt::format("{}/{}", folder, path));
    if (const auto known = files_.find(wanted); known != files_.end()) {
      return known->second;
    }
    if (auto text = load_ ? load_(wanted) : tl::unexpected{std::string{}}) {
      return add(wanted, std::move(*text), {from, {}});
    }
  }
  return std::nullopt;
}

/// A version is that of the nearest import that has one.
void Loader::find_versions() {
  std::map<std::uint32_t, FdeplSource*> by_file;
  for (FdeplSource& source : sources_.fdepl) {
    by_file[source.file] = &source;
  }
  for (bool changed = true; changed;) {
    changed = false;
    for (FdeplSource& source : sources_.fdepl) {
      for (const std::uint32_t file : source.imports) {
        const auto other = by_file.find(file);
        if (source.version == 0 && other != by_file.end() && other->second->version != 0) {
          source.version = other->second->version;
          changed = true;
        }
      }
    }
  }
}

void Loader::tell_of_circles() {
  enum class State : std::uint8_t { fresh, open, done };
  std::vector<State> states(imports_.size(), State::fresh);
  struct Step {
    std::uint32_t file;
    std::size_t next = 0;
  };
  for (std::uint32_t start = 0; start < imports_.size(); ++start) {
    if (states[start] != State::fresh) {
      continue;
    }
    std::vector<Step> path{{start}};
    states[start] = State::open;
    while (!path.empty()) {
      Step& step = path.back();
      if (step.next == imports_[step.file].size()) {
        states[step.file] = State::done;
        path.pop_back();
        continue;
      }
      const auto [file, place] = imports_[step.file][step.next++];
      if (states[file] == State::open) {
        findings_.warning(
            place, fmt::format("the imports form a cycle: {} imports this file, itself or through others",
                               documents::quote_path(sources_.names[file])));
      } else if (states[file] == State::fresh) {
        states[file] = State::open;
        path.push_back({file});
      }
    }
  }
}

}  // namespace

std::string beside(std::string_view file, std::string_view import) {
  std::string path{import};
  std::ranges::replace(path, '\\', '/');
  const std::size_t slash = file.find_last_of("/\\");
  if (!path.starts_with('/') && slash != std::string_view::npos) {
    path = std::string{file.substr(0, slash + 1)} + path;
    std::ranges::replace(path, '\\', '/');
  }
  std::vector<std::string_view> parts;
  const bool absolute = path.starts_with('/');
  for (std::size_t at = 0; at < path.size();) {
    const std::size_t end = std::min(path.find('/', at), path.size());
    const std::string_view part = std::string_view{path}.substr(at, end - at);
    if (part == ".." && !parts.empty() && parts.back() != "..") {
      parts.pop_back();
    } else if (part == ".." ? !absolute : !part.empty() && part != ".") {
      parts.push_back(part);
    }
    at = end + 1;
  }
  std::string result = absolute ? "/" : "";
  for (const std::string_view part : parts) {
    result += (result.empty() || result == "/" ? "" : "/") + std::string{part};
  }
  return result;
}

Sources load_sources(std::span<const SourceText> files, const Load& load, const FidlLimits& limits,
                     Problems& findings) {
  return Loader{load, limits, findings}.all(files);
}

}  // namespace trestle::describe::fidl
