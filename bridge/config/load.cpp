#include "bridge/config/load.hpp"

#include <fmt/format.h>
#include <net/if.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>

#include "bridge/config/conflicts.hpp"
#include "bridge/config/section.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::bridge {
namespace {

// No hand-written configuration comes near; a file that does is not one.
constexpr std::size_t file_bytes_max = std::size_t{1} << 20U;
constexpr std::size_t routes_max = 1000;

using namespace std::chrono_literals;

Format<std::chrono::seconds> time_to_live() {
  constexpr std::chrono::seconds until_reboot{0xff'ffff};
  return {"a whole number of seconds from 1 s to 16777214 s, or until_reboot",
          [=](std::string_view text) -> std::optional<std::chrono::seconds> {
            if (text == "until_reboot") {
              return until_reboot;
            }
            const auto time = duration(1s, until_reboot - 1s).read(text);
            return time && *time % 1s == 0s
                       ? std::optional{std::chrono::duration_cast<std::chrono::seconds>(*time)}
                       : std::nullopt;
          }};
}

void load_sd(Section& someip, SomeipSettings& settings, bool address_is_good, Problems& problems) {
  SdSettings& into = settings.sd;
  const YAML::Node node = someip.child("sd");
  if (node) {
    Section sd{node, "sd", problems};
    sd.read("multicast", multicast_address(), into.multicast);
    sd.read("port", as<std::uint16_t>(whole_number(1, 65535)), into.port);
    const Format<Duration> delay = duration(0s, 60s);
    sd.read("initial_delay_min", delay, into.initial_delay_min);
    sd.read("initial_delay_max", delay, into.initial_delay_max);
    sd.read("repetitions_base_delay", duration(1ms, 60s), into.repetitions_base_delay);
    sd.read("repetitions_max", as<std::uint8_t>(whole_number(0, 10)), into.repetitions_max);
    sd.read("cyclic_offer_delay", duration(10ms, 1h), into.cyclic_offer_delay);
    sd.read("request_response_delay_min", delay, into.request_response_delay_min);
    sd.read("request_response_delay_max", delay, into.request_response_delay_max);
    sd.read("ttl", time_to_live(), into.ttl);
    sd.read("check_subnet", truth(), into.check_subnet);  // [feat_req_someipsd_1149]
    sd.finish();
    if (into.initial_delay_min > into.initial_delay_max) {
      problems.error(sd.value_mark("initial_delay_min"),
                     fmt::format("initial_delay_min: {} is above initial_delay_max, {}",
                                 to_string(into.initial_delay_min), to_string(into.initial_delay_max)));
    }
    if (into.request_response_delay_min > into.request_response_delay_max) {
      problems.error(sd.value_mark("request_response_delay_min"),
                     fmt::format("request_response_delay_min: {} is above request_response_delay_max, {}",
                                 to_string(into.request_response_delay_min),
                                 to_string(into.request_response_delay_max)));
    }
    if (into.cyclic_offer_delay >= into.ttl) {
      problems.warning(sd.value_mark("ttl"),
                       fmt::format("ttl: offers live {} but are renewed only every {} (cyclic_offer_delay)",
                                   to_string(into.ttl), to_string(into.cyclic_offer_delay)));
    }
  }
  if (address_is_good && settings.address.v6 != into.multicast.v6) {
    problems.error(
        someip.value_mark("address"),
        fmt::format("address: {} and the multicast address of sd, {}, are of different IP versions",
                    someip::to_string(settings.address), someip::to_string(into.multicast)));
  }
}

// fe80::/10, which names a host only together with an interface.
bool is_link_local(const IpAddress& address) {
  return address.v6 && address.bytes[0] == 0xfe && (address.bytes[1] & 0xc0U) == 0x80;
}

void load_someip(const YAML::Node& node, SomeipSettings& into, Problems& problems) {
  Section someip{node, "someip", problems};
  auto unicast = ip_address();
  unicast.expected = "this host's own IPv4 or IPv6 address, which services are offered at";
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
  Format<std::string> interface =
      any_text(fmt::format("the name of a network interface (1 to {} characters)", IF_NAMESIZE - 1));
  interface.read = [read = std::move(interface.read)](std::string_view text) {
    return text.size() < IF_NAMESIZE ? read(text) : std::nullopt;
  };
  if (someip.read("interface", interface, into.interface)) {
    into.interface_mark = someip.value_mark("interface");
  }
  load_sd(someip, into, address_is_good, problems);
  someip.finish();
}

void load_dds(const YAML::Node& node, DdsSettings& into, Problems& problems) {
  Section dds{node, "dds", problems};
  dds.read("domain", as<std::uint32_t>(whole_number(0, 232)), into.domain);
  std::vector<IpAddress> addresses;
  std::vector<Mark> marks;
  auto ipv4 = ip_address();
  ipv4.expected = "an IPv4 address of this host";
  ipv4.read = [read = std::move(ipv4.read)](std::string_view text) {
    const auto address = read(text);
    return address && !address->v6 && !address->is_multicast() ? address : std::nullopt;
  };
  dds.read_list("interfaces", ipv4, addresses, marks);
  for (const IpAddress& address : addresses) {
    into.interfaces.push_back(someip::to_string(address));
  }
  into.mark = marks.empty() ? dds.mark() : marks.front();
  dds.read("shared_memory", truth(), into.shared_memory);
  dds.finish();
}

void load_types(const YAML::Node& node, const std::string& file, std::vector<std::string>& into,
                Problems& problems) {
  Section types{node, "types", problems};
  std::vector<std::string> paths;
  std::vector<Mark> marks;
  types.read_list("paths", any_text("a folder that holds message packages"), paths, marks);
  types.finish();
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const auto path =
        std::filesystem::path{file}.parent_path() / paths[i];  // an absolute path replaces the first
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored)) {
      into.push_back(path.lexically_normal().string());
    } else {
      problems.error(marks[i],
                     fmt::format("paths: there is no folder {}", quote(path.lexically_normal().string())));
    }
  }
}

