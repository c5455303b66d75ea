#include "bridge/carry/config/load_interfaces.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>

#include "bridge/describe/model_source.hpp"
#include "bridge/describe/sources/sources.hpp"
#include "bridge/describe/system.hpp"
#include "bridge/describe/write/routes/route_entries.hpp"
#include "bridge/documents/document.hpp"
#include "bridge/documents/section.hpp"

namespace trestle::carry {
namespace {

using describe::Side;

/// What `generate` says.
struct Generate {
  bool all = false;
  std::vector<std::string> services{};  ///< by name or full name; empty: all
  describe::RouteOptions options{};
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
  section.finish();
  return generate;
}

std::vector<std::string> paths_of(const YAML::Node& node, const std::string& file,
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
  }
  return paths;
}

/// A member that a `someip` names.
struct Named {
  const describe::Service* service = nullptr;
  std::string member;
};

class Expansion {
 public:
  Expansion(const describe::System& system, documents::Problems& problems)
      : system_{system}, problems_{problems} {}

  /// Replaces `someip` in the elements of a list.
  void expand(YAML::Node list, const std::string& name) {
    if (!list.IsSequence()) {
      return;  // the loader of the list says so
    }
    for (YAML::Node element : list) {
      if (element.IsMap() && element["someip"].IsDefined()) {
        expand_one(element, name);
      }
    }
  }

 private:
  void expand_one(YAML::Node element, const std::string& list) {
    const YAML::Node someip = element["someip"];
    const documents::Mark mark = documents::to_mark(someip.Mark());
    if (!someip.IsScalar()) {
      problems_.error(mark, "someip: expected SERVICE.MEMBER, such as Door.moved");
      return;
    }
    const std::string text = someip.Scalar();
    element.remove("someip");
    const std::optional<Named> named = find(text, mark);
    if (!named) {
      return;
    }
    const describe::Instance* instance = instance_of(*named->service, element, mark);
    if (instance == nullptr) {
      return;
    }
    std::vector<describe::NotCarried> lost;
    const std::string full = named->service->name + "." + named->member;
    const std::vector<describe::RouteEntry> entries = describe::route_entries(
        system_.model, system_.lowered, *named->service, *instance, side_of(element, *instance), {},
        describe::offer_port(*instance, 30501), lost);
    const auto entry = std::ranges::find(entries, full, &describe::RouteEntry::element);
    if (entry == entries.end()) {
      problems_.error(mark, lost.empty() ? fmt::format("someip: {} cannot be carried", documents::quote(text))
                                         : fmt::format("someip: {} cannot be carried: {}",
                                                       documents::quote(text), lost.front().what));
      return;
    }
    if (entry->list != list && !(list == "routes" && entry->list == "fields")) {
      problems_.error(mark, fmt::format("someip: {} belongs into {}", documents::quote(text), entry->list));
      return;
    }
    for (const auto& pair : entry->node) {
      const std::string& key = pair.first.Scalar();
      // The notifier of a field as a topic has no getter and no setter.
      const bool of_field = entry->list != list && (key == "getter" || key == "setter" || key == "server");
      if (!of_field && !element[key].IsDefined() && key != "topic" && key != "ros_service") {
        element[key] = pair.second;
      }
    }
    // A name that the file leaves open is that of the description.
    for (const char* key : {"topic", "ros_service"}) {
      if (entry->node[key].IsDefined() && !element[key].IsDefined()) {
        element[key] = entry->node[key];
      }
    }
  }

