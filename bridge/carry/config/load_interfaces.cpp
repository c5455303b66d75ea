#include "bridge/carry/config/load_interfaces.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string_view>
#include <tuple>

#include "bridge/carry/config/elements.hpp"
#include "bridge/carry/config/id_names_of.hpp"
#include "bridge/describe/model_source.hpp"
#include "bridge/describe/package_faults.hpp"
#include "bridge/describe/read/vsomeip/read_vsomeip.hpp"
#include "bridge/describe/sources/kept_ids.hpp"
#include "bridge/describe/sources/sources.hpp"
#include "bridge/describe/system.hpp"
#include "bridge/describe/write/routes/action_entries.hpp"
#include "bridge/describe/write/routes/route_entries.hpp"
#include "bridge/documents/document.hpp"
#include "bridge/documents/quote_path.hpp"
#include "bridge/documents/section.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::carry {
namespace {

using describe::Side;

/// Entries that are made for one list. The loader of the lists refuses so many.
constexpr std::size_t generated_max = 1001;

/// The folders under `types: paths`, which may have what the interfaces are made of. What is wrong with them
/// is told elsewhere.
std::vector<std::string> type_folders(const YAML::Node& root, const std::string& file) {
  std::vector<std::string> folders;
  const YAML::Node types = root["types"];
  const YAML::Node paths = types.IsDefined() && types.IsMap() ? types["paths"] : YAML::Node{};
  if (paths.IsDefined() && paths.IsSequence()) {
    for (const YAML::Node& one : paths) {
      if (one.IsScalar()) {
        folders.push_back(
            (std::filesystem::path{file}.parent_path() / one.Scalar()).lexically_normal().string());
      }
    }
  }
  return folders;
}

/// What `generate` says.
struct Generate {
  bool all = false;
  std::vector<std::string> services{};  ///< by name or full name; empty: all
  describe::RouteOptions options{};
  std::vector<IpAddress> from_bridges{};  ///< of what the bridge offers
  documents::Mark from_bridges_mark{};
};

documents::Format<Side> side() {
  return documents::one_of<Side>({{"client", Side::client}, {"server", Side::server}});
}

Generate load_generate(const YAML::Node& node, documents::Problems& problems) {
  Generate generate;
  if (!node.IsDefined()) {
    return generate;
  }
  generate.all = true;
  if (node.IsScalar()) {
    if (node.Scalar() != "all") {
      problems.error(
          documents::to_mark(node.Mark()),
          fmt::format("generate: expected all, or a mapping, found {}", documents::quote(node.Scalar())));
    }
    return generate;
  }
  documents::Section section{node, "generate", problems};
  std::vector<documents::Mark> marks;
  section.read_list("services", documents::any_text("the name of a service"), generate.services, marks);
  if (Side which{}; section.read("side", side(), which)) {
    generate.options.side = which;
  }
  section.read("prefix", documents::any_text("what names of topics and services begin with"),
               generate.options.prefix);
  load_from_bridges(section, true, "", generate.from_bridges, problems);
  generate.from_bridges_mark = section.use_mark("from_bridges");
  section.finish();
  return generate;
}

/// @param marks  gets where each of them stands.
std::vector<std::string> paths_of(const YAML::Node& node, const std::string& file,
                                  std::map<std::string, documents::Mark>& marks,
                                  documents::Problems& problems) {
  std::vector<std::string> paths;
  if (!node.IsSequence() || node.size() == 0) {
    problems.error(documents::to_mark(node.Mark()),
                   "interfaces: expected a list of files, such as [Door.fidl]");
    return paths;
  }
  for (const YAML::Node& one : node) {
    if (!one.IsScalar() || one.Scalar().empty()) {
      problems.error(documents::to_mark(one.Mark()), "interfaces: expected the name of a file or folder");
      continue;
    }
    // An absolute path replaces the folder.
    paths.push_back((std::filesystem::path{file}.parent_path() / one.Scalar()).lexically_normal().string());
    marks.emplace(paths.back(), documents::to_mark(one.Mark()));
  }
  return paths;
}

/// The same with a mark at each node, as if it stood there: what is wrong in what was made is told at the
/// place that asked for it.
YAML::Node marked(const YAML::Node& node, documents::Mark mark) {
  const std::string place = std::string(static_cast<std::size_t>(std::max(mark.line - 1, 0)), '\n') +
                            std::string(static_cast<std::size_t>(std::max(mark.column - 1, 0)), ' ');
  if (node.IsMap()) {
    YAML::Node map = YAML::Load(place + "{}");
    for (const auto& pair : node) {
      map.force_insert(marked(pair.first, mark), marked(pair.second, mark));
    }
    return map;
  }
  if (node.IsSequence()) {
    YAML::Node list = YAML::Load(place + "[]");
    for (const YAML::Node& element : node) {
      list.push_back(marked(element, mark));
    }
    return list;
  }
  YAML::Node scalar = YAML::Load(place + "x");
  scalar = node.Scalar();
  return scalar;
}

/// The kinds of members that may stand in a list.
std::vector<describe::LoweredMember::Kind> kinds_of(std::string_view list) {
  using Kind = describe::LoweredMember::Kind;
  return list == "methods"  ? std::vector{Kind::method}
         : list == "fields" ? std::vector{Kind::field}
                            : std::vector{Kind::event, Kind::field};
}

const char* list_of(describe::LoweredMember::Kind kind) {
  using Kind = describe::LoweredMember::Kind;
  return kind == Kind::event ? "routes" : kind == Kind::method ? "methods" : "fields";
}

/// A member that a `someip` names.
struct Named {
  const describe::Service* service = nullptr;
  std::optional<someip::InstanceId> instance{};  ///< that it names, too
  describe::RouteMember member{};
};

/// A member of an instance that the file has an entry for: service, instance, list or notifier, name.
constexpr const char* notifier = "notifier";
using Taken = std::tuple<std::string, someip::InstanceId, std::string, std::string>;

class Expansion {
 public:
  Expansion(const describe::System& system, const describe::RouteOptions& options,
            documents::Problems& problems)
      : system_{system},
        entries_{system.model, system.lowered, options},
        problems_{problems},
        services_{system.model} {}

