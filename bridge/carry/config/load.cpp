#include "bridge/carry/config/load.hpp"

#include <fmt/format.h>
#include <net/if.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <optional>
#include <set>
#include <system_error>

#include "bridge/carry/config/ask_keys.hpp"
#include "bridge/carry/config/conflicts.hpp"
#include "bridge/carry/config/load_access.hpp"
#include "bridge/carry/config/load_console.hpp"
#include "bridge/carry/config/load_dds.hpp"
#include "bridge/carry/config/load_interfaces.hpp"
#include "bridge/carry/config/load_limits.hpp"
#include "bridge/carry/config/lock_file.hpp"
#include "bridge/carry/config/pattern_conflicts.hpp"
#include "bridge/documents/document.hpp"
#include "bridge/documents/quote_path.hpp"
#include "bridge/documents/utf8.hpp"
#include "bridge/messages/types/type_files.hpp"
#include "bridge/messages/types/type_library.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::carry {
namespace {

constexpr std::size_t routes_max = 1000;

using namespace std::chrono_literals;

documents::Format<std::uint32_t> time_to_live() {
  constexpr std::uint32_t until_reboot = 0xff'ffff;
  return {"a whole number of seconds from 1 s to 16777214 s, or until_reboot",
          [=](std::string_view text) -> std::optional<std::uint32_t> {
            if (text == "until_reboot") {
              return until_reboot;
            }
            const auto time = documents::duration(1s, std::chrono::seconds{until_reboot - 1}).read(text);
            return time && *time % 1s == 0s ? std::optional{static_cast<std::uint32_t>(*time / 1s)}
                                            : std::nullopt;
          },
          {.kind = documents::Shape::Kind::time, .min = 1, .words = {"until_reboot"}}};
}

// "192.168.1.2 -> 10.0.0.2": the first may name endpoints at the second.
documents::Format<sd::ForeignEndpoints> foreign_endpoints() {
  return {"two addresses, as in 192.168.1.2 -> 10.0.0.2: the first may name endpoints at the second",
          [](std::string_view text) -> std::optional<sd::ForeignEndpoints> {
            constexpr std::string_view arrow = " -> ";
            const std::size_t end = text.find(arrow);
            if (end == std::string_view::npos) {
              return std::nullopt;
            }
            const auto peer = someip::parse_address(std::string{text.substr(0, end)});
            const auto named = someip::parse_address(std::string{text.substr(end + arrow.size())});
            return peer && named ? std::optional{sd::ForeignEndpoints{*peer, *named}} : std::nullopt;
          }};
}

void load_sd(documents::Section& someip, SomeipSettings& into, bool address_is_good,
             documents::Problems& problems) {
  sd::Timing& timing = into.timing;
  const YAML::Node node = someip.child("sd");
  if (node) {
    documents::Section sd{node, "sd", problems};
    sd.read("multicast", documents::multicast_address(), into.multicast);
    sd.read("port", port_number(), into.port);
    const documents::Format<Duration> delay = documents::duration(0s, 60s);
    sd.read("initial_delay_min", delay, timing.initial_delay_min);
    sd.read("initial_delay_max", delay, timing.initial_delay_max);
    sd.read("repetitions_base_delay", documents::duration(1ms, 60s), timing.repetitions_base_delay);
    sd.read("repetitions_max", documents::as<std::uint8_t>(documents::whole_number(0, 10)),
            timing.repetitions_max);
    sd.read("cyclic_offer_delay", documents::duration(10ms, 1h), timing.cyclic_offer_delay);
    sd.read("request_response_delay_min", delay, timing.request_response_delay_min);
    sd.read("request_response_delay_max", delay, timing.request_response_delay_max);
    sd.read("ttl", time_to_live(), timing.ttl_s);
    sd.read("check_subnet", documents::truth(), into.check_subnet);  // [feat_req_someipsd_1149]
    sd.read("own_endpoints_only", documents::truth(), into.discovery.own_endpoints_only);
    sd.read("tell_dds_domain", documents::truth(), into.tell_dds_domain);
    std::vector<documents::Mark> marks;
    sd.read_list("foreign_endpoints", foreign_endpoints(), into.foreign_endpoints, marks);
    for (std::size_t i = 0; i < into.foreign_endpoints.size(); ++i) {
      const auto& [peer, named] = into.foreign_endpoints[i];
      if (peer.v6 != into.multicast.v6 || named.v6 != into.multicast.v6) {
        problems.error(marks[i], "foreign_endpoints: not of the IP version of the multicast address of sd");
      }
    }
    sd.finish();
    const auto check_range = [&](const std::string& key, Duration min, Duration max) {
      if (min > max) {
        problems.error(sd.value_mark((key + "_min").c_str()),
                       fmt::format("{0}_min: {1} is above {0}_max, {2}", key, documents::to_string(min),
                                   documents::to_string(max)));
      }
    };
    check_range("initial_delay", timing.initial_delay_min, timing.initial_delay_max);
    check_range("request_response_delay", timing.request_response_delay_min,
                timing.request_response_delay_max);
    if (const Duration ttl = std::chrono::seconds{timing.ttl_s}; timing.cyclic_offer_delay >= ttl) {
      problems.warning(
          sd.value_mark("ttl"),
          fmt::format("ttl: offers live {} but are renewed only every {} (cyclic_offer_delay)",
                      documents::to_string(ttl), documents::to_string(timing.cyclic_offer_delay)));
    }
  }
  if (address_is_good && into.address.v6 != into.multicast.v6) {
    problems.error(
        someip.value_mark("address"),
        fmt::format("address: {} and the multicast address of sd, {}, are of different IP versions",
                    someip::to_string(into.address), someip::to_string(into.multicast)));
  }
}

// fe80::/10, which names a host only together with an interface.
bool is_link_local(const IpAddress& address) {
  return address.v6 && address.bytes[0] == 0xfe && (address.bytes[1] & 0xc0U) == 0x80;
}

void load_someip(const YAML::Node& node, const std::string& file, SomeipSettings& into,
                 documents::Problems& problems) {
  documents::Section someip{node, "someip", problems};
  auto unicast = documents::ip_address();
  unicast.expected = "this host's own IPv4 or IPv6 address, at which services are offered";
  unicast.read = [read = std::move(unicast.read)](std::string_view text) {
    const auto address = read(text);
    return address && !address->is_multicast() ? address : std::nullopt;
  };
  const bool address_is_good = someip.require("address", unicast, into.address);
  into.mark = someip.value_mark("address");
  if (address_is_good && is_link_local(into.address)) {
    problems.error(into.mark,
                   fmt::format("address: {} is link-local: it means another host on each interface, and an "
                               "offer cannot say which; take a global or unique local address (fd00::/8)",
                               someip::to_string(into.address)));
  }
  documents::Format<std::string> interface = documents::any_text(
      fmt::format("the name of a network interface (1 to {} characters)", IF_NAMESIZE - 1));
  interface.read = [read = std::move(interface.read)](std::string_view text) {
    return text.size() < IF_NAMESIZE ? read(text) : std::nullopt;
  };
  if (someip.read("interface", interface, into.multicast_interface)) {
    into.interface_mark = someip.value_mark("interface");
  }
  const auto buffer = documents::as<std::size_t>(documents::byte_size(4096, std::uint64_t{1} << 30U));
  for (auto [key, size] :
       {std::pair{"receive_buffer", &into.receive_buffer}, {"send_buffer", &into.send_buffer}}) {
    if (std::size_t bytes = 0; someip.read(key, buffer, bytes)) {
      *size = bytes;
    }
  }
  someip.read("busy_poll", documents::duration(0s, 1s), into.busy_poll);
  someip.read("tcp_idle_timeout", documents::duration(0s, 24h), into.tcp_idle_timeout);
  load_limits(someip, into.given_limits, problems);
  load_access(someip, into.address.v6, into.access, problems);
  load_tls(someip, file, into.tls, problems);
  load_sd(someip, into, address_is_good, problems);
  someip.finish();
}

void load_types(const YAML::Node& node, const std::string& file, std::vector<std::string>& into,
                documents::Problems& problems) {
  documents::Section types{node, "types", problems};
  std::vector<std::string> paths;
  std::vector<documents::Mark> marks;
  types.read_list("paths", documents::any_text("a folder that holds message packages"), paths, marks);
  types.finish();
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const auto path =
        std::filesystem::path{file}.parent_path() / paths[i];  // an absolute path replaces the first
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored)) {
      into.push_back(path.lexically_normal().string());
    } else {
      problems.error(marks[i], fmt::format("paths: there is no folder {}",
                                           documents::quote_path(path.lexically_normal().string())));
    }
  }
}

