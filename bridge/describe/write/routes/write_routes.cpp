#include "bridge/describe/write/routes/write_routes.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <string_view>

#include "bridge/describe/instance_index.hpp"
#include "bridge/describe/write/routes/action_entries.hpp"
#include "bridge/describe/write/routes/lost_names.hpp"
#include "bridge/describe/write/routes/lost_settings.hpp"
#include "bridge/documents/format.hpp"
#include "bridge/documents/problems.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::describe {
namespace {

/// Prints mappings that fit a line in one.
void emit(YAML::Emitter& out, const YAML::Node& node, bool flow) {
  if (node.IsMap()) {
    if (flow) {
      out << YAML::Flow;
    }
    out << YAML::BeginMap;
    for (const auto& pair : node) {
      out << YAML::Key << pair.first.Scalar() << YAML::Value;
      // What stands in a route is short, but for the rules of types.
      emit(out, pair.second, flow || pair.first.Scalar() != "wire" || pair.second.size() < 4);
    }
    out << YAML::EndMap;
  } else if (node.IsSequence()) {
    out << YAML::Flow << YAML::BeginSeq;
    for (const YAML::Node& element : node) {
      emit(out, element, true);
    }
    out << YAML::EndSeq;
  } else {
    out << node.Scalar();
  }
}

/// "[a, b]", in one line however long it is.
std::string list_of(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) {
    YAML::Emitter out;
    out << YAML::Flow << YAML::BeginSeq << name << YAML::EndSeq;  // quoted as within a list
    const std::string_view one{out.c_str(), out.size()};
    list += fmt::format("{}{}", list.empty() ? "" : ", ", one.substr(1, one.size() - 2));
  }
  return fmt::format("[{}]", list);
}

/// The ids of a route that nobody gave: "service, event". Empty: all were given.
std::string chosen_ids_of(const InstanceIndex& index, const RouteEntry& entry) {
  std::vector<std::string> chosen;
  const Service* const service = index.service(entry.service);
  if (service == nullptr) {
    return {};
  }
  if (service->id_is_chosen) {
    chosen.emplace_back("service");
  }
  if (std::ranges::any_of(index.of(*service), [&](const Instance* one) {
        return one->id_is_chosen && one->id == entry.instance;
      })) {
    chosen.emplace_back("instance");
  }
  for (const char* key : {"event", "eventgroup", "method", "getter", "setter"}) {
    const YAML::Node node = entry.node[key];
    const auto id = node.IsDefined() && node.IsScalar() ? documents::id_number(0, 0xffff).read(node.Scalar())
                                                        : std::nullopt;
    if (!id) {
      continue;
    }
    const auto number = static_cast<std::uint16_t>(*id);
    const bool is_group = std::string_view{key} == "eventgroup";
    const auto group = std::ranges::find(service->eventgroups, someip::EventgroupId{number}, &Eventgroup::id);
    if (is_group ? group != service->eventgroups.end() && group->id_is_chosen
                 : service->chosen_ids.contains(someip::MethodId{number})) {
      chosen.emplace_back(key);
    }
  }
  return fmt::format("{}", fmt::join(chosen, ", "));
}

}  // namespace

Written write_routes(const Model& model, const Lowered& lowered, const RouteFileOptions& options) {
  Written written;
  std::vector<RouteEntry> entries = route_entries(model, lowered, options.routes, written.not_carried);
  if (options.interfaces.empty()) {
    tell_of_names(model, lowered, entries, written.not_carried);
    tell_of_settings(model, entries, options.routes, written.not_carried);
  }
  join_actions(entries, written.not_carried);
  std::map<std::string, std::size_t> counts;
  take_out(entries, [&](const RouteEntry& entry) {
    const bool is_too_much = ++counts[entry.list] > max_written_routes;
    if (is_too_much) {
      written.not_carried.push_back(
          {entry.element,
           fmt::format("more than {} {}, which a bridge does not take", max_written_routes, entry.list)});
    }
    return is_too_much;
  });
  for (const Service& service : model.services) {
    const bool is_used = std::ranges::any_of(model.instances, [&](const Instance& instance) {
      const bool is_theirs = instance.role == Instance::Role::provided && !service.from_ros;
      return is_of(instance, service) &&
             options.routes.side.value_or(is_theirs ? Side::client : Side::server) == Side::client;
    });
    if (is_used && service.minor != 0) {
      written.not_carried.push_back({service.name, "its minor version: a client takes any", service.place});
    }
  }
  if (entries.empty()) {
    return written;  // a bridge takes no file without routes
  }
  std::string text = "# Made by `trestle generate`";
  for (std::size_t i = 0; i < model.files.size() && i < 8; ++i) {
    text += (i == 0 ? " of " : ", ") + documents::printable(model.files[i]);
  }
  text += ".\nsomeip:\n";
  std::optional<IpAddress> multicast = options.multicast;
  std::optional<std::uint16_t> port;
  for (const Machine& machine : model.machines) {
    if (!multicast && machine.sd_multicast &&
        !documents::multicast_address().read(someip::to_string(*machine.sd_multicast))) {
      written.not_carried.push_back(
          {machine.name, "its address of service discovery, which is no group", machine.place});
    } else if (!multicast) {
      multicast = machine.sd_multicast;
    }
    if (!port) {
      port = machine.sd_port;
    }
  }
  if (options.address) {
    text += fmt::format("  address: {}\n", someip::to_string(*options.address));
  } else {
    text += fmt::format("  address: {}  # put the address of this machine here\n",
                        multicast && multicast->v6 ? "'::1'" : "127.0.0.1");
  }
  if (multicast || (port && *port != 30490)) {
    text += "  sd: {";
    if (multicast) {
      text += fmt::format("multicast: {}", someip::to_string(*multicast));
    }
    if (port && *port != 30490) {
      text += fmt::format("{}port: {}", multicast ? ", " : "", *port);
    }
    text += "}\n";
  }
  text += "dds:\n  domain: 0\n";
  if (!options.type_paths.empty()) {
    text += fmt::format("types:\n  paths: {}\n", list_of(options.type_paths));
  }
  if (!options.interfaces.empty()) {
    text += fmt::format("interfaces: {}  # for their types\n", list_of(options.interfaces));
  }
  const InstanceIndex index{model};
  for (const char* list : {"routes", "methods", "fields", "actions"}) {
    if (std::ranges::find(entries, list, &RouteEntry::list) == entries.end()) {
      continue;
    }
    text += fmt::format("\n{}:\n", list);
    for (const RouteEntry& entry : entries) {
      if (entry.list != list) {
        continue;
      }
      YAML::Emitter out;
      emit(out, entry.node, false);
      text += fmt::format("  # {}\n", documents::printable(entry.element));
      const std::string chosen = chosen_ids_of(index, entry);
      // An element of the list: what the emitter wrote, indented.
      std::string_view rest = out.c_str();
      for (bool first = true; !rest.empty(); first = false) {
        const std::string_view line = rest.substr(0, rest.find('\n'));
        rest.remove_prefix(std::min(rest.size(), line.size() + 1));
        const bool has_note = !chosen.empty() && line.starts_with("service: ");
        text += fmt::format("  {} {}{}\n", first ? "-" : " ", line,
                            has_note ? fmt::format("  # {}: {}", chosen_id_note, chosen) : "");
      }
    }
  }
  written.files.push_back({"bridge.yaml", std::move(text)});
  return written;
}

}  // namespace trestle::describe
