#include "bridge/generate/service_inputs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "bridge/cli/options.hpp"
#include "bridge/documents/format.hpp"
#include "bridge/documents/section.hpp"

namespace trestle::generate {
namespace {

/// A name as FIDL, ARXML and C++ take it: parts of letters, digits and underscores, with dots between them.
void check_name(const char* option, const std::string& text, bool has_parts) {
  bool begins = true;
  bool good = !text.empty();
  for (const char one : text) {
    const bool is_letter = (one >= 'a' && one <= 'z') || (one >= 'A' && one <= 'Z') || one == '_';
    const bool is_digit = one >= '0' && one <= '9';
    good = good && (is_letter || (is_digit && !begins) || (one == '.' && has_parts && !begins));
    begins = one == '.';
  }
  if (!good || begins) {
    throw CLI::ValidationError{
        option, fmt::format("{} is not a valid name: expected letters, digits and underscores{}",
                            documents::quote(text), has_parts ? ", in parts with dots between them" : "")};
  }
}

}  // namespace

void ServiceInputs::add_to(CLI::App& command) {
  const char* const group = "Names, ids and endpoint of the service (default: those of the sources)";
  const auto add = [&](const char* name, auto& into, const char* type, const char* what) {
    return command.add_option(name, into, what)->type_name(type)->group(group);
  };
  add("--package", package_, "NAME", "Package of the service");
  add("--name", name_, "NAME", "Name of the service");
  add("--major", major_, "N", "Its major version")->check(CLI::Range(0, 255));
  add("--minor", minor_, "N", "Its minor version");
  add("--event", event_, "NAME", "Name of its event");
  add("--argument", argument_, "NAME", "Name of the value in the payload of the event");
  add("--service-id", service_id_, "ID", "Service ID, such as 0x1234");
  add("--event-id", event_id_, "ID", "Event ID, such as 0x8001");
  add("--eventgroup", eventgroup_, "ID", "Eventgroup ID of the event");
  add("--instance-name", instance_name_, "NAME", "Name of the instance, such as car.Door.front");
  add("--instance", instance_, "ID", "Instance ID");
  add("--address", address_, "IP", "Address of the instance; in route files, of the bridge");
  add("--udp-port", udp_port_, "N", "UDP port of the instance")->check(CLI::Range(1, 65535));
  add("--tcp-port", tcp_port_, "N", "TCP port of the instance")->check(CLI::Range(1, 65535));
}

std::size_t ServiceInputs::count() const {
  const std::array given{package_.has_value(),       name_.has_value(),     major_.has_value(),
                         minor_.has_value(),         event_.has_value(),    argument_.has_value(),
                         service_id_.has_value(),    event_id_.has_value(), eventgroup_.has_value(),
                         instance_name_.has_value(), instance_.has_value(), !address_.empty(),
                         udp_port_.has_value(),      tcp_port_.has_value()};
  return static_cast<std::size_t>(std::ranges::count(given, true));
}

std::vector<documents::Problem> ServiceInputs::apply(describe::Model& model) const {
  std::optional<IpAddress> address;
  if (!address_.empty()) {
    address = documents::ip_address().read(address_);
    if (!address) {
      throw CLI::ValidationError{"--address", fmt::format("{} is no IP address", documents::quote(address_))};
    }
  }
  const std::size_t of_service = count() - (address ? 1 : 0);
  if (count() == 0 || (model.services.size() != 1 && of_service == 0)) {
    return {};
  }
  const auto fault = [](std::string text) {
    return std::vector<documents::Problem>{{.file = "command line", .mark = {}, .text = std::move(text)}};
  };
  if (model.services.size() != 1) {
    return fault(fmt::format("--package, --name and similar options are for one service: the sources have {}",
                             model.services.size()));
  }
  describe::Service& service = model.services.front();
  const std::string old_name = describe::full_name(service.scope, service.name);
  for (const auto& [option, text, has_parts] : {std::tuple{"--package", &package_, true},
                                                {"--name", &name_, false},
                                                {"--event", &event_, false},
                                                {"--argument", &argument_, false},
                                                {"--instance-name", &instance_name_, true}}) {
    if (*text) {
      check_name(option, **text, has_parts);
    }
  }
  if (event_ || argument_ || event_id_ || eventgroup_) {
    if (service.events.size() != 1) {
      return fault(
          fmt::format("--event, --argument, --event-id and --eventgroup are for one event: {} has {}",
                      service.name, service.events.size()));
    }
    describe::Event& event = service.events.front();
    event.name = event_.value_or(event.name);
    if (argument_) {
      if (event.payload.values.size() != 1) {
        return fault(fmt::format("--argument is for one value: {} carries {}", event.name,
                                 event.payload.values.size()));
      }
      event.payload.values.front().name = *argument_;
    }
    if (event_id_) {
      event.id = someip::MethodId{cli::parse_id("--event-id", *event_id_)};
    }
    if (eventgroup_) {
      const someip::EventgroupId id{cli::parse_id("--eventgroup", *eventgroup_)};
      const bool had_one = event.eventgroups.size() == 1;
      const auto same =
          std::ranges::find(service.eventgroups, had_one ? event.eventgroups.front() : someip::EventgroupId{},
                            &describe::Eventgroup::id);
      if (had_one && same != service.eventgroups.end()) {
        same->id = id;
      } else if (std::ranges::find(service.eventgroups, id, &describe::Eventgroup::id) ==
                 service.eventgroups.end()) {
        service.eventgroups.push_back({.name = event.name, .id = id});
      }
      event.eventgroups = {id};
    }
  }
  service.scope = package_.value_or(service.scope);
  service.name = name_.value_or(service.name);
  service.major = static_cast<std::uint8_t>(major_.value_or(service.major));
  service.minor = minor_.value_or(service.minor);
  service.has_version = service.has_version || major_ || minor_;
  if (service_id_) {
    service.id = someip::ServiceId{cli::parse_id("--service-id", *service_id_)};
  }
  const std::string new_name = describe::full_name(service.scope, service.name);
  describe::Instance* first = nullptr;
  for (describe::Instance& instance : model.instances) {
    if (instance.service != old_name && !is_of(instance, service)) {
      continue;
    }
    instance.service = new_name;
    instance.service_id = service.id;
    if (major_) {
      instance.major.reset();
    }
    if (minor_ && instance.minor) {
      instance.minor = minor_;
    }
    if (first == nullptr && instance.role == describe::Instance::Role::provided) {
      first = &instance;
    }
  }
  if (instance_name_ || instance_ || address || udp_port_ || tcp_port_) {
    if (first == nullptr) {
      model.instances.push_back({.service = new_name, .service_id = service.id, .place = service.place});
      first = &model.instances.back();
      first->id = someip::InstanceId{1};
    }
    first->name = instance_name_.value_or(first->name);
    if (instance_) {
      first->id = someip::InstanceId{cli::parse_id("--instance", *instance_)};
    }
    if (address && !(writes_routes && first->address)) {
      first->address = address;
    }
    first->udp_port = udp_port_ ? udp_port_ : first->udp_port;
    first->tcp_port = tcp_port_ ? tcp_port_ : first->tcp_port;
  }
  return {};
}

}  // namespace trestle::generate
