#include "bridge/carry/config/load_access.hpp"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "bridge/carry/config/elements.hpp"
#include "bridge/documents/document.hpp"
#include "bridge/documents/quote_path.hpp"

namespace trestle::carry {
namespace {

constexpr std::size_t rules_max = 1000;

documents::Format<sd::Subnet> subnet() {
  return {
      "an address or a subnet such as 192.168.10.5, 192.168.10.0/24 or fd00::/8, with no bits behind the "
      "prefix",
      [](std::string_view text) { return sd::parse_subnet(std::string{text}); }};
}

documents::Format<ServiceRange> service_or_range() {
  return {
      "an id from 0x0001 to 0xfffe, or a range such as 0x1000-0x1fff",
      [id = id_of<someip::ServiceId>()](std::string_view text) -> std::optional<ServiceRange> {
        const std::size_t dash = text.find('-');
        const auto first = id.read(text.substr(0, dash));
        const auto last = dash == std::string_view::npos ? first : id.read(text.substr(dash + 1));
        return first && last && *first <= *last ? std::optional{ServiceRange{*first, *last}} : std::nullopt;
      }};
}

documents::Format<bool> allow_or_deny() {
  return documents::one_of<bool>({{"allow", true}, {"deny", false}});
}

sd::AccessRule load_rule(const YAML::Node& node, bool v6, documents::Problems& problems) {
  sd::AccessRule rule;
  documents::Section section{node, "rule", problems};
  std::vector<documents::Mark> marks;
  section.read_list(
      "allow",
      documents::one_of<sd::Access>(
          {{"offer", sd::Access::offer}, {"subscribe", sd::Access::subscribe}, {"call", sd::Access::call}}),
      rule.allow, marks);
  ServiceRange services{rule.first_service, rule.last_service};
  section.read("service", service_or_range(), services);
  rule.first_service = services.first;
  rule.last_service = services.last;
  section.read("instance", id_of<someip::InstanceId>(), rule.instance);
  const auto read_members = [&](const char* key, auto& into, sd::Access access) {
    section.read_list(key, id_of<typename std::remove_reference_t<decltype(into)>::value_type>(), into,
                      marks);
    if (!into.empty() && !rule.allow.empty() && std::ranges::find(rule.allow, access) == rule.allow.end()) {
      problems.error(section.use_mark(key),
                     std::string{key} + ": is for rules that allow " + to_string(access));
    }
  };
  read_members("methods", rule.methods, sd::Access::call);
  read_members("eventgroups", rule.eventgroups, sd::Access::subscribe);
  section.note_required("peers", documents::AskedKey::Kind::values);
  if (section.is_missing("peers")) {
    problems.error(section.mark(),
                   "'peers' is missing in rule: expected a list of addresses and subnets; []: "
                   "nobody may");
  }
  section.read_list("peers", subnet(), rule.peers, marks);
  check_peers(section.value_mark("peers"), rule.peers, v6, problems);
  section.finish();
  return rule;
}

}  // namespace

bool load_peers(documents::Section& section, std::vector<sd::Subnet>& into, documents::Problems& problems) {
  std::vector<documents::Mark> marks;
  section.read_list("peers", subnet(), into, marks);
  if (into.empty() && section.has("peers")) {
    problems.error(section.use_mark("peers"), "peers: names nobody; leave it out to allow everybody");
  }
  return !into.empty();
}

void check_peers(documents::Mark mark, const std::vector<sd::Subnet>& peers, bool v6,
                 documents::Problems& problems) {
  const auto other = std::ranges::find(peers, !v6, [](const sd::Subnet& one) { return one.address.v6; });
  if (other != peers.end()) {
    problems.error(mark,
                   "peers: " + to_string(*other) + " is not of the IP version of the address of someip");
  }
}

void load_tls(documents::Section& someip, const std::string& file, std::optional<someip::TlsSettings>& into,
              documents::Problems& problems) {
  const YAML::Node node = someip.child("tls");
  if (!node) {
    return;
  }
  documents::Section tls{node, "tls", problems};
  someip::TlsSettings settings;
  bool are_there = true;
  const auto read_file = [&](const char* key, const char* what, std::string& name) {
    if (!tls.read(key, documents::any_text(what), name)) {
      are_there = are_there && tls.is_missing(key);
      return;
    }
    name = (std::filesystem::path{file}.parent_path() / name).lexically_normal().string();
    std::error_code ignored;
    if (!std::filesystem::exists(name, ignored)) {
      problems.error(tls.value_mark(key),
                     std::string{key} + ": there is no file " + documents::quote_path(name));
      are_there = false;
    }
  };
  read_file("certificate", "a file with our certificate in PEM", settings.certificate_file);
  read_file("key", "a file with the key of our certificate in PEM", settings.key_file);
  read_file("ca", "a file with the certificates in PEM that have signed those of peers", settings.ca_file);
  read_file("psk_key", "a file with the key in hexadecimal digits", settings.psk_key_file);
  tls.read("peer_name", documents::any_text("the name in the certificates of peers"), settings.peer_name);
  tls.read("psk_identity", documents::any_text("the name of the key"), settings.psk_identity);
  tls.read("handshake_timeout", documents::duration(std::chrono::milliseconds{1}, std::chrono::hours{1}),
           settings.handshake_timeout);
  tls.finish();
  const std::string mistake = someip::mistake_in(settings);
  if (!someip::has_tls()) {
    problems.error(tls.mark(), "tls: this program was built without TLS (CMake: TRESTLE_TLS)");
  } else if (are_there && !mistake.empty()) {
    problems.error(tls.mark(), "tls: " + mistake);
  }
  into = settings;
}

void load_access(documents::Section& someip, bool v6, sd::AccessControl& into,
                 documents::Problems& problems) {
  const YAML::Node node = someip.child("access");
  if (!node) {
    return;
  }
  documents::Section access{node, "access", problems};
  if (load_peers(access, into.peers, problems)) {
    check_peers(access.value_mark("peers"), into.peers, v6, problems);
  }
  access.read("refused_calls", documents::one_of<bool>({{"answer", true}, {"drop", false}}),
              into.answer_calls);
  sd::AccessPolicy policy;
  access.read("others", allow_or_deny(), policy.allow_others);
  const std::vector<YAML::Node> rules = access.list("rules", "a list of rules");
  for (std::size_t i = 0; i < rules.size(); ++i) {
    if (i == rules_max) {
      problems.error(documents::to_mark(rules[i].Mark()), "rules: more than " + std::to_string(rules_max));
      break;
    }
    policy.rules.push_back(load_rule(rules[i], v6, problems));
  }
  access.finish();
  if (!policy.rules.empty() || !policy.allow_others) {
    into.policies.push_back(std::move(policy));
  }
}

}  // namespace trestle::carry