  /// Replaces `someip` in the elements of a list. What cannot be found is told of here and taken out: the
  /// loader of the list would miss all that the name stands for.
  /// @return whether something was taken out
  bool expand(YAML::Node root, const std::string& name) {
    const YAML::Node list = root[name];
    if (!list.IsSequence()) {
      return false;  // the loader of the list says so
    }
    YAML::Node kept = marked(YAML::Node{YAML::NodeType::Sequence}, documents::to_mark(list.Mark()));
    bool all = true;
    for (YAML::Node element : list) {
      if (!element.IsMap() || !element["someip"].IsDefined() || expand_one(element, name)) {
        kept.push_back(element);
      } else {
        all = false;
      }
    }
    if (all) {
      return false;
    }
    if (kept.size() == 0) {
      root.remove(name);
    } else {
      root[name] = kept;
    }
    return true;
  }

  /// Whether there was a `someip`.
  [[nodiscard]] bool names_any() const { return !taken_.empty(); }
  /// What an entry of the file does not name already: all, or a field without its notifier; nothing: no more.
  [[nodiscard]] std::optional<YAML::Node> rest_of(const describe::RouteEntry& entry) const {
    const auto is_taken = [&](const std::string& what) {
      return taken_.contains({entry.service, entry.instance, what, entry.member});
    };
    if (is_taken(entry.list)) {
      return std::nullopt;
    }
    YAML::Node node = entry.node;
    if (entry.list == "fields" && is_taken(notifier)) {
      for (const char* key : {"event", "eventgroup", "multicast", "e2e"}) {
        node.remove(key);
      }
      if (!node["getter"].IsDefined() && !node["setter"].IsDefined()) {
        return std::nullopt;
      }
    }
    return node;
  }