/// Reads the elements of a list, as many as there may be.
template <typename Read>
void read_elements(const std::vector<YAML::Node>& nodes, const char* key, std::size_t most,
                   documents::Problems& problems, const Read& read) {
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (i == most) {
      problems.error(documents::to_mark(nodes[i].Mark()), fmt::format("{}: more than {}", key, most));
      break;
    }
    read(nodes[i]);
  }
}

/// Reads all lists. From here on a field or an action is only its methods and routes.
/// @param may_be_missing  all of them: why was told
void load_lists(documents::Section& section, std::vector<RouteInFile>& routes,
                std::vector<MethodInFile>& methods, std::vector<PatternInFile>& patterns, bool may_be_missing,
                documents::Problems& problems) {
  constexpr std::size_t patterns_max = 100;
  // At least one of the lists is required.
  const bool required = !may_be_missing && section.is_missing("methods") && section.is_missing("fields") &&
                        section.is_missing("actions") && section.is_missing("patterns");
  read_elements(required ? section.required_list("routes", "a list of routes")
                         : section.list("routes", "a list of routes"),
                "routes", routes_max, problems,
                [&](const YAML::Node& node) { routes.push_back(load_route(node, problems)); });
  read_elements(section.list("methods", "a list of methods"), "methods", routes_max, problems,
                [&](const YAML::Node& node) { methods.push_back(load_method(node, problems)); });
  read_elements(section.list("fields", "a list of fields"), "fields", routes_max, problems,
                [&](const YAML::Node& node) {
                  FieldInFile field = load_field(node, problems);
                  std::ranges::move(field.methods, std::back_inserter(methods));
                  if (field.route) {
                    routes.push_back(std::move(*field.route));
                  }
                });
  for (const YAML::Node& node : section.list("actions", "a list of actions")) {
    if (methods.size() >= routes_max) {
      problems.error(documents::to_mark(node.Mark()),
                     fmt::format("actions: with the methods, more than {}", routes_max));
      break;
    }
    ActionInFile action = load_action(node, problems);
    std::ranges::move(action.methods, std::back_inserter(methods));
    std::ranges::move(action.routes, std::back_inserter(routes));
  }
  read_elements(section.list("patterns", "a list of patterns"), "patterns", patterns_max, problems,
                [&](const YAML::Node& node) { patterns.push_back(load_pattern(node, problems)); });
}

