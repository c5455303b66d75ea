#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/protection.hpp"
#include "bridge/cli/session.hpp"
#include "bridge/inspect/tools/beside_bridge.hpp"
#include "bridge/inspect/tools/service_arguments.hpp"
#include "bridge/inspect/tools/tool_commands.hpp"

namespace trestle::inspect {
namespace {

struct NotifyArguments : ServiceArguments {
  std::string eventgroup;  ///< by names the payload
  std::string event;
  std::string value;
  double rate_hz = 1;
  std::uint64_t count = 0;
};

struct Event {
  someip::MethodId id{};
  const describe::ServiceElement* element = nullptr;  ///< null: no description knows it
  std::vector<someip::EventgroupId> eventgroups{};
};

/// Reads SERVICE EVENTGROUP EVENT PAYLOAD by ids, SERVICE.EVENT PAYLOAD by names.
Event find_event(NotifyArguments& options, cli::Target& target) {
  const describe::Interfaces* const interfaces = options.interfaces.get();
  if (target.elements.empty()) {
    if (options.event.empty() || options.value.empty()) {
      throw CLI::RequiredError(options.event.empty() ? "EVENT" : "PAYLOAD");
    }
    Event event{.id = someip::MethodId{cli::parse_id("EVENT", options.event)},
                .eventgroups = {someip::EventgroupId{cli::parse_id("EVENTGROUP", options.eventgroup)}}};
    const describe::ServiceElement* const known =
        interfaces == nullptr ? nullptr : interfaces->element(target.service.service, target.major, event.id);
    event.element = known != nullptr && known->is_event() ? known : nullptr;
    return event;
  }
  if (options.eventgroup.empty()) {
    throw CLI::RequiredError("PAYLOAD");
  }
  if (!options.event.empty()) {
    throw CLI::ValidationError("PAYLOAD",
                               fmt::format("{} is the event: expected one argument more", options.service));
  }
  options.value = std::exchange(options.eventgroup, {});
  const auto at = std::ranges::find_if(target.elements,
                                       [](const describe::ServiceElement* one) { return one->is_event(); });
  if (at == target.elements.end()) {
    const describe::ServiceElement& first = *target.elements.front();
    throw CLI::ValidationError("EVENT", first.is_field()
                                            ? fmt::format("{} has no notifier", first.member_name)
                                            : fmt::format("{} is a method: see trestle offer", first.name));
  }
  if ((*at)->eventgroups.empty()) {
    throw CLI::ValidationError("EVENT", fmt::format("{} is in no eventgroup", (*at)->name));
  }
  return {.id = (*at)->id, .element = *at, .eventgroups = (*at)->eventgroups};
}

int run(NotifyArguments& options) {
  cli::Target target = options.find_service();
  const Event found = find_event(options, target);
  const someip::MethodId event = found.id;
  sd::ServiceSpec spec = options.spec(target);
  const auto add = [&](someip::EventgroupId id, someip::MethodId of) {
    const auto known = std::ranges::find(spec.eventgroups, id, &sd::EventgroupSpec::id);
    sd::EventgroupSpec& group = known != spec.eventgroups.end() ? *known : spec.eventgroups.emplace_back();
    group.id = id;
    if (std::ranges::find(group.events, of) == group.events.end()) {
      group.events.push_back(of);
    }
  };
  for (const someip::EventgroupId eventgroup : found.eventgroups) {
    add(eventgroup, event);
  }
  // All of the description: who subscribes to the service is not refused what is not sent now.
  if (target.described) {
    const auto elements = options.interfaces.get()->elements_of(*target.described);
    for (const describe::ServiceElement* const one : elements) {
      for (const someip::EventgroupId eventgroup : one->eventgroups) {
        add(eventgroup, one->id);
      }
    }
    options.send_over_tcp(elements, spec);
  }
  cli::PayloadOptions described = options.payload;
  if (found.element != nullptr) {
    described = described.of_element(*options.interfaces.get(), *found.element, false);
  }
  const auto payload = std::make_shared<const std::vector<std::byte>>(described.parse(options.value));
  options.protect(spec, event);
  for (const sd::E2eSpec& e2e : spec.e2e) {
    std::string why = e2e.id == event ? cli::misfit_of_protection(e2e, found.element->name, *payload) : "";
    if (!why.empty()) {
      throw CLI::ValidationError("PAYLOAD", std::move(why));
    }
  }
  const sd::NodeConfig network = options.tls.with(options.network.config());

  cli::Session session{options.timeout_s};
  const auto own = node_of_our_own(session, network, cli::named_log(options.interfaces.get(), options.quiet),
                                   cli::named_warning(options.interfaces.get()));
  sd::Node& node = *own;
  const sd::OfferHandle handle = node.offer(spec);
  std::uint64_t sent = 0;
  bool waiting = false;
  const std::chrono::duration<double> period{1 / options.rate_hz};
  session.every(std::chrono::duration_cast<Duration>(period), [&] {
    if (options.count != 0 && sent == options.count) {
      session.finish();  // one period after the last event, which gave it time to leave
    } else if (node.subscribers(handle, event) > 0) {
      const ByteView bytes{*payload};
      node.notify(handle, event, {&bytes, 1}, payload);
      ++sent;
      waiting = false;
    } else if (!std::exchange(waiting, true) && !options.quiet) {
      cli::Session::note("waiting for subscribers");
    }
  });
  session.run();
  node.shutdown();
  if (!options.quiet) {
    cli::Session::note(fmt::format("{} event{} sent", sent, sent == 1 ? "" : "s"));
  }
  return sent > 0 && sent >= options.count ? cli::exit_ok : cli::exit_failure;
}

}  // namespace

void add_notify_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("notify", "Offer a service and send an event to its subscribers");
  command->footer(
      "Offers the service, waits for subscribers, and sends them the event repeatedly until Ctrl-C, --count\n"
      "or --timeout. PAYLOAD is text, @FILE or @- (standard input): hexadecimal, or values with --type.\n"
      "With --interfaces, one name stands in place of the three ids: SERVICE.EVENT PAYLOAD.\n"
      "Exit status: 0; 1 when nothing, or less than --count, was sent; 2 for a wrong command line.\n\n"
      "Examples:\n"
      "  trestle notify Door.moved '{opening: 50, speed: SLOW}' --interfaces Door.fidl Door.fdepl\n"
      "  trestle notify 0x1234.0x0001 0x0001 0x8001 '00 01 02'\n"
      "  trestle notify 0x1234.1 1 0x8001 '{x: 1.5, y: -2}' --type geometry_msgs/msg/Point --rate 10\n"
      "  trestle notify 0x1234.1 1 0x8001 @scan.yaml --type sensor_msgs/msg/LaserScan --count 1");
  const auto options = std::make_shared<NotifyArguments>();
  command
      ->add_option("SERVICE.INSTANCE", options->service,
                   "Such as 0x1234.0x0001; with --interfaces Door.moved, and then PAYLOAD")
      ->required();
  command->add_option("EVENTGROUP", options->eventgroup, "Its id");
  command->add_option("EVENT", options->event, "Id of the event");
  command->add_option("PAYLOAD", options->value, "Payload of the event");
  cli::option(*command, "--rate", options->rate_hz, "HZ", "Events a second",
              cli::number_between(0.001, 10'000));
  cli::add_count(*command, options->count, "End after this many events");
  options->add_to(*command);
  command->callback([options, &status] { status = run(*options); });
}

}  // namespace trestle::inspect