 private:
  /// @return false: an error was told.
  bool expand_one(YAML::Node element, const std::string& list) {
    const YAML::Node someip = element["someip"];
    const documents::Mark mark = documents::to_mark(someip.Mark());
    if (!someip.IsScalar()) {
      problems_.error(mark, "someip: expected SERVICE.MEMBER, such as Door.moved");
      return false;
    }
    const std::string text = someip.Scalar();
    element.remove("someip");
    const std::optional<Named> named = find(text, list, mark);
    if (!named) {
      return false;
    }
    const describe::Instance* instance = instance_of(*named, element, mark);
    if (instance == nullptr) {
      return false;
    }
    std::vector<describe::NotCarried> lost;
    const std::optional<describe::RouteEntry> entry =
        entries_.of(*named->service, *instance, side_of(element, *instance),
                    describe::offer_port(*instance, 30501), named->member, lost);
    if (!entry) {
      problems_.error(mark, lost.empty() ? fmt::format("someip: {} cannot be carried", documents::quote(text))
                                         : fmt::format("someip: {} cannot be carried: {}",
                                                       documents::quote(text), lost.front().what));
      return false;
    }
    if (entry->node["type"].Scalar().find("/action/") != std::string::npos) {
      problems_.error(mark,
                      fmt::format("someip: {} is a part of an action, which `generate` carries as a whole",
                                  documents::quote(text)));
      return false;
    }
    taken_.emplace(entry->service, entry->instance,
                   named->member.is_notifier_of_field ? notifier : list_of(named->member.kind),
                   entry->member);
    // A name that the file leaves open is that of the description.
    const bool has_map = element["map"].IsDefined();
    for (const auto& pair : marked(entry->node, mark)) {
      // The type of the topic is another one then.
      const std::string key = has_map && pair.first.Scalar() == "type" ? "payload" : pair.first.Scalar();
      if (!element[key].IsDefined()) {
        element.force_insert(key == pair.first.Scalar() ? pair.first : marked(YAML::Node{key}, mark),
                             pair.second);
      }
    }
    return true;
  }

  /// What of a service the list can carry: a member of its kinds, or a notifier as an event.
  static std::optional<describe::RouteMember> member_for(const std::string& list,
                                                         const describe::NamedMember& named) {
    using Part = describe::NamedMember::Part;
    const bool is_notifier = list == "routes" && named.kind == describe::LoweredMember::Kind::field;
    const auto kinds = kinds_of(list);
    if (std::ranges::find(kinds, named.kind) == kinds.end() ||
        (named.part != Part::whole && !(is_notifier && named.part == Part::notifier))) {
      return std::nullopt;
    }
    return describe::RouteMember{named.kind, named.index, is_notifier};
  }

  /// Members of the kinds that the list has.
  std::optional<Named> find(const std::string& text, const std::string& list, documents::Mark mark) {
    std::optional<Named> found;
    std::optional<describe::LoweredMember::Kind> elsewhere;
    for (const describe::NamedService& named : services_.find(text)) {
      const describe::Service& service = system_.model.services[named.service];
      std::optional<describe::RouteMember> here;
      for (const describe::NamedMember& member : describe::named_members(service, named.rest)) {
        here = here ? here : member_for(list, member);
        if (!elsewhere && member.part == describe::NamedMember::Part::whole) {
          elsewhere = member.kind;
        }
      }
      if (here && found) {
        problems_.error(mark, "someip: " + describe::several_services(*found->service, service));
        return std::nullopt;
      }
      found = here ? Named{&service, named.instance, *here} : found;
    }
    if (found) {
      return found;
    }
    if (elsewhere) {
      problems_.error(mark,
                      fmt::format("someip: {} belongs into {}", documents::quote(text), list_of(*elsewhere)));
      return std::nullopt;
    }
    constexpr std::size_t most_hints = 3000;  // names that are compared
    std::vector<std::string> known;
    for (const describe::Service& service : system_.model.services) {
      for (const std::string& member : describe::member_names(service)) {
        if (known.size() < most_hints) {
          known.push_back(service.name + "." + member);
        }
      }
    }
    const std::string likely = documents::nearest(text, known);
    problems_.error(mark,
                    fmt::format("someip: the interfaces have no {}{}", documents::quote(text),
                                likely.empty() ? "" : "; did you mean " + documents::quote(likely) + "?"));
    return std::nullopt;
  }

