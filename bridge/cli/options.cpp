#include "bridge/cli/options.hpp"

#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>

#include "bridge/documents/document.hpp"
#include "bridge/documents/format.hpp"
#include "bridge/documents/hex_line.hpp"
#include "bridge/messages/types/type_library.hpp"
#include "bridge/messages/values/load_wire.hpp"
#include "someip/net/address_text.hpp"
#include "someip/net/addresses.hpp"

namespace trestle::cli {
namespace {

IpAddress address_of(const char* option, const std::string& text) {
  const auto address = someip::parse_address(text);
  if (!address || address->is_unspecified()) {
    throw CLI::ValidationError(option, fmt::format("expected an IPv4 or IPv6 address, found '{}'", text));
  }
  return *address;
}

/// The address of loopback, where it is the only interface that is up and has an address.
std::optional<IpAddress> only_loopback(bool v6) {
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) {
    return std::nullopt;
  }
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> owner{all, &freeifaddrs};
  std::optional<IpAddress> loopback;
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != (v6 ? AF_INET6 : AF_INET) ||
        (one->ifa_flags & unsigned{IFF_UP}) == 0) {
      continue;
    }
    if ((one->ifa_flags & unsigned{IFF_LOOPBACK}) == 0) {
      return std::nullopt;
    }
    if (!loopback) {
      someip::SocketAddress address;
      address.assign(*one->ifa_addr);
      loopback = address.endpoint().address;
    }
  }
  return loopback;
}

/// The own address from which the system would send; nothing is sent.
IpAddress own_address_towards(const IpAddress& group, std::uint16_t port) {
  namespace ip = boost::asio::ip;
  boost::asio::io_context io;
  ip::udp::socket socket{io};
  boost::system::error_code error;
  socket.connect({ip::make_address(someip::to_string(group)), port}, error);
  const auto local =
      error ? std::nullopt : someip::parse_address(socket.local_endpoint(error).address().to_string());
  if (!error && local && !local->is_unspecified()) {
    return *local;
  }
  if (const auto loopback = only_loopback(group.v6)) {
    const std::string text = someip::to_string(*loopback);
    fmt::print(stderr, "note: loopback is the only network: --address {} is taken\n", text);
    return *loopback;
  }
  throw std::runtime_error{
      fmt::format("no network leads to {}: choose one with --address", someip::to_string(group))};
}

std::string read_all(std::istream& in) {
  std::string text;
  char part[4096];
  while (in.read(part, sizeof part), in.gcount() > 0) {
    text.append(part, static_cast<std::size_t>(in.gcount()));
    if (text.size() > messages::max_text_bytes) {
      break;  // the parser reports that it is too long
    }
  }
  return text;
}

/// The same as `wire` of a route in the bridge's configuration.
messages::MessageRules parse_wire(const std::string& argument) {
  const auto [text, name] = text_of_argument("--wire", "wire", argument);
  messages::MessageRules rules;
  documents::Problems problems{name};
  try {
    messages::load_wire(YAML::Load(text), rules, problems);
  } catch (const YAML::Exception& error) {
    documents::tell_of_bad_yaml(error, text, problems);
  }
  if (problems.has_errors()) {
    throw CLI::ValidationError("--wire", documents::to_string(problems.take().front()));
  }
  return rules;
}

}  // namespace

TextArgument text_of_argument(const std::string& option, const std::string& what,
                              const std::string& argument) {
  if (!argument.starts_with('@')) {
    return {argument, what};
  }
  const std::string name = argument.substr(1);
  if (name == "-") {
    return {read_all(std::cin), "standard input"};
  }
  std::ifstream file{name, std::ios::binary};
  std::string text = read_all(file);
  if (!file.is_open() || file.bad()) {
    throw CLI::ValidationError(option, fmt::format("cannot read '{}'", name));
  }
  return {std::move(text), name};
}

void NetworkOptions::add_to(CLI::App& command) {
  command
      .add_option("--address", address_,
                  "Own address, which chooses the network (default: where the system sends multicast)")
      ->type_name("IP");
  add_group_to(command);
}

void NetworkOptions::add_group_to(CLI::App& command) {
  option(command, "--multicast", multicast_, "IP", "Group of service discovery");
  option(command, "--sd-port", sd_port_, "N", "Port of service discovery", CLI::Range(1, 65535));
}

sd::NodeConfig NetworkOptions::config() const {
  sd::NodeConfig config = config_without_address();
  if (address_.empty()) {
    config.address = own_address_towards(config.multicast, sd_port_);
  }
  return config;
}

sd::NodeConfig NetworkOptions::config_without_address() const {
  sd::NodeConfig config;
  config.multicast = address_of("--multicast", multicast_);
  if (!config.multicast.is_multicast()) {
    throw CLI::ValidationError("--multicast", fmt::format("'{}' is no multicast address", multicast_));
  }
  config.port = sd_port_;
  config.check_subnet = false;  // a tool shows all peers
  config.discovery.own_endpoints_only = false;
  if (address_.empty()) {
    config.address.v6 = config.multicast.v6;
    return config;
  }
  config.address = address_of("--address", address_);
  if (config.address.v6 != config.multicast.v6) {
    throw CLI::ValidationError("--address", "and --multicast must both be IPv4 or both IPv6");
  }
  return config;
}

