#include "bridge/generate/source_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string_view>
#include <tuple>
#include <utility>

#include "bridge/cli/terminal.hpp"
#include "bridge/describe/join.hpp"
#include "bridge/describe/sources/ros_types.hpp"
#include "bridge/describe/sources/sources.hpp"
#include "bridge/documents/document.hpp"
#include "bridge/documents/format.hpp"
#include "bridge/documents/quote_path.hpp"
#include "bridge/documents/replace_file.hpp"
#include "bridge/documents/section.hpp"
#include "bridge/documents/utf8.hpp"
#include "bridge/generate/capture_model.hpp"
#include "bridge/generate/live_sources.hpp"
#include "bridge/messages/types/names.hpp"

namespace trestle::generate {
namespace {

constexpr std::string_view network_word = "network";
constexpr std::string_view ros_word = "ros";

bool is_route_file(const std::string& name) {
  return name.ends_with(".yaml") || name.ends_with(".yml");
}

void add_reading(describe::Reading& into, describe::Reading more) {
  describe::append(into.model, std::move(more.model));
  into.problems.insert(into.problems.end(), more.problems.begin(), more.problems.end());
}

}  // namespace

bool is_capture(const std::string& name) {
  return name.ends_with(".pcap") || name.ends_with(".pcapng") || name.ends_with(".cap");
}

SourceForm form_of(const std::string& source) {
  std::error_code ignored;
  if (is_capture(source)) {
    return SourceForm::capture;
  }
  if (std::filesystem::exists(source, ignored)) {
    return is_route_file(source) && !std::filesystem::is_directory(source, ignored) ? SourceForm::route_file
                                                                                    : SourceForm::file;
  }
  if (source == network_word || source.starts_with(std::string{network_word} + ":")) {
    return SourceForm::network;
  }
  if (source == ros_word || source.starts_with(std::string{ros_word} + ":")) {
    return SourceForm::ros;
  }
  if (is_route_file(source)) {
    return SourceForm::route_file;
  }
  if (messages::is_topic_name(source)) {
    return SourceForm::topic;
  }
  return messages::interface_name(source) ? SourceForm::type : SourceForm::file;
}

void SourceArguments::add_to(CLI::App& command) {
  command
      .add_option(
          "SOURCE", sources,
          "Files (FIDL, FDEPL, ARXML, vsomeip JSON, .msg, .srv, .action, .idl, a route file, a capture), "
          "folders of such files, names of ROS types or live topics, network, ros; see below")
      ->required();
  command.add_option("--types", type_folders_, "Folder with packages of ROS types")->type_name("DIR");
  command
      .add_option("--lock", lock_file_, "File that keeps the chosen ids (default: ids.lock beside SOURCE)")
      ->type_name("FILE");
  command.add_flag("--keep-event-ids", keep_event_ids_,
                   "Keep event ids of ARXML as they are (default: ids below 0x8000 get bit 15)");
  cli::option(command, "--for", seconds_, "SECONDS", "How long to listen to live sources",
              cli::number_between(0.1, 86400));
  network.add_group_to(command);
}

std::string source_forms() {
  return "Sources:\n"
         "  Door.fidl car.arxml ...      a file, or a folder of files\n"
         "  bridge.yaml                  a route file of `trestle bridge`\n"
         "  drive.pcapng                 a capture: ids, versions, endpoints, eventgroups, sizes\n"
         "  sensor_msgs/msg/PointCloud2  a ROS type, which becomes a service; also .msg, .srv, .action, "
         ".idl\n"
         "  /points                      a topic, service or action of running ROS nodes (also ros, "
         "ros:DOMAIN: all)\n"
         "  network                      a running SOME/IP network (also network:eth0, network:192.168.1.10)";
}

/// What is running is listened to once, whatever of it is asked for.
void SourceArguments::read_live(describe::Reading& into) const {
  const auto add = [&](describe::Reading one) { add_reading(into, std::move(one)); };
  std::map<std::optional<std::uint32_t>, std::vector<std::string>> domains;
  std::vector<describe::RosInterface> interfaces;
  for (const std::string& source : sources) {
    const std::size_t colon = source.find(':');
    const std::string detail = colon == std::string::npos ? std::string{} : source.substr(colon + 1);
    switch (form_of(source)) {
      case SourceForm::network:
        add(listen_to_network(detail, network, seconds_));
        break;
      case SourceForm::ros: {
        std::optional<std::uint32_t> domain;
        if (colon != std::string::npos) {
          const auto number = documents::whole_number(0, 232).read(detail);
          if (!number) {
            throw CLI::ValidationError{
                "SOURCE",
                fmt::format("{}: expected ros:DOMAIN, a number from 0 to 232", documents::quote(source))};
          }
          domain = static_cast<std::uint32_t>(*number);
        }
        domains[domain].clear();
        break;
      }
      case SourceForm::topic:
        if (const auto [at, is_new] = domains.try_emplace(std::nullopt); is_new || !at->second.empty()) {
          at->second.push_back(source);
        }
        break;
      case SourceForm::type:
        interfaces.push_back({.type = source});
        break;
      case SourceForm::file:
      case SourceForm::capture:
      case SourceForm::route_file:
        break;
    }
  }
  for (const auto& [domain, names] : domains) {
    const std::string place = domain ? fmt::format("ros:{}", *domain) : "ros";
    const std::vector<dds::FoundWriter> graph = readers_.ros(domain, seconds_);
    const std::vector<describe::RosInterface> found = interfaces_of(graph, names, place);
    for (const std::string& name : names) {
      if (std::ranges::find(found, name, &describe::RosInterface::name) == found.end()) {
        into.problems.push_back(
            {.file = place,
             .mark = {},
             .text = fmt::format("no node publishes or serves {} (within {} s)", name, seconds_)});
      }
    }
    const std::vector<std::string> brought =
        names.empty() ? brought_by_bridges(graph) : std::vector<std::string>{};
    if (!brought.empty()) {
      into.problems.push_back(
          {.severity = documents::Problem::Severity::warning,
           .file = place,
           .mark = {},
           .text = fmt::format("left out: {}: only bridges publish or serve {}, so SOME/IP has {} already; "
                               "name it as a SOURCE to make a service of it nevertheless",
                               fmt::join(brought, ", "), brought.size() == 1 ? "it" : "them",
                               brought.size() == 1 ? "it" : "them")});
    }
    if (found.empty() && brought.empty() && names.empty()) {
      into.problems.push_back(
          {.severity = documents::Problem::Severity::warning,
           .file = place,
           .mark = {},
           .text = fmt::format("no topic, service or action was seen in {} s", seconds_)});
    }
    interfaces.insert(interfaces.end(), found.begin(), found.end());
  }
  if (!interfaces.empty()) {
    messages::TypeLibrary library = messages::TypeLibrary::in({.folders = type_folders_});
    add(describe::describe_ros(interfaces, library));
  }
}

SourceArguments::Opened SourceArguments::open() {
  Opened opened;
  std::vector<std::string> files;
  describe::Reading others;
  for (const std::string& source : sources) {
    const SourceForm form = form_of(source);
    if (form == SourceForm::capture) {
      add_reading(others, read_capture(source));
    } else if (form == SourceForm::route_file) {
      add_reading(others, readers_.route_file(source));
    } else if (form == SourceForm::file) {
      files.push_back(source);
    }
  }
  read_live(others);
  if (keeps_ids && !output_folder.empty()) {
    // Now, as listening may take long, and folders of sources may have this one in them.
    output_lock_ = std::make_unique<FolderLock>(output_folder);
  }
  opened.texts = describe::load_sources(files, opened.problems);
  opened.captured = std::move(others.model);
  opened.problems.insert(opened.problems.end(), others.problems.begin(), others.problems.end());
  return opened;
}

describe::System SourceArguments::read(const Change& change) {
  Opened opened = open();
  for (const describe::SourceText& text : opened.texts) {
    files_.push_back(text.name);
  }
  describe::Reading reading =
      describe::read_sources(opened.texts, describe::file_loader(),
                             {.set_event_bit = !keep_event_ids_, .type_folders = type_folders_});
  reading.problems.insert(reading.problems.begin(), opened.problems.begin(), opened.problems.end());
  if (!opened.captured.files.empty() && reading.ok()) {
    describe::append(reading.model, std::move(opened.captured));
    describe::join_again(reading.model, reading.problems);
  }
  if (change && reading.ok()) {
    const std::vector<documents::Problem> faults = change(reading.model);
    reading.problems.insert(reading.problems.end(), faults.begin(), faults.end());
  }
  if (keeps_ids) {
    lock_ids();
  }
  read_lock(reading.problems);
  describe::System system = make_system(std::move(reading), lock_, options);
  if (!new_ids()) {
    id_locks_.clear();  // so that runs that only read the ids do not wait for each other
  }
  print_problems(system.problems);
  const describe::OpenIds open = describe::open_ids_of(system.model, kept_, lock_, sources);
  const bool is_beside = kept_.files != std::vector{lock_file_} && kept_.files != std::vector{own_lock()};
  if (!open.kept.empty() && (is_beside || open.forgotten)) {
    fmt::print(stderr, "note: {}\n", open.kept);
  }
  if (!open.chosen.empty() && open.forgotten) {  // else they are marked in what is made
    fmt::print(stderr, "note: {}\n", open.chosen);
  }
  return system;
}

void SourceArguments::read_lock(std::vector<documents::Problem>& problems) {
  std::error_code ignored;
  if (lock_file_.empty()) {
    kept_ = describe::load_kept_ids(paths(), problems);
  } else if (std::filesystem::exists(lock_file_, ignored)) {
    describe::add_kept_ids(lock_file_, kept_, problems);
  }
  lock_ = kept_.lock;
}

/// Where ids may be kept: beside all files that are read, those that a route file names included, and in the
/// folder of the output.
std::vector<std::string> SourceArguments::paths() const {
  std::vector<std::string> all;
  for (const std::string& source : sources) {
    const SourceForm form = form_of(source);
    if (form == SourceForm::file || form == SourceForm::route_file) {
      all.push_back(source);
    }
    if (form == SourceForm::route_file && readers_.types_of_route_file) {
      const std::vector<std::string> theirs = readers_.types_of_route_file(source).interfaces;
      all.insert(all.end(), theirs.begin(), theirs.end());
    }
  }
  if (!output_folder.empty()) {
    all.push_back(output_folder);
  }
  return all;
}

std::string SourceArguments::own_lock() const {
  return output_folder.empty()
             ? std::string{}
             : (std::filesystem::path{output_folder} / describe::kept_ids_name).lexically_normal().string();
}

std::optional<Page::Settings> SourceArguments::load() {
  Opened opened = open();
  // Imports are read now: the page opens no file.
  Page::Settings settings{.files = opened.texts, .captured = std::move(opened.captured)};
  settings.set_event_bit = !keep_event_ids_;
  settings.type_folders = type_folders_;
  // Of the page's own files only names are known.
  for (const describe::SourceText& file : opened.texts) {
    const auto folder = describe::kind_of(file.name, file.text) == describe::SourceKind::ros
                            ? describe::ros_package_folder(file)
                            : std::nullopt;
    if (folder && std::ranges::find(settings.type_folders, *folder) == settings.type_folders.end()) {
      settings.type_folders.push_back(*folder);
    }
  }
  const describe::Load load = describe::file_loader();
  std::ignore = describe::read_sources(opened.texts, [&](const std::string& name) {
    auto text = load(name);
    if (text) {
      settings.files.push_back({name, *text});
    }
    return text;
  });
  for (describe::SourceText& file : settings.files) {  // the page sends and gets them as JSON, which is UTF-8
    if (describe::kind_of(file.name, file.text) != describe::SourceKind::arxml) {
      if (auto warning = documents::make_utf8(file.text, file.name)) {
        opened.problems.push_back(std::move(*warning));
      }
    }
  }
  read_lock(opened.problems);
  settings.lock = lock_;
  print_problems(opened.problems);
  const bool bad = std::ranges::any_of(opened.problems, [](const documents::Problem& one) {
    return one.severity == documents::Problem::Severity::error;
  });
  return bad ? std::nullopt : std::optional{std::move(settings)};
}

describe::TypeOrigins SourceArguments::origins_of_types(bool only_of_ros) const {
  describe::TypeOrigins origins;
  const auto add = [](std::vector<std::string>& to, const std::string& path) {
    if (std::ranges::find(to, path) == to.end()) {
      to.push_back(path);
    }
  };
  for (const std::string& source : sources) {
    switch (form_of(source)) {
      case SourceForm::file:
        if (!only_of_ros || describe::has_ros_files(source)) {
          add(origins.interfaces, source);
        }
        break;
      case SourceForm::route_file:
        if (readers_.types_of_route_file) {
          const describe::TypeOrigins theirs = readers_.types_of_route_file(source);
          for (const std::string& folder : theirs.folders) {
            add(origins.folders, folder);
          }
          for (const std::string& file : theirs.interfaces) {
            if (!only_of_ros || describe::has_ros_files(file)) {
              add(origins.interfaces, file);
            }
          }
        }
        break;
      case SourceForm::capture:  // has no types
      case SourceForm::network:
      case SourceForm::type:  // ROS 2 has these
      case SourceForm::ros:
      case SourceForm::topic:
        break;
    }
  }
  for (const std::string& folder : type_folders_) {
    add(origins.folders, folder);
  }
  return origins;
}

/// Of files in other folders than that of the output, which is locked already. Sorted, so that no two runs
/// wait for each other.
void SourceArguments::lock_ids() {
  namespace fs = std::filesystem;
  std::error_code error;
  std::set<fs::path> folders;
  if (!lock_file_.empty()) {
    folders.insert(fs::weakly_canonical(fs::absolute(lock_file_), error).parent_path());
    if (!fs::is_directory(*folders.begin(), error)) {
      throw CLI::ValidationError{
          "--lock", fmt::format("{} cannot be written: there is no folder {}", lock_file_,
                                documents::quote_path(fs::path{lock_file_}.parent_path().string()))};
    }
  } else if (!output_folder.empty()) {
    for (const describe::KeptIdsFile& one : describe::kept_ids_files(paths())) {
      folders.insert(fs::canonical(one.file, error).parent_path());
    }
  }
  for (const fs::path& folder : folders) {
    if (output_folder.empty() || !fs::equivalent(folder, output_folder, error)) {
      id_locks_.push_back(std::make_unique<FolderLock>(folder));
    }
  }
}

std::optional<describe::SourceText> SourceArguments::new_ids() const {
  if ((lock_file_.empty() && output_folder.empty()) || lock_.services.empty()) {
    return std::nullopt;
  }
  describe::SourceText ids{!lock_file_.empty()       ? lock_file_
                           : kept_.files.size() == 1 ? kept_.files.front()
                                                     : own_lock(),
                           to_text(lock_)};
  return documents::read_text_file(ids.name) == ids.text ? std::nullopt : std::optional{std::move(ids)};
}

void SourceArguments::keep_ids() {
  if (const auto ids = new_ids()) {
    if (const auto written =
            documents::replace_file(ids->name, ids->text, documents::Outlives::a_power_failure);
        !written) {
      throw std::runtime_error{written.error()};
    }
  }
  id_locks_.clear();
}

void print_problems(const std::vector<documents::Problem>& problems) {
  const cli::Colours colour = cli::colours_for(STDERR_FILENO);
  for (const documents::Problem& problem : problems) {
    const bool error = problem.severity == documents::Problem::Severity::error;
    fmt::print(stderr, "{}{}{}\n", error ? colour.red : colour.yellow, to_string(problem), colour.off);
  }
}

}  // namespace trestle::generate