  const describe::Instance* instance_of(const Named& named, const YAML::Node& element, documents::Mark mark) {
    const describe::Service& service = *named.service;
    const std::string full = describe::full_name(service.scope, service.name);
    const YAML::Node wanted = element["instance"];
    auto number =
        wanted.IsDefined() && wanted.IsScalar() ? documents::read_whole(wanted.Scalar()) : std::nullopt;
    if (named.instance) {
      const std::uint16_t of_name = someip::value(*named.instance);
      if (wanted.IsDefined() && number != of_name) {
        problems_.error(
            mark, fmt::format("someip: it names the instance 0x{:04x}, and `instance` another one", of_name));
        return nullptr;
      }
      number = of_name;
    }
    const describe::Instance* found = nullptr;
    for (const describe::Instance& instance : system_.model.instances) {
      if (instance.service != full || !instance.id || (number && *number != someip::value(*instance.id))) {
        continue;
      }
      if (found != nullptr && found->id != instance.id) {
        problems_.error(mark, fmt::format("someip: {} has several instances: say which by `instance`",
                                          documents::quote(service.name)));
        return nullptr;
      }
      found = &instance;
    }
    if (found == nullptr) {
      problems_.error(mark, fmt::format("someip: {} has no {} instance", documents::quote(service.name),
                                        number ? "such" : "known"));
    }
    return found;
  }

  /// As the element says, else as the instance does.
  static Side side_of(const YAML::Node& element, const describe::Instance& instance) {
    if (const YAML::Node direction = element["direction"]; direction.IsDefined() && direction.IsScalar()) {
      return direction.Scalar() == "dds_to_someip" ? Side::server : Side::client;
    }
    if (const YAML::Node server = element["server"]; server.IsDefined() && server.IsScalar()) {
      return server.Scalar() == "ros" ? Side::server : Side::client;
    }
    return instance.role == describe::Instance::Role::provided ? Side::client : Side::server;
  }

  const describe::System& system_;
  describe::RouteEntries entries_;
  documents::Problems& problems_;
  describe::ServiceNames services_;
  std::set<Taken> taken_{};
};

/// Gives each `payload` of a route that is the short name of a type in the interfaces its full name.
void name_payloads(const YAML::Node& root, const describe::Lowered& lowered, documents::Problems& problems) {
  const YAML::Node routes = root["routes"];
  if (!routes.IsDefined() || !routes.IsSequence()) {
    return;
  }
  for (YAML::Node route : routes) {
    const YAML::Node payload = route.IsMap() ? route["payload"] : YAML::Node{};
    if (!payload.IsDefined() || !payload.IsScalar() || payload.Scalar().find('/') != std::string::npos) {
      continue;
    }
    const std::string name = payload.Scalar();
    std::vector<std::string> known;
    std::vector<std::string> found;
    for (const auto& [full, index] : lowered.by_name) {
      known.push_back(full.substr(full.rfind('/') + 1));
      if (known.back() == name && full.find("/msg/") != std::string::npos) {
        found.push_back(full);
      }
    }
    const documents::Mark mark = documents::to_mark(payload.Mark());
    if (found.size() == 1) {
      route["payload"] = marked(YAML::Node{found.front()}, mark);
    } else if (found.empty()) {
      const std::string likely = documents::nearest(name, known);
      problems.error(mark,
                     fmt::format("payload: the interfaces have no type {}{}", documents::quote(name),
                                 likely.empty() ? "" : "; did you mean " + documents::quote(likely) + "?"));
    } else {
      problems.error(mark, fmt::format("payload: several types have the name {}: write {} or {}",
                                       documents::quote(name), found[0], found[1]));
    }
  }
}

/// Whether the bridge takes it from ROS 2 to SOME/IP.
bool is_offered(const YAML::Node& entry) {
  const auto is = [&](const char* key, const char* word) {
    return entry[key].IsDefined() && entry[key].Scalar() == word;
  };
  return is("direction", "dds_to_someip") || is("server", "ros");
}

/// Adds what `generate` wishes to the lists, but for what the file has itself.
void add_generated(YAML::Node& root, const describe::System& system, const Generate& generate,
                   const Expansion& expansion, documents::Mark mark, documents::Problems& problems) {
  std::vector<describe::NotCarried> lost;
  std::vector<describe::RouteEntry> entries =
      describe::route_entries(system.model, system.lowered, generate.options, lost);
  describe::take_out(entries, [&](describe::RouteEntry& entry) {
    const std::string service = entry.element.substr(0, entry.element.size() - entry.member.size() - 1);
    const bool wanted =
        generate.services.empty() || std::ranges::any_of(generate.services, [&](const std::string& name) {
          return name == entry.service || name == service;
        });
    std::optional<YAML::Node> rest = wanted ? expansion.rest_of(entry) : std::nullopt;
    if (!rest) {
      return true;
    }
    entry.node.reset(*rest);
    return false;
  });
  // The parts of an action have types that stand in no other list.
  describe::join_actions(entries, lost);
  std::map<std::string, std::size_t> counts;
  bool offers = false;
  for (describe::RouteEntry& entry : entries) {
    // What is there and no list is told of by its loader; so are too many.
    if (root[entry.list].IsDefined() && !root[entry.list].IsSequence()) {
      continue;
    }
    if (is_offered(entry.node)) {
      offers = true;
      for (const IpAddress& bridge : generate.from_bridges) {
        entry.node["from_bridges"].push_back(someip::to_string(bridge));
      }
    }
    if (++counts[entry.list] <= generated_max) {
      root[entry.list].push_back(marked(entry.node, mark));
    }
  }
  if (!generate.from_bridges.empty() && !offers) {
    problems.error(generate.from_bridges_mark,
                   "from_bridges: is for what the bridge offers, and nothing is generated that it does; "
                   "`side: server` makes it");
  }
  for (const describe::NotCarried& one : lost) {
    problems.warning(mark, fmt::format("interfaces: not carried: {}: {}", one.element, one.what));
  }
}

}  // namespace