/// Reads what the patterns found in earlier runs; problems of the lock file go to `file_problems`.
void load_lock_file(documents::Section& section, BridgeConfig& config, documents::Problems& problems,
                    std::vector<documents::Problem>& file_problems) {
  std::string name;
  const documents::Format<std::string> format =
      documents::any_text("the file that keeps the ids of discovered topics, such as trestle.lock");
  const bool needed = !section.is_missing("patterns");
  if (!(needed ? section.require("lock_file", format, name) : section.read("lock_file", format, name))) {
    return;
  }
  const documents::Mark mark = section.value_mark("lock_file");
  const auto path = (std::filesystem::path{config.file}.parent_path() / name).lexically_normal();
  std::error_code ignored;
  if (path.has_parent_path() && !std::filesystem::is_directory(path.parent_path(), ignored)) {
    problems.error(mark, fmt::format("lock_file: there is no folder {}",
                                     documents::quote_path(path.parent_path().string())));
    return;
  }
  config.lock_file = path.string();
  const auto lock = LockFile::read(config.lock_file);
  if (lock) {
    config.locked = lock->topics();
  } else {
    std::ranges::copy(lock.error(), std::back_inserter(file_problems));
    problems.error(mark, fmt::format("lock_file: {} is not good", documents::quote_path(config.lock_file)));
  }
}

