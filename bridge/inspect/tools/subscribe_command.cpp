#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <set>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/interface_options.hpp"
#include "bridge/cli/options.hpp"
#include "bridge/cli/protection.hpp"
#include "bridge/cli/session.hpp"
#include "bridge/inspect/tools/beside_bridge.hpp"
#include "bridge/inspect/tools/message_text.hpp"
#include "bridge/inspect/tools/other_versions.hpp"
#include "bridge/inspect/tools/tool_commands.hpp"

namespace trestle::inspect {
namespace {

struct SubscribeArguments {
  cli::NetworkOptions network;
  cli::TlsOptions tls;
  cli::InterfaceOptions interfaces;
  cli::PayloadOptions payload;
  cli::TransportOptions transport;
  std::string service;
  std::string eventgroup;
  std::vector<std::string> events;
  unsigned major = 1;
  CLI::Option* major_option = nullptr;
  double timeout_s = 0;
  std::uint64_t count = 0;
  bool quiet = false;
};

/// The wanted events; all possible ids when none is named, because Node needs a list.
std::vector<someip::MethodId> events_of(const std::vector<std::string>& names) {
  std::vector<someip::MethodId> events;
  events.reserve(names.empty() ? 0xfffe : names.size());
  for (const std::string& name : names) {
    events.push_back(someip::MethodId{cli::parse_id("EVENT", name)});
  }
  for (std::uint16_t id = 1; names.empty() && id < 0xffff; ++id) {
    if (const someip::MethodId event{id}; !sd::is_reserved(event)) {
      events.push_back(event);
    }
  }
  return events;
}

/// What is subscribed to.
struct Group {
  std::vector<someip::MethodId> events{};
  bool udp = false;
  bool tcp = false;
};
using Groups = std::map<someip::EventgroupId, Group>;

bool is_id(const std::string& text) {
  return !text.empty() && text.front() >= '0' && text.front() <= '9';
}

/// Events that are given by name, each in one of its eventgroups.
Groups groups_of(const std::vector<const describe::ServiceElement*>& elements,
                 const cli::TransportOptions& transport) {
  Groups groups;
  for (const describe::ServiceElement* element : elements) {
    if (!element->is_event()) {
      continue;
    }
    if (element->eventgroups.empty()) {
      throw CLI::ValidationError("EVENT", fmt::format("{} is in no eventgroup", element->name));
    }
    const auto known = std::ranges::find_if(element->eventgroups,
                                            [&](someip::EventgroupId one) { return groups.contains(one); });
    Group& group = groups[known == element->eventgroups.end() ? element->eventgroups.front() : *known];
    if (std::ranges::find(group.events, element->id) == group.events.end()) {
      group.events.push_back(element->id);
    }
    const bool over_tcp = transport.given() ? transport.tcp() : element->transport == Transport::tcp;
    const bool over_udp = transport.given() ? transport.udp() : element->transport == Transport::udp;
    group.tcp = group.tcp || over_tcp;
    group.udp = group.udp || over_udp;
  }
  return groups;
}

/// Who offers an eventgroup asks for an endpoint of each transport that one of its events goes over, wanted
/// or not.
void add_transports(const std::vector<const describe::ServiceElement*>& elements, Groups& groups) {
  for (const describe::ServiceElement* element : elements) {
    for (const someip::EventgroupId eventgroup : element->eventgroups) {
      if (const auto group = groups.find(eventgroup); element->is_event() && group != groups.end()) {
        group->second.tcp = group->second.tcp || element->transport == Transport::tcp;
        group->second.udp = group->second.udp || element->transport == Transport::udp;
      }
    }
  }
}

/// Reads SERVICE.EVENT..., SERVICE EVENT... or SERVICE by names; or SERVICE EVENTGROUP [EVENT...] by ids.
Groups find_groups(SubscribeArguments& options, cli::Target& target) {
  const describe::Interfaces* const interfaces = options.interfaces.get();
  const bool by_name = target.described && !is_id(options.eventgroup);
  if (!by_name) {
    if (options.eventgroup.empty()) {
      throw CLI::RequiredError("EVENTGROUP");
    }
    const someip::EventgroupId eventgroup{cli::parse_id("EVENTGROUP", options.eventgroup)};
    return {{eventgroup,
             {.events = events_of(options.events),
              .udp = options.transport.udp(),
              .tcp = options.transport.tcp()}}};
  }
  if (!options.eventgroup.empty()) {
    options.events.insert(options.events.begin(), options.eventgroup);
  }
  for (const std::string& name : options.events) {
    cli::add_element(interfaces, target, "EVENT", name);
  }
  const bool all = target.elements.empty();
  const std::vector<const describe::ServiceElement*> elements =
      all ? interfaces->elements_of(*target.described) : target.elements;
  for (const describe::ServiceElement* element : elements) {
    const bool has_event = std::ranges::any_of(elements, [&](const describe::ServiceElement* other) {
      return other->member_name == element->member_name && other->is_event();
    });
    if (!all && !has_event) {
      throw CLI::ValidationError(
          "EVENT", element->is_field() ? fmt::format("{} has no notifier", element->member_name)
                                       : fmt::format("{} is a method: see trestle call", element->name));
    }
  }
  Groups groups = groups_of(elements, options.transport);
  if (groups.empty()) {
    throw CLI::ValidationError("EVENT", fmt::format("{} has no events", options.service));
  }
  if (!options.transport.given()) {
    add_transports(interfaces->elements_of(*target.described), groups);
  }
  return groups;
}

/// How the payloads of each event are shown.
class Payloads {
 public:
  Payloads(const describe::Interfaces* interfaces, const cli::Target& target,
           const cli::PayloadOptions& options)
      : interfaces_{interfaces}, service_{target.service.service}, major_{target.major}, usual_{options} {}