  std::optional<Named> find(const std::string& text, documents::Mark mark) {
    const std::size_t dot = text.rfind('.');
    std::optional<Named> found;
    std::vector<std::string> known;
    for (const describe::Service& service : system_.model.services) {
      const auto add = [&](const auto& members) {
        for (const auto& member : members) {
          known.push_back(service.name + "." + member.name);
        }
      };
      add(service.methods);
      add(service.events);
      add(service.fields);
      if (dot == std::string::npos) {
        continue;
      }
      const std::string of = text.substr(0, dot);
      if (of != service.name && of != describe::full_name(service.scope, service.name)) {
        continue;
      }
      const std::string member = text.substr(dot + 1);
      if (std::ranges::find(known, service.name + "." + member) != known.end()) {
        if (found) {
          problems_.error(mark, fmt::format("someip: there are {} and {}: write the full name",
                                            describe::full_name(found->service->scope, found->service->name),
                                            describe::full_name(service.scope, service.name)));
          return std::nullopt;
        }
        found = Named{&service, member};
      }
    }
    if (found) {
      return found;
    }
    const std::string likely = documents::nearest(text, known);
    problems_.error(mark,
                    fmt::format("someip: the interfaces have no {}{}", documents::quote(text),
                                likely.empty() ? "" : "; did you mean " + documents::quote(likely) + "?"));
    return std::nullopt;
  }

  const describe::Instance* instance_of(const describe::Service& service, const YAML::Node& element,
                                        documents::Mark mark) {
    const std::string full = describe::full_name(service.scope, service.name);
    const YAML::Node wanted = element["instance"];
    const auto number =
        wanted.IsDefined() && wanted.IsScalar() ? documents::read_whole(wanted.Scalar()) : std::nullopt;
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
  documents::Problems& problems_;
};

}  // namespace

bool apply_interfaces(YAML::Node& root, const std::string& file, messages::TypePlaces& types,
                      documents::Problems& problems, std::vector<documents::Problem>& of_interfaces) {
  if (!root.IsMap()) {
    return true;
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
    }
    return true;
  }
  const documents::Mark mark = documents::to_mark(interfaces.Mark());
  std::vector<documents::Problem> unreadable;
  const std::vector<describe::SourceText> sources =
      describe::load_sources(paths_of(interfaces, file, problems), unreadable);
  for (const documents::Problem& problem : unreadable) {
    problems.error(mark, fmt::format("interfaces: {} {}", documents::quote(problem.file), problem.text));
  }
  if (problems.has_errors()) {
    return false;
  }
  describe::IdLock lock;
  describe::System system =
      describe::make_system(describe::read_sources(sources, describe::file_loader()), lock);
  of_interfaces = system.problems;
  if (!system.good) {
    problems.error(mark, "interfaces: are not good");
    return false;
  }
  if (!lock.services.empty()) {
    problems.warning(mark,
                     fmt::format("interfaces: ids are missing, of {} and maybe others: they were chosen; "
                                 "`trestle generate --to routes` writes and keeps them",
                                 documents::quote(lock.services.begin()->first)));
  }
  types.described.push_back(std::make_shared<describe::ModelSource>(
      system.lowered, sources.size() == 1 ? sources.front().name : "the interfaces"));
  Expansion expansion{system, problems};
  for (const char* list : {"routes", "methods", "fields"}) {
    if (root[list].IsDefined()) {
      expansion.expand(root[list], list);
    }
  }
  if (!generate.all) {
    return true;
  }
  for (const std::string& name : generate.services) {
    if (std::ranges::none_of(system.model.services, [&](const describe::Service& service) {
          return name == service.name || name == describe::full_name(service.scope, service.name);
        })) {
      problems.error(documents::to_mark(wish.Mark()),
                     fmt::format("generate: the interfaces have no service {}", documents::quote(name)));
    }
  }
  std::vector<describe::NotCarried> lost;
  for (const describe::RouteEntry& entry :
       describe::route_entries(system.model, system.lowered, generate.options, lost)) {
    const bool wanted =
        generate.services.empty() || std::ranges::any_of(generate.services, [&](const std::string& name) {
          return name == entry.service || name == entry.element.substr(0, entry.element.rfind('.'));
        });
    // What is there and no list is told of by its loader.
    if (wanted && (!root[entry.list].IsDefined() || root[entry.list].IsSequence())) {
      root[entry.list].push_back(entry.node);
    }
  }
  for (const describe::NotCarried& one : lost) {
    problems.warning(mark, fmt::format("interfaces: not carried: {}: {}", one.element, one.what));
  }
  return true;
}

}  // namespace trestle::carry