bool is_description(const std::string& file) {
  const describe::SourceKind kind = describe::kind_of(file, {});
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    return false;
  }
  if (kind == describe::SourceKind::vsomeip) {  // JSON, as a configuration may be
    return describe::is_vsomeip(describe::file_loader()(file).value_or(std::string{}));
  }
  return kind == describe::SourceKind::fidl || kind == describe::SourceKind::arxml;
}

tl::expected<std::string, std::vector<documents::Problem>> configuration_for(
    const std::vector<std::string>& descriptions) {
  std::vector<std::string> files;
  for (const std::string& one : descriptions) {
    for (const std::string& file : describe::with_those_beside(one)) {
      if (std::ranges::find(files, file) == files.end()) {
        files.push_back(file);
      }
    }
  }
  YAML::Emitter list;
  list << YAML::Flow << files;
  std::string text = fmt::format(
      "someip: {{address: 127.0.0.1}}  # of this host, in the network of the services\n"
      "interfaces: {}\n"
      "generate: all\n",
      list.c_str());
  YAML::Node root = YAML::Load(text);
  messages::TypePlaces types;
  documents::Problems problems{descriptions.front()};
  std::vector<documents::Problem> of_interfaces;
  const AppliedInterfaces applied = apply_interfaces(root, {}, types, problems, of_interfaces);
  if (!problems.has_errors()) {
    return text;
  }
  std::vector<documents::Problem> told = problems.take();
  for (documents::Problem& one : told) {
    one.mark = {};  // of a text that nobody has seen
  }
  const auto is_warning = [](const documents::Problem& one) {
    return one.severity == documents::Problem::Severity::warning;
  };
  if (!applied.good) {
    std::erase_if(of_interfaces, is_warning);
    return tl::unexpected{of_interfaces.empty() ? std::move(told) : std::move(of_interfaces)};
  }
  if (std::ranges::all_of(descriptions, [](const std::string& file) {
        return describe::kind_of(file, {}) == describe::SourceKind::vsomeip;
      })) {
    told = {{.file = descriptions.front(),
             .mark = {},
             .text = "is a configuration of vsomeip, which has ids and no types, so that a bridge can carry "
                     "nothing of it: name what has the types, too, such as "
                     "`trestle bridge Door.fidl Door.fdepl vsomeip.json`"}};
  } else {
    std::erase_if(told, std::not_fn(is_warning));  // why
    told.push_back({.file = descriptions.front(),
                    .mark = {},
                    .text = "is an interface description with nothing that a bridge can carry"});
  }
  return tl::unexpected{std::move(told)};
}

