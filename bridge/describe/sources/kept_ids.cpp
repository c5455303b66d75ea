#include "bridge/describe/sources/kept_ids.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <map>
#include <set>
#include <utility>

#include "bridge/describe/instance_index.hpp"
#include "bridge/documents/document.hpp"
#include "bridge/documents/problems.hpp"
#include "bridge/documents/quote_path.hpp"

namespace trestle::describe {
namespace {

namespace fs = std::filesystem;

std::string hex(std::uint16_t id) {
  return fmt::format("0x{:04x}", id);
}

/// Where a service stands in the text of a good file.
documents::Mark mark_of(const std::string& text, const std::string& service) {
  for (const YAML::Node& one : YAML::Load(text)["services"]) {
    if (one["name"].Scalar() == service) {
      return documents::to_mark(one.Mark());
    }
  }
  return {};
}

/// Adds the ids of members.
/// @return what contradicts those that are there; empty: nothing.
std::string join_members(const IdsByName& more, IdsByName& into) {
  for (const auto& member : more) {
    const auto other = std::ranges::find_if(
        into, [&](const auto& one) { return (one.first == member.first) != (one.second == member.second); });
    if (other != into.end()) {
      return fmt::format("{} of {} is {} of {}", hex(member.second), documents::quote(member.first),
                         hex(other->second), documents::quote(other->first));
    }
  }
  into.insert(more.begin(), more.end());
  return {};
}

/// Likewise of a service.
std::string join_service(const std::string& name, const LockedIds& more, IdLock& into) {
  const auto other = std::ranges::find_if(into.services, [&](const auto& one) {
    return more.service && one.second.service && (one.first == name) != (one.second.service == more.service);
  });
  if (other != into.services.end()) {
    return fmt::format("{} of {} is {} of {}", hex(*more.service), documents::quote(name),
                       hex(*other->second.service), documents::quote(other->first));
  }
  LockedIds& ids = into.services[name];
  ids.service = more.service ? more.service : ids.service;
  ids.base = more.base.empty() ? ids.base : more.base;
  std::string fault = join_members(more.methods, ids.methods);
  return fault.empty() ? join_members(more.events, ids.events) : fault;
}

/// What lies in a folder; nothing if it cannot be read.
std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> all;
  std::error_code error;
  for (fs::directory_iterator at{folder.empty() ? fs::path{"."} : folder, error};
       !error && at != fs::directory_iterator{}; at.increment(error)) {
    all.push_back(at->path().filename());
  }
  return all;
}

/// @param beside  the names of what lies in its folder
std::vector<std::string> with_those_of(const std::string& file, const std::vector<fs::path>& beside) {
  std::vector<std::string> all{file};
  const fs::path path{file};
  const bool is_fidl = path.extension() == ".fidl";
  for (const fs::path& other : beside) {
    const fs::path& fidl = is_fidl ? path : other;
    const fs::path& fdepl = is_fidl ? other : path;
    const std::string name = fidl.stem().string();
    const std::string deployment = fdepl.stem().string();
    // Not DoorLock.fdepl of Door.fidl.
    if (fidl.extension() == ".fidl" && fdepl.extension() == ".fdepl" && deployment.starts_with(name) &&
        (deployment == name ||
         std::string_view{"-_."}.find(deployment[name.size()]) != std::string_view::npos)) {
      all.push_back((path.parent_path() / other).string());
    }
  }
  std::ranges::sort(all, [](const std::string& one, const std::string& next) {
    return std::pair{!one.ends_with(".fidl"), one} < std::pair{!next.ends_with(".fidl"), next};
  });
  return all;
}

/// FDEPL files beside the FIDL files that were given, which were not.
std::vector<std::string> forgotten(const std::vector<std::string>& paths) {
  std::vector<std::string> all;
  std::error_code error;
  const auto was_given = [&](const std::string& file) {
    return std::ranges::any_of(paths, [&](const std::string& one) {
      return fs::equivalent(one, file, error) ||
             fs::equivalent(one, fs::path{file}.parent_path() / ".", error);
    });
  };
  std::map<fs::path, std::vector<fs::path>> folders;
  for (const std::string& path : paths) {
    if (!path.ends_with(".fidl")) {
      continue;
    }
    const auto [folder, is_new] = folders.try_emplace(fs::path{path}.parent_path());
    if (is_new) {
      folder->second = files_in(folder->first);
    }
    std::ranges::copy_if(with_those_of(path, folder->second), std::back_inserter(all),
                         [&](const std::string& file) {
                           return !was_given(file) && std::ranges::find(all, file) == all.end();
                         });
  }
  return all;
}

/// What has got another id than the one that was kept for it; empty: nothing.
std::string moved_id(const std::string& service, const LockedIds& before, const LockedIds& now,
                     const std::vector<std::string>& files) {
  const auto text = [&](const std::string& name, std::uint16_t was, std::uint16_t is) {
    return fmt::format("{} has had the id {} in {}, which something else has now: {} is taken", name,
                       hex(was), fmt::join(files, " or "), hex(is));
  };
  if (before.service && now.service && before.service != now.service) {
    return text(service, *before.service, *now.service);
  }
  for (const auto ids : {&LockedIds::methods, &LockedIds::events}) {
    for (const auto& [name, was] : before.*ids) {
      const auto is = (now.*ids).find(name);
      if (is != (now.*ids).end() && is->second != was) {
        return text(service + "." + name, was, is->second);
      }
    }
  }
  return {};
}

}  // namespace

