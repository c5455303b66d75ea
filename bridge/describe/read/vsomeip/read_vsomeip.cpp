#include "bridge/describe/read/vsomeip/read_vsomeip.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

#include "bridge/describe/join_members.hpp"
#include "bridge/describe/read/vsomeip/vsomeip_reader.hpp"
#include "bridge/documents/section.hpp"
#include "bridge/messages/types/characters.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::describe {
namespace {

/// "@IP@", "__HOST_IP__", "XXX.XXX.XXX.XXX": a template that a script fills in. A mistyped address has
/// nothing but hexadecimal digits between its separators.
bool is_address_placeholder(std::string_view text) {
  return std::ranges::any_of(text, [](char c) {
    const bool is_letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    const bool is_digit = (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
    return c == '@' || c == '$' || c == '_' || (is_letter && !is_digit);
  });
}

/// "vsomeip-service" of "config/vsomeip-service.json.in".
std::string_view stem(std::string_view file) {
  const std::size_t slash = file.find_last_of("/\\");
  const std::string_view name = slash == std::string_view::npos ? file : file.substr(slash + 1);
  return name.substr(0, name.find('.'));
}

}  // namespace

std::optional<std::uint64_t> VsomeipReader::whole(std::string_view text) {
  const bool is_hex = text.starts_with("0x") || text.starts_with("0X");
  const std::string_view digits = text.substr(is_hex ? 2 : 0);
  std::uint64_t number = 0;
  const auto [end, error] =
      std::from_chars(digits.data(), digits.data() + digits.size(), number, is_hex ? 16 : 10);
  if (error != std::errc{} || end != digits.data() + digits.size()) {
    return std::nullopt;
  }
  return number;
}

bool VsomeipReader::is_placeholder(const JsonNode* node) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 3> marks{
      std::pair{"__", "__"}, std::pair{"${", "}"}, std::pair{"@", "@"}};
  if (node == nullptr || node->kind != JsonNode::Kind::string) {
    return false;
  }
  const std::string_view text = messages::trimmed(node->text);
  return std::ranges::any_of(marks, [&](const auto& mark) {
    return text.size() > mark.first.size() + mark.second.size() && text.starts_with(mark.first) &&
           text.ends_with(mark.second);
  });
}

bool VsomeipReader::to_be_filled_in(const JsonNode& node, const std::string& what) {
  if (!is_placeholder(&node)) {
    return false;
  }
  warning(node, what + " is still to be filled in: " + documents::quote(node.text));
  return true;
}

std::optional<someip::InstanceId> VsomeipReader::instance_id(const JsonNode* node, std::uint16_t max) {
  if (node != nullptr && node->is_scalar() && whole(messages::trimmed(node->text)) == 0) {
    warning(*node, "the instance id 0, which no instance can have, counts as not given");
    return std::nullopt;
  }
  const auto number = this->number(node, "an instance id", 1, max);
  return number ? std::optional{static_cast<someip::InstanceId>(*number)} : std::nullopt;
}

std::optional<std::uint64_t> VsomeipReader::number(const JsonNode* node, const std::string& what,
                                                   std::uint64_t min, std::uint64_t max) {
  if (node == nullptr || to_be_filled_in(*node, what)) {
    return std::nullopt;
  }
  const auto number = node->is_scalar() ? whole(messages::trimmed(node->text)) : std::nullopt;
  if (!number || *number < min || *number > max) {
    error(*node, fmt::format("expected {}, a whole number from {} to {} such as \"0x12\" or 18, not {}", what,
                             min, max, what_it_is(*node)));
    return std::nullopt;
  }
  return number;
}

/// vsomeip takes 0 for "none".
std::optional<std::uint16_t> VsomeipReader::port(const JsonNode* node, const std::string& what) {
  const auto number = this->number(node, what, 0, 0xffff);
  return number && *number != 0 && *number != 0xffff ? std::optional{static_cast<std::uint16_t>(*number)}
                                                     : std::nullopt;
}

bool VsomeipReader::truth(const JsonNode* node, bool otherwise) {
  if (node == nullptr || to_be_filled_in(*node, "true or false")) {
    return otherwise;
  }
  if (!node->is_scalar() || (node->text != "true" && node->text != "false")) {
    error(*node, "expected true or false, not " + what_it_is(*node));
    return otherwise;
  }
  return node->text == "true";
}