void TlsOptions::add_to(CLI::App& command) {
  const auto add = [&](const char* name, std::string& into, const char* type, const char* what) {
    command.add_option(name, into, what)->type_name(type);
  };
  add("--tls-certificate", settings_.certificate_file, "FILE",
      "TCP connections use TLS: own certificate (PEM); with --tls-key and --tls-ca");
  add("--tls-key", settings_.key_file, "FILE", "Private key of the certificate (PEM)");
  add("--tls-ca", settings_.ca_file, "FILE", "Who has to have signed the peer's certificate (PEM)");
  add("--tls-peer", settings_.peer_name, "NAME", "The name that the peer's certificate has to have");
  add("--tls-psk-identity", settings_.psk_identity, "NAME",
      "TCP connections use TLS with a key that both ends know: its name");
  add("--tls-psk-key", settings_.psk_key_file, "FILE", "File with that key, in hexadecimal digits");
}

sd::NodeConfig TlsOptions::with(sd::NodeConfig config) const {
  if (settings_ == someip::TlsSettings{}) {
    return config;
  }
  if (!someip::has_tls()) {
    throw CLI::ValidationError("--tls", "this program was built without TLS (CMake: TRESTLE_TLS)");
  }
  if (const std::string mistake = someip::mistake_in(settings_); !mistake.empty()) {
    throw CLI::ValidationError("--tls", mistake);
  }
  config.tls = settings_;
  return config;
}

void PayloadOptions::add_to(CLI::App& command) {
  const bool calls = command.get_name() == "call";
  command
      .add_option(
          "--type", type_,
          calls ? "Type of the service, or message type of the payload: print and take values, not bytes"
                : "Message type of the payload: print and take values, not bytes")
      ->type_name(calls ? "PKG/srv/TYPE or PKG/msg/TYPE" : "PKG/msg/TYPE");
  command
      .add_option("--msg-path", msg_path_,
                  "Folder with .msg packages, searched before AMENT_PREFIX_PATH (may be repeated)")
      ->type_name("DIR")
      ->allow_extra_args(false);
  command
      .add_option("--wire", wire_,
                  "How values are laid out, like 'wire' of a route: '{byte_order: little}', or @FILE; "
                  "needs a type")
      ->type_name("YAML");
  CLI::Option* hex = command.add_flag("--hex", hex_, "Payloads in hexadecimal; the default without --type");
  CLI::Option* yaml = command.add_flag("--yaml", yaml_, "Payloads in YAML; the default with --type");
  CLI::Option* json =
      command.add_flag("--json", json_, "Payloads in JSON; the output is JSON, one object per line");
  hex->excludes(yaml)->excludes(json);
  yaml->excludes(json);
}

void PayloadOptions::resolve(bool described) {
  form_ = hex_ ? Form::hex : json_ ? Form::json : yaml_ || !type_.empty() ? Form::yaml : Form::hex;
  if (!wire_.empty()) {
    rules_ = parse_wire(wire_);
  }
  if (type_.empty()) {
    if (yaml_ && !described) {
      throw CLI::ValidationError("--yaml", "needs --type");
    }
    return;
  }
  find_type("--type");
}

std::string PayloadOptions::take_request_of_service() {
  const auto name = messages::interface_name(type_);
  if (!name || messages::defining_interface(*name)) {
    return {};
  }
  const bool of_action = name->kind == messages::InterfaceKind::action &&
                         std::ranges::any_of(messages::action_services, [&](std::string_view suffix) {
                           return name->type.ends_with(suffix);
                         });
  if (name->kind != messages::InterfaceKind::service && !of_action) {
    return {};
  }
  const std::string service = std::exchange(type_, name->full() + std::string{messages::service_suffixes[0]});
  return service + std::string{messages::service_suffixes[1]};
}

PayloadOptions PayloadOptions::of_type(const std::string& option, const std::string& type) const {
  PayloadOptions other = *this;
  if (!type.empty()) {
    other.type_ = type;
    other.form_ = form_ == Form::hex && !hex_ ? Form::yaml : form_;
    other.find_type(option.c_str());
  }
  return other;
}

void PayloadOptions::find_type(const char* option) {
  messages::TypeLibrary library{{msg_path_.begin(), msg_path_.end()}, messages::ament_prefixes()};
  auto tree = library.resolve(type_);
  if (!tree) {
    throw CLI::ValidationError(option, to_string(tree.error()));
  }
  auto values = messages::MessageValues::make(std::move(*tree), rules_);
  if (!values) {
    throw CLI::ValidationError(option, values.error());
  }
  values_ = std::make_shared<const messages::MessageValues>(std::move(*values));
}