/// @param name  of the topic or ROS service, where the mark is not that of the route alone; else empty
void judge_type(const TypeUse& use, const messages::MessageRules& rules, documents::Mark mark,
                std::string key, const std::string& name, const BridgeConfig& config,
                const TypeCheck& check_type, documents::Problems& problems) {
  const auto [fault, warning, map] = check_type(use, rules, config.types);
  for (const messages::MapProblem& one : map) {
    if (one.is_error) {
      problems.error(one.mark, one.text);
    } else {
      problems.warning(one.mark, one.text);
    }
  }
  key += name.empty() ? "" : " of " + name;
  if (!fault.empty()) {
    problems.error(mark, key + ": " + fault);
  } else if (!warning.empty()) {
    problems.warning(mark, key + ": " + warning);
  }
}

void load_diagnostics(const YAML::Node& node, DiagnosticsSettings& into, documents::Problems& problems) {
  documents::Section diagnostics{node, "diagnostics", problems};
  into.wanted = true;
  diagnostics.read("topic", topic_name(), into.topic);
  diagnostics.read("period", documents::duration(100ms, 1h), into.period);
  into.mark = diagnostics.value_mark("topic");
  diagnostics.finish();
}

/// @param file_problems  what is wrong with the files that it names: interfaces, the lock file.
void load_root(YAML::Node root, Loaded& into, const TypeCheck& check_type, documents::Problems& problems,
               std::vector<documents::Problem>& file_problems) {
  BridgeConfig& config = into.config;
  AppliedInterfaces applied = apply_interfaces(root, config.file, config.types, problems, file_problems);
  if (!applied.good) {
    return;
  }
  into.names = std::move(applied.names);
  documents::Section section{root, "", problems};
  for (const char* key : {"interfaces", "generate"}) {  // used already, and known
    static_cast<void>(section.child(key));
  }
  section.note_required("someip", documents::AskedKey::Kind::mapping);
  if (const YAML::Node someip = section.child("someip")) {
    load_someip(someip, config.file, config.someip, problems);
  } else if (section.is_missing("someip")) {
    problems.error(section.mark(), "'someip' is missing: expected a mapping with at least 'address'");
  }
  if (const YAML::Node dds = section.child("dds")) {
    load_dds(dds, config.file, config.dds, problems);
  }
  if (const YAML::Node diagnostics = section.child("diagnostics")) {
    load_diagnostics(diagnostics, config.diagnostics, problems);
  }
  if (const YAML::Node console = section.child("console")) {
    load_console(console, config.file, config.console.emplace(), into.records, problems);
  }
  if (const YAML::Node types = section.child("types")) {
    load_types(types, config.file, config.types.folders, problems);
  }
  std::vector<RouteInFile> routes;
  std::vector<MethodInFile> methods;
  std::vector<PatternInFile> patterns;
  load_lists(section, routes, methods, patterns, applied.tells_of_routes, problems);
  load_lock_file(section, config, problems, file_problems);
  section.finish();

  report_pattern_conflicts(patterns, routes, config.someip.port, problems);
  if (!problems.has_errors()) {
    for (const PatternInFile& in_file : patterns) {
      config.patterns.push_back(in_file.pattern);
    }
    documents::Problems of_lock{config.lock_file};
    report_lock_conflicts(config, routes, methods, of_lock);
    std::ranges::move(locked_routes(config, routes, check_type, of_lock), std::back_inserter(routes));
    if (of_lock.has_errors()) {
      problems.error(section.value_mark("lock_file"),
                     fmt::format("lock_file: {} does not match this configuration",
                                 documents::quote_path(config.lock_file)));
    }
    std::ranges::move(of_lock.take(), std::back_inserter(file_problems));
  }

  report_conflicts(routes, config.someip, problems);
  report_method_conflicts(methods, routes, config.someip, problems);
  report_diagnostics_conflicts(routes, methods, config.diagnostics, problems);
  // All that `generate` makes stands at one place.
  const auto name_at = [&applied](documents::Mark mark, const std::string& name) {
    return mark == applied.generated ? name : std::string{};
  };
  for (RouteInFile& in_file : routes) {
    if (check_type && in_file.good.contains("type")) {
      const Route& route = in_file.route;
      judge_type({.type = route.type,
                  .mapping = route.mapping ? &*route.mapping : nullptr,
                  .direction = route.direction},
                 route.rules, in_file.type_mark, "type", name_at(in_file.type_mark, route.topic), config,
                 check_type, problems);
    }
    config.routes.push_back(std::move(in_file.route));
  }
  for (MethodInFile& in_file : methods) {
    if (check_type && in_file.good.contains("type")) {
      const MethodRoute& method = in_file.method;
      judge_type({method.type, method.access, method.value_type}, method.rules, in_file.type_mark,
                 in_file.type_key, name_at(in_file.type_mark, method.ros_service), config, check_type,
                 problems);
    }
    config.methods.push_back(std::move(in_file.method));
  }
}