std::optional<IpAddress> VsomeipReader::address(const JsonNode* node, const std::string& what) {
  if (node == nullptr) {
    return std::nullopt;
  }
  if (node->kind == JsonNode::Kind::string) {
    if (const auto address = someip::parse_address(std::string{messages::trimmed(node->text)})) {
      return address;
    }
    if (messages::trimmed(node->text) == "localhost") {
      warning(*node, "vsomeip accepts only addresses: 'localhost' is read as 127.0.0.1");
      return IpAddress::v4(127, 0, 0, 1);
    }
    if (is_address_placeholder(node->text)) {  // the rest of the file is worth reading
      warning(*node, what + " is still to be filled in: " + documents::quote(node->text));
      return std::nullopt;
    }
  }
  error(*node, "expected " + what + ", an address such as \"192.168.0.1\", not " + what_it_is(*node));
  return std::nullopt;
}

std::optional<std::chrono::milliseconds> VsomeipReader::milliseconds(const JsonNode* node,
                                                                     const std::string& what) {
  const auto number = this->number(node, what + " in milliseconds", 0, 3'600'000);
  return number ? std::optional{std::chrono::milliseconds{*number}} : std::nullopt;
}

const JsonNode* VsomeipReader::object(const JsonNode* node, const std::string& what) {
  if (node != nullptr && node->kind != JsonNode::Kind::object) {
    error(*node, "expected " + what + ", an object, not " + what_it_is(*node));
    return nullptr;
  }
  return node;
}

void VsomeipReader::check_keys(const JsonNode& node, const VsomeipKeys& known) {
  // So that there is room for other problems, and a file of nothing but such keys takes no longer.
  constexpr std::size_t most = 30;
  for (const JsonNode& member : node.members) {
    if (std::ranges::find(known.names, member.name) != known.names.end() || told_keys_.size() >= most ||
        !told_keys_.emplace(known.of, member.name).second) {
      continue;
    }
    const std::string likely = documents::nearest(member.name, {known.names.begin(), known.names.end()});
    problems().warning(
        member.name_mark,
        fmt::format("vsomeip knows no key {} of {}: it is left out{}", documents::quote(member.name),
                    known.of, likely.empty() ? "" : "; did you mean " + documents::quote(likely) + "?"));
  }
}

void VsomeipReader::left_out(const JsonNode* member, const std::string& what) {
  if (member != nullptr && told_keys_.emplace("left out", member->name).second) {
    problems().warning(member->name_mark, documents::quote(member->name) + ": " + what);
  }
}

void VsomeipReader::read(const JsonNode& root, std::uint32_t file) {
  file_ = file;
  if (object(&root, "a vsomeip configuration") == nullptr) {
    return;
  }
  check_keys(root, vsomeip_keys::root);
  find_host(root);
  // Before the settings of service discovery, which hold where both say something.
  each(root.find("servicegroups"), "a group of services", JsonNode::Kind::object,
       [this](const JsonNode& group) {
         if (const JsonNode* node = object(group.find("delays"), "delays")) {
           delays(*node);
         }
       });
  if (const JsonNode* node = object(root.find("service-discovery"), "settings of service discovery")) {
    discovery(*node);
  }
  if (const JsonNode* node = object(root.find("npdu-default-timings"), "times of nPDUs")) {
    npdu_defaults(*node);
  }
  services(root.find("services"));
  each(root.find("servicegroups"), "a group of services", JsonNode::Kind::object,
       [this](const JsonNode& group) {
         check_keys(group, vsomeip_keys::group_of_services);
         services(group.find("services"));
       });
  each(root.find("clients"), "a client", JsonNode::Kind::object,
       [this](const JsonNode& one) { client(one); });
  if (const JsonNode* e2e = object(root.find("e2e"), "settings of E2E")) {
    check_keys(*e2e, vsomeip_keys::e2e);
    if (truth(e2e->find("e2e_enabled"), true)) {
      each(e2e->find("protected"), "what is protected", JsonNode::Kind::object,
           [this](const JsonNode& one) { protection(one); });
    }
  }
}

void VsomeipReader::find_host(const JsonNode& root) {
  const JsonNode* const unicast = root.find("unicast");
  const auto own = address(unicast, "the host's address");
  const std::string text = unicast == nullptr ? std::string{} : std::string{messages::trimmed(unicast->text)};
  host_ = 0;
  if (!text.empty() && !hosts_.empty() && !hosts_.front().unicast.empty()) {
    const auto known = std::ranges::find_if(
        hosts_, [&](const VsomeipHost& one) { return one.unicast == text || (own && one.address == own); });
    host_ = static_cast<std::size_t>(known - hosts_.begin());
  }
  if (host_ == hosts_.size()) {
    hosts_.push_back({.name = std::string{stem(model_.files[file_])}});
  }
  if (host().unicast.empty()) {
    host().unicast = text;
  }
  if (own && says("address", *unicast)) {
    host().address = own;
  }
}