  const cli::PayloadOptions& of(someip::MethodId event) {
    const auto known = events_.find(event);
    if (known != events_.end()) {
      return known->second;
    }
    const describe::ServiceElement* const element =
        interfaces_ == nullptr ? nullptr : interfaces_->element(service_, major_, event);
    if (element == nullptr || !element->is_event()) {
      return usual_;
    }
    return events_.emplace(event, usual_.of_element(*interfaces_, *element, false)).first->second;
  }

 private:
  const describe::Interfaces* interfaces_;
  someip::ServiceId service_;
  std::uint8_t major_;
  const cli::PayloadOptions& usual_;
  std::map<someip::MethodId, cli::PayloadOptions> events_;
};

/// The bridge that has the address subscribes.
/// @return false when it does not, or not any more.
bool run_through(guest::Guest& bridge, const std::vector<sd::SubscribeSpec>& subscriptions,
                 const SubscribeArguments& options, const sd::EventHandler& handler, cli::Session& session) {
  std::uint64_t lost = 0;
  const auto has_ended = listen(bridge, session, options.quiet, [&](const guest::Frame& frame) {
    const auto* const event = std::get_if<guest::Event>(&frame);
    if (event == nullptr) {
      return;
    }
    lost += event->lost;
    if (const auto message = someip::decode(event->message)) {  // else it only tells what was lost
      handler(*message, event->from);
    }
  });
  for (const sd::SubscribeSpec& one : subscriptions) {
    refuse_protection(bridge, !one.e2e.empty());
    bridge.say(guest::Subscribe{
        .service = one.service,
        .instance = one.instance,
        .major = one.major,
        .eventgroup = one.eventgroup,
        .udp = one.udp,
        .tcp = one.tcp,
        // All that are possible are more than a bridge waits for.
        .events = one.events.size() > guest::most_events ? std::vector<someip::MethodId>{} : one.events});
  }
  session.run();
  if (lost > 0) {
    cli::Session::warn(fmt::format("{} event{} did not come through the bridge: too many, or read too slowly",
                                   lost, lost == 1 ? "" : "s"));
  }
  return !*has_ended;
}

int run(SubscribeArguments& options) {
  options.interfaces.load();
  cli::Target target =
      cli::parse_target(options.interfaces.get(), options.service, cli::UnnamedInstance::only);
  Groups groups = find_groups(options, target);
  if (target.described && options.major_option->count() == 0) {
    options.major = target.major;
  }
  options.payload.resolve(target.described.has_value());
  Payloads payloads{options.interfaces.get(), target, options.payload};
  const sd::NodeConfig network = options.tls.with(options.network.config());
  cli::Session session{options.timeout_s};
  const Way way = way_into(session, network, cli::named_log(options.interfaces.get(), options.quiet),
                           cli::named_warning(options.interfaces.get()), options.quiet);
  std::uint64_t received = 0;
  std::uint64_t wrong = 0;
  std::set<std::pair<someip::MethodId, Endpoint>> heard;  // events, and whose
  const auto handler = [&](const someip::Message& message, const Endpoint& from) {
    if (options.count != 0 && received == options.count) {
      return;
    }
    const PayloadText text = message_text(message, &from, payloads.of(message.header.method));
    session.print(text.text);
    // Who joins a running stream finds its first event out of sequence, and nothing is wrong.
    const bool joins = heard.emplace(message.header.method, from).second && message.check != nullptr &&
                       message.check->status == someip::e2e::CheckStatus::wrong_sequence;
    for (const std::string& fault : {text.fault, joins ? std::string{} : text.failed_check}) {
      if (!fault.empty()) {
        ++wrong;
        cli::Session::warn(fault);
      }
    }
    if (++received == options.count) {
      session.finish();
    }
  };
  std::vector<sd::SubscribeSpec> subscriptions;
  for (auto& [eventgroup, group] : groups) {
    sd::SubscribeSpec subscription{.service = target.service.service,
                                   .instance = target.service.instance,
                                   .major = static_cast<std::uint8_t>(options.major),
                                   .eventgroup = eventgroup,
                                   .events = std::move(group.events),
                                   .udp = group.udp,
                                   .tcp = group.tcp};
    if (target.described) {
      subscription.e2e = cli::protection_of_events(*options.interfaces.get(), subscription, target.major);
    }
    subscriptions.push_back(std::move(subscription));
  }
  if (way.bridge) {
    if (!run_through(*way.bridge, subscriptions, options, handler, session)) {
      return cli::exit_failure;
    }
  } else {
    for (const sd::SubscribeSpec& one : subscriptions) {
      way.node->subscribe(one, handler);
    }
    const OtherVersions others{*way.node, target.service, options.major, options.interfaces.get(),
                               options.quiet};
    session.run();
    way.node->shutdown();
  }
  const bool enough = options.count == 0 ? received > 0 || !session.timed_out() : received == options.count;
  if (!enough) {
    cli::Session::warn(fmt::format("too few events: {}{} came{}", received,
                                   options.count == 0 ? "" : fmt::format(" of {}", options.count),
                                   session.timed_out() ? fmt::format(" in {} s", options.timeout_s) : ""));
  }
  if (wrong > 0) {
    cli::Session::warn(fmt::format("{} of {} events were not good", wrong, received));
  }
  return enough && wrong == 0 ? cli::exit_ok : cli::exit_failure;
}

}  // namespace

void add_subscribe_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("subscribe", "Subscribe to an eventgroup and print its events");
  command->footer(
      "Runs until Ctrl-C, --count or --timeout. It reports discovery on standard error. On a terminal it\n"
      "prints at most 128 elements of an array, otherwise all.\n"
      "With --interfaces, events and fields have names, and the description knows their eventgroups: give\n"
      "one name or several, or the service alone for all of them.\n"
      "Where a bridge of this host has the address, the subscription goes through that.\n"
      "Exit status: 0; 1 when too few events came in time, or when one was no message of the type or failed\n"
      "its E2E check; 2 for a wrong command line.\n\n"
      "Examples:\n"
      "  trestle subscribe Door.moved --interfaces Door.fidl Door.fdepl\n"
      "  trestle subscribe Door opening locked --interfaces Door.fidl Door.fdepl\n"
      "  trestle subscribe 0x1234.0x0001 0x0001\n"
      "  trestle subscribe 0x1234.0x0001 0x0001 0x8001 --type geometry_msgs/msg/Point --count 1\n"
      "  trestle subscribe 0x1234.1 1 --tcp\n"
      "  trestle subscribe 0x1234.1 1 --type sensor_msgs/msg/Imu --json | jq .values.linear_acceleration.x");
  const auto options = std::make_shared<SubscribeArguments>();
  command
      ->add_option("SERVICE.INSTANCE", options->service,
                   "Such as 0x1234.0x0001; with --interfaces Door.moved, or Door")
      ->required();
  command->add_option("EVENTGROUP", options->eventgroup, "Its id; by names an event");
  command->add_option("EVENT", options->events, "Ids or names of the events to print (default: all)");
  options->major_option = cli::add_major(*command, options->major);
  cli::add_count(*command, options->count, "End after this many events");
  cli::add_seconds(*command, "--timeout", options->timeout_s, "End after this time");
  cli::add_quiet(*command, options->quiet);
  options->transport.add_to(*command, "Events come");
  options->payload.add_to(*command);
  options->interfaces.add_to(*command, "subscribe and print by their names");
  options->network.add_to(*command);
  options->tls.add_to(*command);
  command->callback([options, &status] { status = run(*options); });
}

}  // namespace trestle::inspect