/// What should be said of the files that its types were read from. Types that are not known, or wrong, are
/// told elsewhere.
void warn_of_type_files(const BridgeConfig& config, std::vector<documents::Problem>& warnings) {
  messages::TypeLibrary library = messages::TypeLibrary::in(config.types);
  std::set<std::string> told;
  for (const documents::Problem& one : warnings) {
    told.insert(one.file);  // a description among the `interfaces`
  }
  const auto look = [&](const auto& tree) {
    if (tree) {
      std::ranges::move(messages::encoding_warnings(*tree, told), std::back_inserter(warnings));
    }
  };
  for (const Route& route : config.routes) {
    look(library.resolve(route.type));
    if (route.mapping) {
      look(library.resolve(route.mapping->payload.text));
    }
  }
  for (const MethodRoute& method : config.methods) {
    if (method.access != messages::FieldAccess::none) {
      look(library.resolve(method.value_type));
    } else if (const auto types = library.resolve_service(method.type)) {
      look(std::optional{types->request});
      look(std::optional{types->response});
    }
  }
}

}  // namespace

void ask_keys(const std::string& text, const documents::KeyListener& listener) {
  documents::Problems problems{""};
  problems.listen(listener);
  std::vector<documents::Problem> of_files;
  Loaded loaded;
  load_root(documents::parse_document(text, {}, problems), loaded, {}, problems, of_files);
}

tl::expected<Loaded, std::vector<documents::Problem>> parse_config(std::string_view text,
                                                                   const std::string& file,
                                                                   const TypeCheck& check_type) {
  documents::Problems problems{file};
  std::vector<documents::Problem> file_problems;
  Loaded loaded;
  loaded.config.file = file;
  if (const YAML::Node root =
          documents::parse_document(std::string{text}, "at least 'someip' and 'routes'", problems)) {
    load_root(root, loaded, check_type, problems, file_problems);
  }
  const bool is_good = !problems.has_errors();
  std::vector<documents::Problem> all = problems.take();
  std::ranges::move(file_problems, std::back_inserter(all));
  if (!is_good) {
    return tl::unexpected{std::move(all)};
  }
  loaded.warnings = std::move(all);
  if (check_type) {
    warn_of_type_files(loaded.config, loaded.warnings);
  }
  return loaded;
}

tl::expected<Loaded, std::vector<documents::Problem>> load_config(const std::string& file,
                                                                  const TypeCheck& check_type) {
  auto text = documents::read_text_file(file);
  if (!text) {
    return tl::unexpected{
        std::vector{documents::Problem{documents::Problem::Severity::error, file, {}, text.error()}}};
  }
  // Not UTF-16, which YAML may be as well: make_utf8() leaves it as it is.
  const auto warning = documents::make_utf8(*text, file);
  auto loaded = parse_config(*text, file, check_type);
  if (warning) {
    std::vector<documents::Problem>& problems = loaded ? loaded->warnings : loaded.error();
    problems.insert(problems.begin(), *warning);
  }
  return loaded;
}

}  // namespace trestle::carry