bool VsomeipReader::says(std::string_view setting, const JsonNode& node) {
  const std::string_view text = messages::trimmed(node.text);
  const auto number = whole(text);
  SaidValue value{number ? fmt::to_string(*number) : std::string{text}, place(node)};
  const auto [known, is_new] = host().said.try_emplace(setting, value);
  if (is_new || known->second.place.file == file_) {  // of one file, what is read later
    known->second = std::move(value);
    return true;
  }
  contradictions_.compare("the host", fmt::format("the {}", setting), known->second, value);
  return false;
}

void VsomeipReader::discovery(const JsonNode& node) {
  check_keys(node, vsomeip_keys::discovery);
  if (const JsonNode* const enable = node.find("enable")) {
    const bool is_on = truth(enable, true);
    if (says("setting enable of service discovery", *enable)) {
      host().sd = is_on;
    }
    if (!is_on) {
      return;  // nothing else in here is used
    }
  }
  const JsonNode* const multicast = node.find("multicast");
  if (const auto group = address(multicast, "the group of service discovery");
      group && says("multicast address of service discovery", *multicast)) {
    host().sd_multicast = group;
  }
  const JsonNode* const port_node = node.find("port");
  if (const auto port = this->port(port_node, "the port of service discovery");
      port && says("port of service discovery", *port_node)) {
    host().sd_port = port;
  }
  sd::Timing& timing = host().timing;
  const auto time = [&](const char* key, std::string_view setting, Duration& to) {
    const JsonNode* const found = node.find(key);
    if (const auto value = milliseconds(found, key); value && says(setting, *found)) {
      to = *value;
    }
  };
  time("initial_delay_min", "initial_delay_min", timing.initial_delay_min);
  time("initial_delay_max", "initial_delay_max", timing.initial_delay_max);
  time("repetitions_base_delay", "repetitions_base_delay", timing.repetitions_base_delay);
  time("cyclic_offer_delay", "cyclic_offer_delay", timing.cyclic_offer_delay);
  time("request_response_delay", "request_response_delay_max", timing.request_response_delay_max);
  repetitions(node.find("repetitions_max"), "repetitions_max");
  ttl(node.find("ttl"));
}