void add_kept_ids(const std::string& file, KeptIds& into, std::vector<documents::Problem>& problems) {
  const auto text = documents::read_text_file(file);
  if (!text) {
    problems.push_back({.file = file, .mark = {}, .text = text.error()});
    return;
  }
  const auto lock = read_id_lock(file, *text, problems);
  if (!lock) {
    return;
  }
  if (into.files.empty()) {
    into = {*lock, {file}};
    return;
  }
  for (const auto& [name, ids] : lock->services) {
    if (const std::string fault = join_service(name, ids, into.lock); !fault.empty()) {
      problems.push_back(
          {.file = file,
           .mark = mark_of(*text, name),
           .text = fmt::format("{} in {}: remove one of both", fault, fmt::join(into.files, " or "))});
    }
  }
  into.files.push_back(file);
}

std::vector<KeptIdsFile> kept_ids_files(const std::vector<std::string>& paths) {
  std::vector<KeptIdsFile> files;
  std::set<fs::path> known;
  for (const std::string& path : paths) {
    std::error_code error;
    const fs::path folder = fs::is_directory(path, error) ? fs::path{path} : fs::path{path}.parent_path();
    const fs::path file = folder / kept_ids_name;
    if (fs::is_regular_file(file, error) && known.insert(fs::weakly_canonical(file, error)).second) {
      files.push_back({file.lexically_normal().string(), path});
    }
  }
  return files;
}

KeptIds load_kept_ids(const std::vector<std::string>& paths, std::vector<documents::Problem>& problems) {
  KeptIds kept;
  for (const auto& [file, beside] : kept_ids_files(paths)) {
    const std::size_t before = problems.size();
    add_kept_ids(file, kept, problems);
    if (problems.size() > before) {
      problems.back().text +=
          fmt::format(" (it is read because it lies beside {})", documents::quote_path(beside));
    }
  }
  return kept;
}

OpenIds open_ids_of(const Model& model, const KeptIds& kept, const IdLock& now,
                    const std::vector<std::string>& paths) {
  std::string moved;
  std::string of_kept;
  std::string of_chosen;
  const std::set<std::string, std::less<>> bases = only_bases(model);
  for (const Service& service : model.services) {
    const std::string name = full_name(service.scope, service.name);
    const auto at = now.services.find(name);
    if (at == now.services.end() || (bases.contains(name) && service.chosen_ids.empty())) {
      continue;  // everything in it that somebody uses has an id
    }
    const auto before = kept.lock.services.find(name);
    const LockedIds old = before == kept.lock.services.end() ? LockedIds{} : before->second;
    if (moved.empty()) {
      moved = moved_id(name, old, at->second, kept.files);
    }
    const auto is_used = [&](const IdsByName& ids) {
      return std::ranges::any_of(
          ids, [&](const auto& one) { return service.chosen_ids.contains(someip::MethodId{one.second}); });
    };
    if (of_kept.empty() &&
        ((service.id_is_chosen && old.service) || is_used(old.methods) || is_used(old.events))) {
      of_kept = name;
    }
    if (of_chosen.empty() && (at->second.service != old.service || at->second.methods != old.methods ||
                              at->second.events != old.events)) {
      of_chosen = name;
    }
  }
  const std::vector<std::string> beside =
      of_kept.empty() && of_chosen.empty() ? std::vector<std::string>{} : forgotten(paths);
  const std::string add = beside.empty() ? std::string{} : fmt::format("Add {}", fmt::join(beside, ", "));
  OpenIds open{.moved = std::move(moved), .forgotten = !beside.empty()};
  if (!of_kept.empty()) {
    open.kept = fmt::format(
        "ids are missing, of {} and maybe others: those of {} are used, which Trestle has "
        "chosen{}",
        documents::quote(of_kept), fmt::join(kept.files, ", "),
        add.empty() ? "" : ". " + add + ", which may have others");
  }
  if (!of_chosen.empty()) {
    open.chosen = fmt::format(
        "ids are missing, of {} and maybe others: they were chosen, and no other program knows "
        "them. {}",
        documents::quote(of_chosen),
        !add.empty() ? add + ", which was not given"
                     : "Add the file that has them, such as a FDEPL; if there is none, `trestle "
                       "generate --to routes` writes and keeps them");
  }
  return open;
}

LoadedSystem load_system(std::span<const SourceText> sources, const std::vector<std::string>& paths,
                         const SourceOptions& options) {
  LoadedSystem loaded;
  Reading reading = read_sources(sources, file_loader(), options);
  const KeptIds kept = load_kept_ids(paths, reading.problems);
  IdLock lock = kept.lock;
  loaded.system = make_system(std::move(reading), lock);
  loaded.open_ids = open_ids_of(loaded.system.model, kept, lock, paths);
  return loaded;
}

std::vector<std::string> with_those_beside(const std::string& file) {
  const fs::path path{file};
  const bool has_others = path.extension() == ".fidl" || path.extension() == ".fdepl";
  return with_those_of(file, has_others ? files_in(path.parent_path()) : std::vector<fs::path>{});
}

}  // namespace trestle::describe
