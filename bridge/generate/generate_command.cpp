#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/options.hpp"
#include "bridge/cli/terminal.hpp"
#include "bridge/describe/join.hpp"
#include "bridge/describe/lower.hpp"
#include "bridge/describe/sources/sources.hpp"
#include "bridge/documents/format.hpp"
#include "bridge/documents/problems.hpp"
#include "bridge/documents/section.hpp"
#include "bridge/generate/generate_commands.hpp"
#include "bridge/generate/output_folder.hpp"
#include "bridge/generate/page_server.hpp"
#include "bridge/generate/service_inputs.hpp"
#include "bridge/generate/source_options.hpp"
#include "bridge/generate/targets.hpp"

namespace trestle::generate {
namespace {

namespace fs = std::filesystem;

struct GenerateArguments {
  SourceArguments sources;
  std::vector<std::string> to;
  std::string folder;
  ServiceInputs inputs;
  std::string prefix = "/";
  std::string listen = default_page_address;
  bool client = false;
  bool server = false;
  bool quiet = false;
  bool force = false;
  bool ui = false;
};

std::vector<const Target*> chosen(const std::vector<std::string>& names) {
  std::vector<const Target*> all;
  std::vector<std::string> known;
  for (const Target& one : targets()) {
    known.emplace_back(one.name);
  }
  for (const std::string& name : names) {
    const Target* found = target(name);
    if (found == nullptr) {
      const std::string likely = documents::nearest(name, known);
      throw CLI::ValidationError{
          "--to",
          fmt::format("there is no target {}{} There are: {}", documents::quote(name),
                      likely.empty() ? "." : fmt::format("; did you mean {}?", documents::quote(likely)),
                      fmt::join(known, ", "))};
    }
    all.push_back(found);
  }
  return all;
}

/// A path, seen from the folder that is written to, which may not be there yet.
std::string seen_from_output(const GenerateArguments& arguments, const std::string& path) {
  if (arguments.folder.empty()) {
    return path;
  }
  std::error_code error;
  const fs::path seen =
      fs::relative(path, fs::weakly_canonical(fs::absolute(arguments.folder), error), error);
  return error || seen.empty() ? fs::absolute(path).string() : seen.string();
}

/// Where a route file finds its types, seen from the folder that it is written to.
/// @param with_types  the messages that no ROS package has are written beside it.
void set_origins_of_types(const GenerateArguments& arguments, bool with_types,
                          describe::RouteFileOptions& options) {
  const auto seen_all = [&](const std::vector<std::string>& paths, std::vector<std::string>& into) {
    for (const std::string& path : paths) {
      into.push_back(seen_from_output(arguments, path));
    }
  };
  if (with_types) {
    options.type_paths.emplace_back(".");
  }
  const describe::TypeOrigins origins = arguments.sources.origins_of_types(with_types);
  seen_all(origins.folders, options.type_paths);
  seen_all(origins.interfaces, options.interfaces);
}

/// describe::GeneratedFile::origin of what is made for a target.
std::string origin_of(const Target& target, const GenerateArguments& arguments) {
  std::set<std::string> sources;
  for (const std::string& source : arguments.sources.sources) {
    const SourceForm form = form_of(source);
    const bool is_path =
        form == SourceForm::file || form == SourceForm::capture || form == SourceForm::route_file;
    sources.insert(is_path ? seen_from_output(arguments, source) : source);
  }
  return documents::printable(fmt::format("{} {}", target.name, fmt::join(sources, " ")));
}

TargetOptions target_options(const GenerateArguments& arguments) {
  TargetOptions options;
  options.routes.routes.prefix = arguments.prefix;
  if (arguments.client || arguments.server) {
    options.routes.routes.side = arguments.client ? describe::Side::client : describe::Side::server;
  }
  const std::string& address = arguments.inputs.address();
  if (!address.empty()) {
    options.routes.address = documents::ip_address().read(address);
    if (!options.routes.address) {
      throw CLI::ValidationError{"--address", fmt::format("{} is no IP address", documents::quote(address))};
    }
  }
  const std::string& multicast = arguments.sources.network.multicast();
  if (multicast != cli::NetworkOptions{}.multicast()) {
    options.routes.multicast = documents::multicast_address().read(multicast);
    if (!options.routes.multicast) {
      throw CLI::ValidationError{"--multicast",
                                 fmt::format("{} is no multicast address", documents::quote(multicast))};
    }
  }
  return options;
}

/// Why a target has no file, and what helps.
std::string_view why_nothing(const describe::Model& model) {
  const auto known = [](const describe::Payload& payload) { return payload.known; };
  bool has_members = false;
  for (const describe::Service& service : model.services) {
    has_members =
        has_members || !service.events.empty() || !service.methods.empty() || !service.fields.empty();
    if (std::ranges::any_of(service.events, known, &describe::Event::payload) ||
        std::ranges::any_of(service.methods, known, &describe::Method::request) ||
        std::ranges::any_of(service.fields, known, &describe::Field::payload)) {
      return "no service has anything that it can carry; the lines above say why";
    }
  }
  return has_members
             ? "the sources have ids and no types; add what describes the services, such as FIDL, ARXML or "
               "the types of ROS 2"
             : "the sources have no service with methods, events or fields";
}

/// Whether there are types under names that the sources do not give them.
bool has_new_types(const describe::Lowered& before, const describe::Lowered& now) {
  return std::ranges::any_of(now.members, [&](const describe::LoweredMember& member) {
    const bool is_method = member.kind == describe::LoweredMember::Kind::method;
    return before.definition(is_method ? member.type + "_Request" : member.type) == nullptr;
  });
}

int run_page(GenerateArguments& arguments) {
  const auto at = parse_page_address(arguments.listen);
  if (!at) {
    throw CLI::ValidationError{"--listen",
                               fmt::format("expected ADDR:PORT, such as {}, found {}", default_page_address,
                                           documents::quote(arguments.listen))};
  }
  const TargetOptions options = target_options(arguments);
  auto settings = arguments.sources.load();
  if (!settings) {
    return cli::exit_usage;
  }
  settings->targets = options;
  settings->targets.routes.type_paths = {"."};  // the page saves all together, as `-o` does
  for (const std::string& folder : settings->type_folders) {
    settings->targets.routes.type_paths.push_back(fs::absolute(folder).lexically_normal().string());
  }
  arguments.sources.network.set_address(arguments.inputs.address());
  return serve_page(*at, std::move(*settings), [&] { return arguments.sources.network.config(); });
}

int run_generate(GenerateArguments& arguments) {
  if (arguments.ui) {
    return run_page(arguments);
  }
  if (arguments.sources.sources.empty() || arguments.to.empty()) {
    throw CLI::RequiredError{arguments.sources.sources.empty() ? "SOURCE" : "--to"};
  }
  if (arguments.folder == "-") {  // as elsewhere: standard output
    arguments.folder.clear();
  }
  const std::vector<const Target*> wanted = chosen(arguments.to);
  TargetOptions options = target_options(arguments);
  arguments.inputs.writes_routes = std::ranges::find(arguments.to, "routes") != arguments.to.end();
  const bool with_types = std::ranges::find(arguments.to, "msg") != arguments.to.end();
  set_origins_of_types(arguments, with_types && wanted.size() > 1, options.routes);
  arguments.sources.output_folder = arguments.folder;
  arguments.sources.keeps_ids = true;
  arguments.sources.options.lowers = std::ranges::any_of(wanted, &Target::needs_lowered);
  const bool names_types_anew = arguments.inputs.writes_routes && !with_types && arguments.inputs.has_names();
  describe::Lowered before;
  const describe::System system = arguments.sources.read([&](describe::Model& model) {
    if (names_types_anew) {
      before = describe::lower(model);
    }
    return arguments.inputs.apply(model);
  });
  if (!system.good) {
    return cli::exit_usage;
  }
  const cli::Colours colour = cli::colours_for(STDERR_FILENO);
  if (names_types_anew && has_new_types(before, system.lowered)) {
    fmt::print(stderr,
               "{}error:{} --package, --name and similar options change the names of message types: expected "
               "`--to routes,msg`, so that the route file finds these\n",
               colour.red, colour.off);
    return cli::exit_usage;
  }
  std::vector<std::pair<const Target*, describe::Written>> results;
  for (const Target* one : wanted) {
    results.emplace_back(one, one->write(system, options));
  }
  if (arguments.folder.empty() && (results.size() > 1 || results.front().second.files.size() > 1)) {
    throw CLI::ValidationError{"-o", "a folder is needed: there is more than one file to write"};
  }
  std::optional<OutputFolder> folder;
  if (!arguments.folder.empty()) {
    std::vector<std::string> sources = arguments.sources.files();
    // What these import or name, too.
    sources.insert(sources.end(), system.model.files.begin(), system.model.files.end());
    std::vector<documents::Problem> problems;
    folder.emplace(arguments.folder, sources, arguments.force, problems);
    if (!problems.empty()) {
      print_problems(problems);
      return cli::exit_usage;
    }
    std::vector<const describe::TextFile*> files;
    for (const auto& [one, result] : results) {
      for (const describe::TextFile& file : result.files) {
        files.push_back(&file);
      }
    }
    folder->check(files);
  }
  // First, as what is written with ids that are not kept would have others the next time.
  if (std::ranges::any_of(results, [](const auto& one) { return !one.second.files.empty(); })) {
    arguments.sources.keep_ids();
  }
  std::set<std::string> origins;
  for (const auto& [one, result] : results) {
    const std::string origin = origin_of(*one, arguments);
    if (!result.files.empty() || result.not_carried.empty()) {
      origins.insert(origin);
    }
    for (const describe::TextFile& file : result.files) {
      if (!folder) {
        fmt::print("{}", file.text);
        continue;
      }
      const OutputFolder::Writing done = folder->write(file, origin);
      if (!arguments.quiet) {
        fmt::print(stderr, "{}{}{} {}\n", done.is_new ? colour.green : colour.dim,
                   done.is_new ? "wrote" : "unchanged", colour.off, folder->path_of(file).string());
      }
      if (!done.replaced.empty()) {
        fmt::print(stderr,
                   "{}warning:{} {} was made of other sources before (--to {}), which it does not have now: "
                   "name all sources together, or give each a folder\n",
                   colour.yellow, colour.off, folder->path_of(file).string(), done.replaced);
      }
    }
    for (const describe::NotCarried& lost : result.not_carried) {
      const std::string place = describe::to_string(system.model, lost.place);
      fmt::print(stderr, "{}{}{}not carried to {}:{} {}: {}\n", place, place.empty() ? "" : ": ",
                 colour.yellow, one->name, colour.off, lost.element, lost.what);
    }
  }
  if (folder) {
    for (const OutputFolder::Leftover& one : folder->finish(origins)) {
      if (one.why_kept.empty()) {
        fmt::print(stderr, "{}removed{} {}\n", colour.dim, colour.off, one.path.string());
      } else {
        fmt::print(stderr, "{}kept{} {}, which is no longer made: {}; remove it if nobody needs it\n",
                   colour.yellow, colour.off, one.path.string(), one.why_kept);
      }
    }
  }
  int status = cli::exit_ok;
  for (const auto& [one, result] : results) {
    if (result.files.empty() && result.not_carried.empty()) {
      if (!arguments.quiet) {
        fmt::print(stderr, "nothing to write to {}: ROS 2 has all types already\n", one->name);
      }
    } else if (result.files.empty()) {
      fmt::print(stderr, "{}nothing to write to {}{}: {}\n", colour.red, one->name, colour.off,
                 why_nothing(system.model));
      status = cli::exit_failure;
    }
  }
  return status;
}

}  // namespace

void add_generate_command(CLI::App& app, int& status, const SourceReaders& readers) {
  const auto arguments = std::make_shared<GenerateArguments>();
  arguments->sources = SourceArguments{readers};
  CLI::App* command = app.add_subcommand(
      "generate", "Generate route files, .msg packages, FIDL, ARXML and more from interface descriptions");
  arguments->sources.add_to(*command);
  command->get_option("SOURCE")->required(false);  // of --ui
  std::string names;
  for (const Target& one : targets()) {
    names += fmt::format("\n  {:10} {}", one.name, one.title);
  }
  CLI::Option* to = command->add_option("--to", arguments->to, "Targets, separated by commas; see below")
                        ->delimiter(',')
                        ->type_name("TARGET");
  command
      ->add_option("-o,--output", arguments->folder,
                   "Folder for the files; without it, or with -, a single file goes to standard output")
      ->type_name("DIR");
  command->add_option("--prefix", arguments->prefix, "Put before the names of topics and ROS services")
      ->type_name("NAME");
  CLI::Option* client =
      command->add_flag("--client", arguments->client,
                        "The bridge is client of all services (default: of those that the sources provide)");
  command
      ->add_flag("--server", arguments->server,
                 "The bridge offers all services (default: those that the sources require)")
      ->excludes(client);
  CLI::Option* ui =
      command
          ->add_flag("--ui", arguments->ui,
                     "Serve a local web page for all this, with SOURCE and files dropped onto it")
          ->excludes(to);
  command->add_option("--listen", arguments->listen, "Address and port of the page")
      ->type_name("ADDR:PORT")
      ->capture_default_str()
      ->needs(ui);
  command->add_flag("--force", arguments->force,
                    "Also replace files in DIR that were edited or not made by this command, but no sources");
  command->add_flag("-q,--quiet", arguments->quiet, "Do not list the files that were written");
  arguments->inputs.add_to(*command);
  command->get_option("--address")
      ->description(
          "Address of the instance; in route files, of the bridge; with --ui, the one that calls come from");
  command->footer(
      source_forms() + "\n\nTargets:" + names +
      "\n\nIds that the sources do not give are chosen, and kept in ids.lock for the next run: beside the "
      "sources\n"
      "where there is one, else in DIR.\n"
      "DIR/generated.lock lists what was written: a folder that is a source is read without it. What was "
      "made\n"
      "of the same sources before and is made no longer, as after a new --name, is removed unless it was "
      "edited.\n"
      "docs/describe.md is the guide. Examples:\n"
      "  trestle generate Door.fidl Door.fdepl --to routes,msg -o door\n"
      "  trestle generate car.arxml --to fidl,wireshark,sheet -o car\n"
      "  trestle generate drive.pcapng --to json\n"
      "  trestle generate --ui Door.fidl Door.fdepl\n"
      "  trestle generate sensor_msgs/msg/PointCloud2 --to fidl,routes -o cloud --service-id 0x1234 "
      "--udp-port "
      "30509\n"
      "  trestle generate /points --to routes,fidl -o points\n"
      "  trestle generate network:eth0 --for 30 --to vsomeip,sheet -o seen\n"
      "Exit status: 0, or 1 when a file cannot be written or there is nothing to write, or 2 when a source "
      "is wrong.");
  command->callback([arguments, &status] { status = run_generate(*arguments); });
}

}  // namespace trestle::generate