void VsomeipReader::repetitions(const JsonNode* node, const std::string& what) {
  if (const auto max = number(node, what, 0, 0xffff'ffff); max && says("repetitions_max", *node)) {
    host().timing.repetitions_max = static_cast<std::uint8_t>(std::min<std::uint64_t>(*max, 255));
  }
}

void VsomeipReader::ttl(const JsonNode* node) {
  if (const auto ttl = number(node, "ttl", 0, 0xffff'ffff); ttl && says("ttl", *node)) {
    constexpr std::uint64_t forever = 0xff'ffff;
    if (*ttl > forever) {
      warning(*node, "an entry has 24 bits for its ttl: 0xffffff is taken, which is for ever");
    }
    host().timing.ttl_s =
        *ttl == 0 ? vsomeip_timing.ttl_s : static_cast<std::uint32_t>(std::min(*ttl, forever));
  }
}

/// What vsomeip 1 had in place of "service-discovery". Later releases read it, too, and like here not for the
/// group alone.
void VsomeipReader::delays(const JsonNode& node) {
  check_keys(node, vsomeip_keys::delays);
  sd::Timing& timing = host().timing;
  const auto time = [&](const JsonNode* value, const char* what, std::string_view setting, Duration& to) {
    if (const auto delay = milliseconds(value, what); delay && says(setting, *value)) {
      to = *delay;
    }
  };
  if (const JsonNode* initial = object(node.find("initial"), "initial delays")) {
    check_keys(*initial, vsomeip_keys::initial_delays);
    const auto either = [&](const char* one, const char* other) {
      const JsonNode* found = initial->find(one);
      return found == nullptr ? initial->find(other) : found;
    };
    time(either("minimum", "min"), "the least initial delay", "initial_delay_min", timing.initial_delay_min);
    time(either("maximum", "max"), "the greatest initial delay", "initial_delay_max",
         timing.initial_delay_max);
  }
  time(node.find("repetition-base"), "repetition-base", "repetitions_base_delay",
       timing.repetitions_base_delay);
  time(node.find("cyclic-offer"), "cyclic-offer", "cyclic_offer_delay", timing.cyclic_offer_delay);
  time(node.find("cyclic-request"), "cyclic-request", "request_response_delay_max",
       timing.request_response_delay_max);
  repetitions(node.find("repetition-max"), "repetition-max");
  ttl(node.find("ttl"));
}

void VsomeipReader::npdu_defaults(const JsonNode& node) {
  check_keys(node, vsomeip_keys::npdu_defaults);
  const auto time = [&](const char* key, std::chrono::microseconds& to) {
    const JsonNode* const found = node.find(key);
    if (const auto value = milliseconds(found, key); value && says(key, *found)) {
      to = *value;
    }
  };
  time("debounce-time-request", host().requests.debounce);
  time("max-retention-time-request", host().requests.retention);
  time("debounce-time-response", host().responses.debounce);
  time("max-retention-time-response", host().responses.retention);
}

std::size_t VsomeipReader::service_of(someip::ServiceId id, const Place& at) {
  const auto [found, is_new] = services_.emplace(id, model_.services.size());
  if (is_new) {
    model_.services.push_back(
        {.name = fmt::format("service_{:04x}", someip::value(id)), .id = id, .place = at});
  }
  return found->second;
}

void VsomeipReader::client(const JsonNode& node) {
  check_keys(node, vsomeip_keys::client);
  for (const char* key : {"reliable", "unreliable", "reliable_client_ports", "reliable_remote_ports",
                          "unreliable_client_ports", "unreliable_remote_ports"}) {
    left_out(node.find(key), "the ports of clients are left out");
  }
  if (node.find("service") == nullptr) {
    return;  // ranges of ports for all services
  }
  const auto service_id = id<someip::ServiceId>(node.find("service"), "a service id");
  const auto instance_id = this->instance_id(node.find("instance"), 0xffff);
  if (!service_id) {
    return;
  }
  Instance instance{.role = Instance::Role::required,
                    .service = model_.services[service_of(*service_id, place(node))].name,
                    .service_id = service_id,
                    .place = place(node)};
  if (instance_id && *instance_id != someip::any_instance) {
    instance.id = instance_id;
    instance.name = fmt::format("instance_{:04x}", someip::value(*instance_id));
  }
  if (required_.insert({*service_id, instance.id}).second) {
    append_instance(std::move(instance));
  }
}

void VsomeipReader::profile(const JsonNode& node, std::string_view name, Protection& e2e) {
  const auto put = [&](const char* key, const char* ours, std::uint64_t max) {
    if (const auto value = number(node.find(key), key, 0, max)) {
      e2e.numbers[ours] = *value;
    }
  };
  put("data_id", "data_id", 0xffff'ffff);
  put("max_delta_counter", "max_delta_counter", 0xffff'ffff);
  if (name == "P01" || name == "CRC8") {
    e2e.profile = "1";
    e2e.words["payload_only"] = "true";  // docs/e2e.md: what vsomeip does
    put("crc_offset", "crc_offset_bits", 0xffff);
    put("counter_offset", "counter_offset_bits", 0xffff);
    put("data_id_nibble_offset", "data_id_nibble_offset_bits", 0xffff);
    put("data_length", "data_bits", 0xffff);
    static constexpr std::array modes{"both", "alternating", "low", "nibble"};
    if (const auto mode = number(node.find("data_id_mode"), "data_id_mode", 0, modes.size() - 1)) {
      e2e.words["data_id_mode"] = modes[*mode];
    }
    return;
  }
  put("crc_offset", "offset_bits", 0xffff'ffff);
  if (name == "P05") {
    e2e.profile = "5";
    e2e.words["crc_order"] = "big";
    put("data_length", "data_bits", 0xffff);
  } else {
    e2e.profile = name == "P07" ? "7" : "4";
    put("min_data_length", "min_data_bits", 0xffff'ffff);
    put("max_data_length", "max_data_bits", 0xffff'ffff);
  }
}

void VsomeipReader::protection(const JsonNode& node) {
  check_keys(node, vsomeip_keys::protection);
  const auto service = id<someip::ServiceId>(node.find("service_id"), "a service id");
  const auto event = id<someip::MethodId>(node.find("event_id"), "an event or method id");
  const JsonNode* name = node.find("profile");
  if (!service || !event || name == nullptr) {
    if (node.find("service_id") == nullptr || node.find("event_id") == nullptr || name == nullptr) {
      error(node, "expected \"service_id\", \"event_id\" and \"profile\"");
    }
    return;
  }
  static constexpr std::array<std::string_view, 5> known{"P01", "CRC8", "P04", "P05", "P07"};
  if (std::ranges::find(known, name->text) == known.end()) {
    warning(*name, "the E2E profile " + documents::quote(name->text) +
                       " is left out: expected P01, CRC8, P04, P05 or P07");
    return;
  }
  Protected one{.service = *service, .id = *event, .e2e = {}, .place = place(node)};
  profile(node, name->text, one.e2e);
  protected_.push_back(std::move(one));
}

void VsomeipReader::protect(const Protected& one) {
  Service& service = model_.services[service_of(one.service, one.place)];
  const bool is_event = has_event(service, one.id) || someip::value(one.id) >= first_event_id;
  Protection& e2e =
      is_event ? event_of(service, one.id, {}, one.place).e2e : method_of(service, one.id, {}, one.place).e2e;
  const auto [first, is_first] = protected_at_.try_emplace({one.service, one.id}, one.place);
  if (is_first) {
    e2e = one.e2e;
    return;
  }
  compare_protections(
      fmt::format("{} 0x{:04x} of {}", is_event ? "event" : "method", someip::value(one.id), service.name),
      e2e, first->second, one.e2e, one.place, contradictions_);
  e2e.numbers.insert(one.e2e.numbers.begin(), one.e2e.numbers.end());
  e2e.words.insert(one.e2e.words.begin(), one.e2e.words.end());
}

void VsomeipReader::take_address(Instance& instance, const VsomeipHost& host) {
  if (!instance.address && host.address) {
    instance.address = host.address;
    instance.said_at["address"] = host.said.at("address").place;
  }
}

void VsomeipReader::append_instance(Instance instance) {
  model_.instances.push_back(std::move(instance));
  hosts_of_instances_.push_back(host_);
}

void VsomeipReader::finish() {
  for (const Protected& one : protected_) {
    protect(one);
  }
  for (Service& service : model_.services) {
    if (const auto found = transports_.find(*service.id); found != transports_.end()) {
      set_transports(service, model_.instances[found->second]);
    }
    make_fields(service);
  }
  const auto is_machine = [](const VsomeipHost& host) {
    return host.address || host.sd_multicast || host.sd_port;
  };
  for (const VsomeipHost& host : hosts_) {
    if (is_machine(host)) {
      model_.machines.push_back({.name = host.name,
                                 .address = host.address,
                                 .sd_multicast = host.sd_multicast,
                                 .sd_port = host.sd_port});
    }
  }
  for (std::size_t at = 0; at < model_.instances.size(); ++at) {
    Instance& instance = model_.instances[at];
    const VsomeipHost& host = hosts_[hosts_of_instances_[at]];
    if (host.sd) {
      instance.timing = host.timing;
      for (const auto& [setting, value] : host.said) {
        instance.said_at.try_emplace(setting, value.place);
      }
    }
    const bool is_here = instance.role == Instance::Role::provided && is_machine(host);
    if (is_here && (!instance.address || instance.address == host.address)) {
      take_address(instance, host);
      instance.machine = host.name;
    }
    for (Multicast& group : instance.multicast) {
      if (group.has_usual_port) {
        group.group.port = instance.udp_port.value_or(0);
      }
    }
  }
}

bool is_vsomeip(std::string_view text) {
  const auto names = names_of_root(text);
  const auto is_known = [](std::string_view name) {
    return std::ranges::find(vsomeip_keys::root.names, name) != vsomeip_keys::root.names.end();
  };
  return names && (names->empty() || std::ranges::any_of(*names, is_known));
}

Reading read_vsomeip(std::span<const SourceText> sources, std::size_t max_bytes) {
  Reading reading;
  std::vector<Problems> problems;
  for (const SourceText& source : sources) {
    reading.model.configurations.insert(static_cast<std::uint32_t>(problems.size()));
    reading.model.files.push_back(source.name);
    problems.emplace_back(source.name, max_problems);
  }
  VsomeipReader reader{reading.model, problems};
  for (std::uint32_t file = 0; file < sources.size(); ++file) {
    const std::string_view text = sources[file].text;
    if (text.size() > max_bytes) {
      problems[file].error(documents::Mark{},
                           fmt::format("the file has {} bytes; expected at most {}", text.size(), max_bytes));
    } else if (const auto root = parse_json(text, problems[file])) {
      reader.read(*root, file);
    }
  }
  reader.finish();
  for (Problems& of_file : problems) {
    std::ranges::move(of_file.take(), std::back_inserter(reading.problems));
  }
  return reading;
}

}  // namespace trestle::describe