void load_root(const YAML::Node& root, BridgeConfig& config, const TypeCheck& check_type,
               Problems& problems) {
  Section section{root, "", problems};
  if (const YAML::Node someip = section.child("someip")) {
    load_someip(someip, config.someip, problems);
  } else if (section.is_missing("someip")) {
    problems.error(section.mark(), "'someip' is missing: expected a mapping with at least 'address'");
  }
  if (const YAML::Node dds = section.child("dds")) {
    load_dds(dds, config.dds, problems);
  }
  if (const YAML::Node types = section.child("types")) {
    load_types(types, config.file, config.type_paths, problems);
  }
  std::vector<RouteInFile> routes;
  for (const YAML::Node& node : section.required_list("routes", "a list of routes")) {
    if (routes.size() == routes_max) {
      problems.error(to_mark(node.Mark()), fmt::format("routes: more than {}", routes_max));
      break;
    }
    routes.push_back(load_route(node, problems));
  }
  section.finish();

  report_conflicts(routes, config.someip, problems);
  for (RouteInFile& in_file : routes) {
    if (check_type && in_file.good.contains("type")) {
      const auto [fault, warning] = check_type(in_file.route.type, in_file.route.rules, config.type_paths);
      if (!fault.empty()) {
        problems.error(in_file.type_mark, "type: " + fault);
      } else if (!warning.empty()) {
        problems.warning(in_file.type_mark, "type: " + warning);
      }
    }
    config.routes.push_back(std::move(in_file.route));
  }
}

/// Walks over a file to see where documents begin.
class DocumentStarts : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark& mark) override { last = to_mark(mark); }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& /*mark*/, YAML::anchor_t /*anchor*/) override {}
  void OnAlias(const YAML::Mark& /*mark*/, YAML::anchor_t /*anchor*/) override {}
  void OnScalar(const YAML::Mark& /*mark*/, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                const std::string& /*value*/) override {}
  void OnSequenceStart(const YAML::Mark& /*mark*/, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                       YAML::EmitterStyle::value /*style*/) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark& /*mark*/, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                  YAML::EmitterStyle::value /*style*/) override {}
  void OnMapEnd() override {}

  Mark last;
};

/// The one document of the file, or nothing after reporting why not.
YAML::Node parse_yaml(const std::string& text, Problems& problems) {
  if (text.size() > file_bytes_max) {
    problems.error({}, fmt::format("the file is larger than {}", bytes_to_string(file_bytes_max)));
    return YAML::Node{YAML::NodeType::Undefined};
  }
  try {
    // Not YAML::LoadAll: on brackets too many at the end it finds documents without end.
    std::istringstream stream{text};
    YAML::Parser parser{stream};
    DocumentStarts documents;
    YAML::Node node;
    if (parser.HandleNextDocument(documents)) {
      if (parser.HandleNextDocument(documents)) {
        problems.error(documents.last, "the file should end here: it is one YAML document");
        return YAML::Node{YAML::NodeType::Undefined};
      }
      node = YAML::Load(text);
    }
    if (!node.IsNull()) {
      return node;
    }
    problems.error({.line = 1, .column = 1}, "the file is empty: expected at least 'someip' and 'routes'");
  } catch (const YAML::Exception& error) {
    problems.error(to_mark(error.mark), "not valid YAML: " + printable(error.msg));
  }
  return YAML::Node{YAML::NodeType::Undefined};
}

}  // namespace

tl::expected<Loaded, std::vector<Problem>> parse_config(std::string_view text, const std::string& file,
                                                        const TypeCheck& check_type) {
  Problems problems{file};
  Loaded loaded;
  loaded.config.file = file;
  if (const YAML::Node root = parse_yaml(std::string{text}, problems)) {
    load_root(root, loaded.config, check_type, problems);
  }
  if (problems.has_errors()) {
    return tl::unexpected{problems.take()};
  }
  loaded.warnings = problems.take();
  return loaded;
}

tl::expected<Loaded, std::vector<Problem>> load_config(const std::string& file, const TypeCheck& check_type) {
  const auto fail = [&](const std::string& why) {
    return tl::unexpected{std::vector{Problem{Problem::Severity::error, file, {}, why}}};
  };
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) {
    return fail("cannot be read: it is a folder");
  }
  errno = 0;
  std::ifstream in{file, std::ios::binary};
  if (!in) {
    return fail("cannot be read: " + std::generic_category().message(errno));
  }
  // One byte more than allowed is enough to know: /dev/zero has no end.
  std::string text(file_bytes_max + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (in.bad()) {
    return fail("cannot be read to its end");
  }
  return parse_config(text, file, check_type);
}

}  // namespace trestle::bridge