AppliedInterfaces apply_interfaces(YAML::Node& root, const std::string& file, messages::TypePlaces& types,
                                   documents::Problems& problems,
                                   std::vector<documents::Problem>& of_interfaces) {
  AppliedInterfaces applied;
  if (!root.IsMap()) {
    return applied;
  }
  const YAML::Node interfaces = root["interfaces"];
  const YAML::Node wish = root["generate"];
  const Generate generate = load_generate(wish, problems);
  // What the loader of the file finds is without them.
  root.remove("interfaces");
  root.remove("generate");
  if (!interfaces.IsDefined()) {
    if (generate.all) {
      problems.error(documents::to_mark(wish.Mark()), "generate: needs `interfaces`");
      applied.tells_of_routes = true;
    }
    return applied;
  }
  const documents::Mark mark = documents::to_mark(interfaces.Mark());
  std::vector<documents::Problem> unreadable;
  std::map<std::string, documents::Mark> marks;
  const std::vector<std::string> paths = paths_of(interfaces, file, marks, problems);
  const std::vector<describe::SourceText> sources = describe::load_sources(paths, unreadable);
  for (const documents::Problem& problem : unreadable) {
    const auto found = marks.find(problem.file);
    const documents::Mark at = found == marks.end() ? mark : found->second;
    std::error_code error;
    const bool is_there = std::filesystem::exists(problem.file, error);
    const std::string text =
        fmt::format("interfaces: {} {}{}", documents::quote_path(problem.file), problem.text,
                    is_there ? "" : "; names are taken from the folder of this file");
    if (problem.severity == documents::Problem::Severity::error) {
      problems.error(at, text);
    } else {
      problems.warning(at, text);
    }
  }
  // What is wrong with the others is told as well, but where nothing is there, no more is to be said.
  if (problems.has_errors() && sources.empty()) {
    applied.good = false;
    return applied;
  }
  const describe::LoadedSystem loaded =
      describe::load_system(sources, paths, {.type_folders = type_folders(root, file)});
  const describe::System& system = loaded.system;
  of_interfaces = system.problems;
  if (!system.good) {
    problems.error(mark, "interfaces: are not good");
  }
  if (problems.has_errors()) {
    applied.good = false;
    return applied;
  }
  applied.names = id_names_of(system.model);
  types.described.push_back(std::make_shared<describe::ModelSource>(
      system.lowered, sources.size() == 1 ? sources.front().name : "the interfaces"));
  for (const describe::PackageFault& fault : describe::faults_of_packages(system.model, system.lowered)) {
    if (fault.is_of_ros) {
      problems.warning(mark,
                       fmt::format("interfaces: their package {} has the name of one of ROS 2, which it "
                                   "hides: ROS nodes have other types under these names",
                                   documents::quote(fault.package)));
    }
  }
  Expansion expansion{system, generate.options, problems};
  const auto has_routes = [&root] {
    return std::ranges::any_of(std::array{"routes", "methods", "fields", "actions", "patterns"},
                               [&](const char* list) { return root[list].IsDefined(); });
  };
  if (!generate.all && !has_routes()) {
    problems.error(
        mark,
        "interfaces: nothing uses them: expected `generate: all`, or routes that name something, such as "
        "routes: [{someip: Door.moved}]");
    applied.tells_of_routes = true;
  }
  for (const char* list : {"routes", "methods", "fields"}) {
    if (root[list].IsDefined() && expansion.expand(root, list)) {
      applied.tells_of_routes = true;
    }
  }
  name_payloads(root, system.lowered, problems);
  // Where the interfaces only define types, no id of theirs is used.
  for (const std::string& line : {loaded.open_ids.kept, loaded.open_ids.chosen}) {
    if (!line.empty() && (generate.all || expansion.names_any())) {
      problems.warning(mark, "interfaces: " + line);
    }
  }
  if (!generate.all) {
    return applied;
  }
  std::vector<std::string> known;
  for (const describe::Service& service : system.model.services) {
    known.push_back(service.name);
  }
  for (const std::string& name : generate.services) {
    if (std::ranges::none_of(system.model.services, [&](const describe::Service& service) {
          return name == service.name || name == describe::full_name(service.scope, service.name);
        })) {
      const std::string likely = documents::nearest(name, known);
      problems.error(documents::to_mark(wish.Mark()),
                     fmt::format("generate: the interfaces have no service {}{}", documents::quote(name),
                                 likely.empty() ? "" : "; did you mean " + documents::quote(likely) + "?"));
      applied.tells_of_routes = true;
    }
  }
  applied.generated = documents::to_mark(wish.Mark());
  add_generated(root, system, generate, expansion, *applied.generated, problems);
  if (!has_routes() && !applied.tells_of_routes) {
    problems.error(*applied.generated, "generate: the interfaces have nothing that a bridge can carry");
    applied.tells_of_routes = true;
  }
  return applied;
}

}  // namespace trestle::carry