PayloadOptions PayloadOptions::of_element(const describe::Interfaces& interfaces,
                                          const describe::ServiceElement& element, bool is_answer) const {
  PayloadOptions other = *this;
  other.described_ = {&interfaces, &element,
                      is_answer ? &interfaces.answer(element) : &interfaces.content(element)};
  if (!type_.empty()) {
    return other;  // what the command line says wins
  }
  const describe::Content& content = *other.described_.content;
  other.values_ = {};
  if (content.values) {
    other.values_ = {std::shared_ptr<const void>{}, &*content.values};  // it belongs to the interfaces
  }
  const bool has_values = content.values || content.is_empty;
  other.form_ = hex_ ? Form::hex : json_ ? Form::json : has_values ? Form::yaml : Form::hex;
  return other;
}

std::vector<std::byte> PayloadOptions::parse(const std::string& argument) const {
  const auto [text, name] = text_of_argument("PAYLOAD", "payload", argument);
  if (described_.element != nullptr && type_.empty() && described_.content->is_empty && form_ != Form::hex) {
    if (text.find_first_not_of(" \n{}") != std::string::npos) {
      throw CLI::ValidationError("PAYLOAD", described_.element->name + " has no values");
    }
    return {};
  }
  if (form_ == Form::hex || !values_) {
    // No payload is no empty one then.
    if (described_.element != nullptr && described_.content->has_crc &&
        text.find_first_not_of(" \n") == std::string::npos) {
      throw CLI::ValidationError(
          "PAYLOAD", fmt::format("the values of {} are not known ({}): give all bytes of the payload as "
                                 "hexadecimal digits",
                                 described_.element->name, described_.content->unknown));
    }
    std::string line = text;
    std::ranges::replace(line, '\n', ' ');
    auto bytes = documents::parse_hex_line(line);
    if (!bytes) {
      const std::string why = described_.element != nullptr && !values_
                                  ? fmt::format(" (the values of {} are not known: {})",
                                                described_.element->name, described_.content->unknown)
                                  : "";
      throw CLI::ValidationError(
          "PAYLOAD",
          fmt::format("expected two hexadecimal digits for each byte; {} is good up to character {}{}", name,
                      bytes.error(), why));
    }
    return std::move(*bytes);
  }
  auto payload =
      values_->parse(text, form_ == Form::json ? messages::ValueForm::json : messages::ValueForm::yaml);
  if (!payload) {
    // For errors of the whole text: users that only want JSON output may not know that --json also means JSON
    // input.
    const bool no_json = form_ == Form::json && payload.error().field.empty();
    const std::string of_file = argument.starts_with('@') ? name + ":" : "";
    throw CLI::ValidationError("PAYLOAD",
                               fmt::format("{}{}{}", of_file, to_string(payload.error()),
                                           no_json ? " (with --json payloads are given in JSON, too)" : ""));
  }
  return std::move(*payload);
}

void TransportOptions::add_to(CLI::App& command, const std::string& what) {
  command.add_flag("--udp", udp_, what + " over UDP; the default");
  command.add_flag("--tcp", tcp_, what + " over TCP; with --udp, over both");
}

CLI::Validator number_between(double min, double max) {
  const auto fault = [min, max](const std::string& text) {
    char* end = nullptr;
    const double number = std::strtod(text.c_str(), &end);
    const bool good =
        end != text.c_str() && *end == '\0' && std::isfinite(number) && number >= min && number <= max;
    return good ? std::string{}
                : fmt::format("expected a number from {:g} to {:.10g}, found '{}'", min, max, text);
  };
  return CLI::Validator{fault, ""};
}

CLI::Option* add_seconds(CLI::App& command, const char* name, double& seconds, const char* what) {
  CLI::Option* const option =
      command.add_option(name, seconds, what)->type_name("SECONDS")->check(number_between(0.001, 1e6));
  return seconds > 0 ? option->capture_default_str() : option;
}

CLI::Option* add_count(CLI::App& command, std::uint64_t& count, const char* what) {
  return command.add_option("--count", count, what)->type_name("N")->check(number_between(1, 1e9));
}

CLI::Option* add_major(CLI::App& command, unsigned& major) {
  return option(command, "--major", major, "N", "Major version of the service", CLI::Range(0, 254));
}

void add_quiet(CLI::App& command, bool& quiet) {
  command.add_flag("-q,--quiet", quiet, "Do not report discovery");
}

ServiceArgument parse_service(const std::string& text, bool any_instance) {
  const auto dot = text.find('.');
  ServiceArgument result{.service = someip::ServiceId{parse_id("SERVICE", text.substr(0, dot))}};
  const std::string instance = dot == std::string::npos ? "*" : text.substr(dot + 1);
  if (instance != "*") {
    result.instance = someip::InstanceId{parse_id("INSTANCE", instance)};
  } else if (!any_instance) {
    throw CLI::ValidationError("SERVICE.INSTANCE", fmt::format("'{}' names no instance", text));
  }
  return result;
}

std::uint16_t parse_id(const std::string& name, const std::string& text) {
  const auto format = documents::id_number(1, 0xfffe);
  const auto number = format.read(text);
  if (!number) {
    throw CLI::ValidationError(name, fmt::format("expected {}, found '{}'", format.expected, text));
  }
  return static_cast<std::uint16_t>(*number);
}

}  // namespace trestle::cli
