#include "bridge/messages/types/type_library.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cstdlib>

#include "bridge/messages/types/builtin.hpp"

namespace trestle::messages {
namespace fs = std::filesystem;

/// What add() knows of the tree that it is building.
struct TypeLibrary::Resolving {
  TypeTree tree;
  std::map<std::string, std::size_t> done;  ///< index of finished messages in the tree
  std::vector<std::string> path;            ///< unfinished messages, from the root
};

TypeLibrary::TypeLibrary(const std::vector<fs::path>& folders, const std::vector<fs::path>& ament_prefixes) {
  for (const auto* const list : {&folders, &ament_prefixes}) {
    for (const fs::path& folder : *list) {
      sources_.push_back(std::make_shared<FolderSource>(folder));
    }
  }
  sources_.push_back(std::make_shared<BuiltinSource>());
}

TypeLibrary TypeLibrary::in(const TypePlaces& places) {
  TypeLibrary library{{places.folders.begin(), places.folders.end()}, ament_prefixes()};
  library.sources_.insert(library.sources_.begin(), places.described.begin(), places.described.end());
  return library;
}

TypeLibrary TypeLibrary::of(TypeSources sources) {
  TypeLibrary library;
  library.sources_ = std::move(sources);
  return library;
}

tl::expected<TypeTree, TypeError> TypeLibrary::resolve(std::string_view name) {
  const auto message = interface_name(name);
  if (!message) {
    return tl::unexpected{TypeError{
        {}, 0, 0, fmt::format("\"{}\" is no message type: expected pkg/msg/Type or pkg/Type", name)}};
  }
  Resolving resolving;
  if (auto root = add(message->full(), resolving); !root) {
    return tl::unexpected{std::move(root.error())};
  }
  return std::move(resolving.tree);
}

tl::expected<ServiceTypes, TypeError> TypeLibrary::resolve_service(std::string_view name) {
  const auto service = interface_name(name, InterfaceKind::service);
  const auto is_of_action = [](const InterfaceName& parts) {
    return parts.kind == InterfaceKind::action &&
           std::ranges::any_of(action_services, [&](auto suffix) { return parts.type.ends_with(suffix); });
  };
  if (!service || (service->kind != InterfaceKind::service && !is_of_action(*service))) {
    return tl::unexpected{
        TypeError{{}, 0, 0, fmt::format("\"{}\" is no service: expected pkg/srv/Name or pkg/Name", name)}};
  }
  auto request = resolve(service->full() + "_Request");
  if (!request) {
    return tl::unexpected{std::move(request.error())};
  }
  auto response = resolve(service->full() + "_Response");
  if (!response) {
    return tl::unexpected{std::move(response.error())};
  }
  return ServiceTypes{std::move(*request), std::move(*response)};
}

tl::expected<std::size_t, TypeError> TypeLibrary::add(const std::string& name, Resolving& resolving) {
  if (const auto done = resolving.done.find(name); done != resolving.done.end()) {
    return done->second;
  }
  const auto found = find(name);
  if (!found) {
    return tl::unexpected{found.error()};
  }
  MessageDefinition message = **found;
  if (const auto begun = std::ranges::find(resolving.path, name); begun != resolving.path.end()) {
    return tl::unexpected{TypeError{message.file, 0, 0,
                                    fmt::format("{} contains itself: {} > {}", name,
                                                fmt::join(begun, resolving.path.end(), " > "), name)}};
  }
  if (resolving.path.size() == max_type_depth || resolving.done.size() == max_messages_per_type) {
    return tl::unexpected{
        TypeError{message.file, 0, 0,
                  fmt::format("{} is made of too many messages: at most {} deep and {} in all",
                              resolving.path[0], max_type_depth, max_messages_per_type)}};
  }
  resolving.path.push_back(name);
  for (Field& field : message.fields) {
    if (field.type.primitive) {
      continue;
    }
    auto nested = add(field.type.message, resolving);
    if (!nested && nested.error().file.empty() && field.type.message.ends_with("/msg/Header")) {
      // ROS 1 files write Header for std_msgs/Header, and many files still do.
      field.type.message = "std_msgs/msg/Header";
      nested = add(field.type.message, resolving);
    }
    if (!nested) {
      TypeError error = std::move(nested.error());
      if (error.file.empty()) {  // not found: report the place where it is used
        error.file = message.file;
        error.line = field.line;
        error.column = field.column;
      }
      return tl::unexpected{std::move(error)};
    }
    field.type.message_index = *nested;
  }
  resolving.path.pop_back();
  const std::size_t index = resolving.tree.messages.size();
  resolving.tree.messages.push_back(std::move(message));
  resolving.done.emplace(name, index);
  return index;
}

tl::expected<const MessageDefinition*, TypeError> TypeLibrary::find(const std::string& name) {
  if (const auto known = known_.find(name); known != known_.end()) {
    return &known->second;
  }
  const auto message = interface_name(name);
  const auto interface = message ? defining_interface(*message) : std::nullopt;
  if (!interface) {
    const bool action = message && message->kind == InterfaceKind::action;
    return tl::unexpected{TypeError{{},
                                    0,
                                    0,
                                    fmt::format("{} is {}, not a message; its messages are {}{}, ...", name,
                                                action ? "an action" : "a service", name,
                                                action ? action_suffixes[0] : service_suffixes[0])}};
  }
  if (auto loaded = load(*interface); !loaded) {
    return tl::unexpected{std::move(loaded.error())};
  }
  const auto known = known_.find(name);
  assert(known != known_.end());  // load() has entered all names of this interface
  return &known->second;
}

tl::expected<void, TypeError> TypeLibrary::load(const InterfaceName& interface) {
  std::vector<std::string> places;
  for (std::size_t i = 0; i <= sources_.size(); ++i) {
    const TypeSource& source = i < sources_.size() ? *sources_[i] : made_;
    auto found = source.find(interface);
    if (!found) {
      return tl::unexpected{std::move(found.error())};
    }
    if (*found) {
      for (MessageDefinition& message : **found) {
        std::string key = message.name;
        known_.emplace(std::move(key), std::move(message));
      }
      return {};
    }
    if (std::string place = source.place(); !place.empty()) {
      places.push_back(std::move(place));
    }
  }
  return tl::unexpected{TypeError{
      {},
      0,
      0,
      fmt::format("unknown type {}: {}not among the built-in ones", interface.full(),
                  places.empty() ? "" : fmt::format("not found in {}, and ", fmt::join(places, ", ")))}};
}

void TypeLibrary::define(const InterfaceName& interface, std::string text) {
  made_.define(interface, std::move(text));
}

std::vector<std::string> TypeLibrary::builtin_names() {
  std::vector<std::string> names;
  for (const BuiltinDefinition& definition : builtin_definitions()) {
    names.emplace_back(definition.name);
  }
  return names;
}

std::vector<fs::path> ament_prefixes() {
  std::vector<fs::path> prefixes;
  const char* const variable = std::getenv("AMENT_PREFIX_PATH");  // NOLINT(concurrency-mt-unsafe)
  std::string_view rest = variable == nullptr ? "" : variable;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find(':'), rest.size());
    if (end > 0) {
      prefixes.emplace_back(rest.substr(0, end));
    }
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return prefixes;
}

}  // namespace trestle::messages
