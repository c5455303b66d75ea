#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/protection.hpp"
#include "bridge/cli/session.hpp"
#include "bridge/documents/format.hpp"
#include "bridge/inspect/tools/beside_bridge.hpp"
#include "bridge/inspect/tools/message_text.hpp"
#include "bridge/inspect/tools/service_arguments.hpp"
#include "bridge/inspect/tools/tool_commands.hpp"
#include "sd/net/e2e_channel.hpp"

namespace trestle::inspect {
namespace {

using Bytes = std::vector<std::byte>;
using someip::MethodId;
using someip::ReturnCode;

struct OfferArguments : ServiceArguments {
  std::vector<std::string> eventgroups;
  std::vector<std::string> methods;
  std::vector<std::string> errors;
  std::vector<std::string> fields;
  std::vector<std::string> events;
  bool all_events = false;
  double rate_hz = 1;
  std::string answer_type;
};

/// The texts before and after the first separator; no second text if there is no separator.
std::pair<std::string, std::optional<std::string>> split(const std::string& text, char separator) {
  const auto at = text.find(separator);
  return at == std::string::npos ? std::pair{text, std::optional<std::string>{}}
                                 : std::pair{text.substr(0, at), std::optional{text.substr(at + 1)}};
}

/// IDS[:TYPE[:ANSWER_TYPE]][=VALUE]
struct Definition {
  std::string ids;
  std::string type;
  std::string answer_type;
  std::optional<std::string> value;
};

Definition parse_definition(const std::string& text) {
  auto [names, value] = split(text, '=');
  auto [ids, types] = split(names, ':');
  auto [type, answer_type] = split(types.value_or(""), ':');
  return {std::move(ids), std::move(type), answer_type.value_or(""), std::move(value)};
}

/// A field: its ids and its value, which getters and setters share.
struct Field {
  std::optional<MethodId> getter;
  std::optional<MethodId> setter;
  std::optional<MethodId> notifier;
  std::shared_ptr<const Bytes> value;
};

/// GETTER/SETTER/NOTIFIER, each an id or '-'.
Field parse_field(const std::string& ids) {
  const auto [getter, rest] = split(ids, '/');
  const auto [setter, notifier] = split(rest.value_or(""), '/');
  if (!notifier) {
    throw CLI::ValidationError("--field",
                               fmt::format("expected GETTER/SETTER/NOTIFIER=VALUE, found '{}'", ids));
  }
  const auto id = [](const std::string& part) {
    return part == "-" ? std::nullopt : std::optional{MethodId{cli::parse_id("--field", part)}};
  };
  Field field{id(getter), id(setter), id(*notifier), {}};
  if (!field.getter && !field.setter && !field.notifier) {
    throw CLI::ValidationError("--field", fmt::format("'{}' has none of getter, setter and notifier", ids));
  }
  return field;
}

/// "Door.label" or "label" and not "1" or "-/2/3".
bool is_name(const std::string& text) {
  return !text.empty() && text.front() != '-' && (text.front() < '0' || text.front() > '9');
}

/// The service to offer. Its handlers print the requests.
class Service {
 public:
  explicit Service(OfferArguments& options) : options_{options}, target_{options.find_service()} {
    if (!target_.elements.empty()) {
      throw CLI::ValidationError("SERVICE.INSTANCE",
                                 fmt::format("'{}' is more than a service", options_.service));
    }
    spec_ = options.spec(target_);
    const cli::PayloadOptions answers = options_.payload.of_type("--answer-type", options_.answer_type);
    for (const std::string& text : options_.methods) {
      if (is_name(text)) {
        const auto [name, value] = split(text, '=');
        add_described_method(element("--method", name, describe::ServiceElement::Part::method), value,
                             ReturnCode::ok);
        continue;
      }
      const Definition method = parse_definition(text);
      // A method with its own type also answers with that type, unless it names another one.
      const cli::PayloadOptions& usual = method.type.empty() ? answers : options_.payload;
      const std::string& type = method.answer_type.empty() ? method.type : method.answer_type;
      add_method(
          MethodId{cli::parse_id("--method", method.ids)}, options_.payload.of_type("--method", method.type),
          method.value ? usual.of_type("--method", type).parse(*method.value) : Bytes{}, ReturnCode::ok);
    }
    for (const std::string& text : options_.errors) {
      add_error(text);
    }
    for (const std::string& text : options_.fields) {
      if (is_name(text)) {
        const auto [name, value] = split(text, '=');
        add_described_field(element("--field", name, std::nullopt), value);
        continue;
      }
      const Definition definition = parse_definition(text);
      add_field(parse_field(definition.ids), definition.value,
                options_.payload.of_type("--field", definition.type));
    }
    for (const std::string& text : options_.events) {
      if (is_name(text)) {
        const auto [name, value] = split(text, '=');
        add_described_event(element("--event", name, Part::event), value);
        continue;
      }
      const Definition event = parse_definition(text);
      const MethodId id{cli::parse_id("--event", event.ids)};
      const cli::PayloadOptions payload = options_.payload.of_type("--event", event.type);
      add_event(id, fmt::format("event {}", event.ids), event.value ? payload.parse(*event.value) : Bytes{});
      notifiers_.push_back(id);
    }
    for (const std::string& id : options_.eventgroups) {
      spec_.eventgroups.push_back(
          {.id = someip::EventgroupId{cli::parse_id("--eventgroup", id)}, .events = notifiers_});
    }
    add_rest_of_description();
    if (spec_.eventgroups.empty() && !notifiers_.empty()) {
      spec_.eventgroups.push_back({.id = someip::EventgroupId{1}, .events = notifiers_});
    }
    options.serve_over_tcp(target_, spec_);
    options.protect(spec_);
    leave_out_misfits();
  }

  /// Offers it until the session ends.
  void run() {
    const sd::NodeConfig network = options_.tls.with(options_.network.config());
    cli::Session session{options_.timeout_s};
    session_ = &session;
    const auto own =
        node_of_our_own(session, network, cli::named_log(options_.interfaces.get(), options_.quiet),
                        cli::named_warning(options_.interfaces.get()));
    sd::Node& node = *own;
    node_ = &node;
    offer_ = node.offer(std::move(spec_));
    if (!events_.empty()) {
      const std::chrono::duration<double> period{1 / options_.rate_hz};
      session.every(std::chrono::duration_cast<Duration>(period), [&] { send_events(); });
    }
    session.run();
    node.shutdown();
  }

 private:
  /// @return what the sender is told if it is no message of the type, or fails its E2E check; else ok.
  ReturnCode print(const someip::Message& request, const Endpoint& from, const cli::PayloadOptions& payload) {
    const PayloadText text = message_text(request, &from, payload);
    session_->print(text.text);
    for (const std::string& wrong : {text.fault, text.failed_check}) {
      if (!wrong.empty()) {
        cli::Session::warn(wrong);
      }
    }
    return !text.failed_check.empty() ? someip::e2e::code_of(request.check->status)
           : !text.fault.empty()      ? ReturnCode::malformed_message
                                      : ReturnCode::ok;
  }

  using Part = describe::ServiceElement::Part;

  [[nodiscard]] const describe::Interfaces& interfaces() const { return *options_.interfaces.get(); }

  /// An element of the description, or of a field any part.
  const describe::ServiceElement& element(const char* option, const std::string& name,
                                          std::optional<Part> part) {
    if (!target_.described) {
      throw CLI::ValidationError(
          option, fmt::format("'{}' is no id; names need --interfaces that describe the service", name));
    }
    for (const describe::ServiceElement* one : cli::add_element(&interfaces(), target_, option, name)) {
      if (part ? one->part == *part : one->is_field()) {
        return *one;
      }
    }
    throw CLI::ValidationError(option, fmt::format("{} is no {}", name,
                                                   part == Part::event    ? "event"
                                                   : part == Part::method ? "method"
                                                                          : "field"));
  }

  /// The payload that has the value of each default, where there can be one.
  static std::optional<Bytes> usual(const cli::PayloadOptions& payload) {
    if (payload.described()->content->is_empty) {
      return Bytes{};
    }
    if (payload.values() == nullptr) {
      return std::nullopt;
    }
    auto bytes = payload.values()->initial();
    return bytes ? std::optional{std::move(*bytes)} : std::nullopt;
  }

  /// @param option  that gives it one.
  static void tell_of_no_value(const cli::PayloadOptions& payload, const std::string& option) {
    const auto& described = *payload.described();
    cli::Session::warn(fmt::format(
        "{} is answered with E_NOT_OK unless {} gives its payload: {}", described.element->name, option,
        described.content->unknown.empty() ? "there is no value to begin with" : described.content->unknown));
  }

  /// An answer begins with an error where the method has one. Zero means that there is none; without a zero
  /// nothing does, and the answer begins with the first enumerator.
  void tell_of_usual_error(const describe::ServiceElement& method) const {
    const describe::Model& model = interfaces().model();
    const describe::TypeIndex error = model.services[method.service].methods[method.member].error;
    if (error == describe::no_type) {
      return;
    }
    const std::vector<describe::Enumerator> all =
        describe::all_enumerators(model, describe::resolved(model, error));
    if (!all.empty() && std::ranges::find(all, 0, &describe::Enumerator::value) == all.end()) {
      cli::Session::warn(fmt::format(
          "{} is answered with the error {}, the first of its errors, none of which is 0 (no error): "
          "--method '{}={{error: …}}' chooses another answer",
          method.name, all.front().name, method.member_name));
    }
  }

  /// METHOD=CODE
  void add_error(const std::string& text) {
    const auto [id, value] = split(text, '=');
    const auto format = documents::id_number(0x01, 0x5e);
    const auto code = format.read(value.value_or(""));
    if (!code) {
      throw CLI::ValidationError(
          "--error", fmt::format("expected METHOD=CODE, the code {}, found '{}'", format.expected, text));
    }
    const ReturnCode answer{static_cast<std::uint8_t>(*code)};
    if (is_name(id)) {
      add_described_method(element("--error", id, Part::method), std::nullopt, answer);
    } else {
      add_method(MethodId{cli::parse_id("--error", id)}, options_.payload.of_type("--method", ""), {},
                 answer);
    }
  }

  void add_described_method(const describe::ServiceElement& method, const std::optional<std::string>& value,
                            ReturnCode code) {
    described_.insert(&method);
    std::optional<Bytes> answer{std::in_place};
    if (code == ReturnCode::ok && !method.fire_and_forget) {
      const cli::PayloadOptions answers = options_.payload.of_element(interfaces(), method, true);
      answer = value ? answers.parse(*value) : usual(answers);
      if (!answer) {
        tell_of_no_value(answers, fmt::format("--method '{}=…'", method.member_name));
      } else if (!value && !options_.quiet) {
        tell_of_usual_error(method);
      }
    }
    add_method(method.id, options_.payload.of_element(interfaces(), method, false), answer.value_or(Bytes{}),
               answer ? code : ReturnCode::not_ok);
  }

  void add_described_field(const describe::ServiceElement& any, const std::optional<std::string>& value) {
    Field field;
    std::optional<cli::PayloadOptions> payload;
    for (const describe::ServiceElement* const part : interfaces().elements_of(*target_.described)) {
      if (!part->is_field() || part->member != any.member) {
        continue;
      }
      described_.insert(part);
      switch (part->part) {
        case Part::getter:
          field.getter = part->id;
          break;
        case Part::setter:
          field.setter = part->id;
          break;
        default:
          field.notifier = part->id;
          add_to_eventgroups(*part);
          break;
      }
      // What a getter answers is what the others carry.
      payload = options_.payload.of_element(interfaces(), *part, part->part == Part::getter);
    }
    const std::optional<Bytes> start = value ? std::optional{payload->parse(*value)} : usual(*payload);
    if (start) {
      field.value = std::make_shared<const Bytes>(*start);
    } else {
      tell_of_no_value(*payload, fmt::format("--field '{}=…'", any.member_name));
    }
    add_field(std::move(field), std::nullopt, *payload);
  }

  void add_event(MethodId id, std::string name, Bytes payload) {
    events_.push_back({id, std::move(name), std::make_shared<const Bytes>(std::move(payload))});
  }

  /// Events whose protection has no messages of their length.
  void leave_out_misfits() {
    for (const sd::E2eSpec& e2e : spec_.e2e) {
      std::erase_if(events_, [&](const SentEvent& event) {
        const std::string why =
            e2e.id == event.id ? cli::misfit_of_protection(e2e, event.name, *event.payload) : std::string{};
        if (!why.empty()) {
          cli::Session::warn(fmt::format("{} is not sent: {}", event.name, why));
        }
        return !why.empty();
      });
    }
  }

  void add_described_event(const describe::ServiceElement& event, const std::optional<std::string>& value) {
    described_.insert(&event);
    add_to_eventgroups(event);
    const cli::PayloadOptions payload = options_.payload.of_element(interfaces(), event, false);
    if (auto bytes = value ? std::optional{payload.parse(*value)} : usual(payload)) {
      add_event(event.id, event.name, std::move(*bytes));
    } else {
      cli::Session::warn(fmt::format(
          "{} is not sent unless --event '{}=…' gives its payload: {}", event.name, event.member_name,
          payload.described()->content->unknown.empty() ? "there is no value to begin with"
                                                        : payload.described()->content->unknown));
    }
  }

  void send_events() {
    for (const SentEvent& event : events_) {
      if (node_->subscribers(offer_, event.id) > 0) {
        const ByteView bytes{*event.payload};
        node_->notify(offer_, event.id, {&bytes, 1}, event.payload);
      }
    }
  }

  void add_to_eventgroups(const describe::ServiceElement& event) {
    if (!options_.eventgroups.empty()) {
      return;  // the command line says which there are
    }
    for (const someip::EventgroupId id : event.eventgroups) {
      const auto known = std::ranges::find(spec_.eventgroups, id, &sd::EventgroupSpec::id);
      sd::EventgroupSpec& group =
          known != spec_.eventgroups.end() ? *known : spec_.eventgroups.emplace_back();
      group.id = id;
      group.events.push_back(event.id);
    }
    options_.send_over_tcp({&event}, spec_);
  }

  /// Methods and fields that the command line does not name, and all events.
  void add_rest_of_description() {
    if (!target_.described) {
      return;
    }
    std::set<MethodId> taken;
    for (const sd::MethodSpec& method : spec_.methods) {
      taken.insert(method.id);
    }
    for (const describe::ServiceElement* const one : interfaces().elements_of(*target_.described)) {
      if (described_.contains(one) || taken.contains(one->id)) {
        continue;
      }
      if (one->part == Part::method) {
        add_described_method(*one, std::nullopt, ReturnCode::ok);
      } else if (one->part == Part::event && options_.all_events) {
        add_described_event(*one, std::nullopt);
      } else if (one->part == Part::event) {
        add_to_eventgroups(*one);
      } else {
        add_described_field(*one, std::nullopt);
      }
    }
  }

  void add_method(MethodId id, const cli::PayloadOptions& payload, Bytes answer, ReturnCode code) {
    const auto handler = [this, code, payload, answer = std::make_shared<const Bytes>(std::move(answer))](
                             const someip::Message& request, sd::Responder responder) {
      if (const ReturnCode refused = print(request, responder.caller(), payload); refused != ReturnCode::ok) {
        responder.error(refused);
      } else if (code != ReturnCode::ok) {
        responder.error(code);
      } else {
        respond(responder, answer);
      }
    };
    spec_.methods.push_back({.id = id, .handler = handler, .kind = someip::MethodKind::either});
  }

  /// Getter and setter are our own methods, so that their requests can be printed. The notifier is a field of
  /// the Node, which sends the value to new subscribers.
  void add_field(Field ids, const std::optional<std::string>& value, const cli::PayloadOptions& payload) {
    const auto field = std::make_shared<Field>(std::move(ids));
    const auto of_part = [&](const std::optional<MethodId>& id) {
      const auto* const described = payload.described();
      const describe::ServiceElement* const part =
          described == nullptr || !id ? nullptr : interfaces().element(spec_.service, spec_.major, *id);
      return part == nullptr ? payload : options_.payload.of_element(interfaces(), *part, false);
    };
    if (value) {
      field->value = std::make_shared<const Bytes>(payload.parse(*value));
    }
    if (field->notifier) {
      notifiers_.push_back(*field->notifier);
      spec_.fields.push_back(
          {.notifier = field->notifier, .value = field->value ? std::optional{*field->value} : std::nullopt});
    }
    if (field->getter) {
      spec_.methods.push_back({.id = *field->getter,
                               .handler = [this, field, payload = of_part(field->getter)](
                                              const someip::Message& request, sd::Responder responder) {
                                 print(request, responder.caller(), payload);
                                 if (field->value) {
                                   respond(responder, field->value);
                                 } else {
                                   responder.error(ReturnCode::not_ok);
                                 }
                               }});
    }
    if (field->setter) {
      spec_.methods.push_back({.id = *field->setter,
                               .handler = [this, field, payload = of_part(field->setter)](
                                              const someip::Message& request, sd::Responder responder) {
                                 const ReturnCode refused = print(request, responder.caller(), payload);
                                 if (refused != ReturnCode::ok) {
                                   responder.error(refused);
                                   return;
                                 }
                                 field->value = std::make_shared<const Bytes>(request.payload.begin(),
                                                                              request.payload.end());
                                 respond(responder, field->value);
                                 if (field->notifier) {
                                   node_->set_field(offer_, *field->notifier, *field->value);
                                 }
                               }});
    }
  }

  static void respond(sd::Responder& responder, const std::shared_ptr<const Bytes>& answer) {
    const ByteView bytes{*answer};
    responder.respond({&bytes, 1}, answer);
  }

  struct SentEvent {
    MethodId id{};
    std::string name;
    std::shared_ptr<const Bytes> payload;
  };

  OfferArguments& options_;
  cli::Target target_;
  sd::ServiceSpec spec_;
  std::set<const describe::ServiceElement*> described_;  ///< those that the command line names
  std::vector<MethodId> notifiers_;                      ///< and events without a description
  std::vector<SentEvent> events_;
  // While it is offered:
  cli::Session* session_ = nullptr;
  sd::Node* node_ = nullptr;
  sd::OfferHandle offer_{};
};

}  // namespace

void add_offer_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("offer", "Offer a service: answer its methods, keep its fields");
  command->footer(
      "Runs until Ctrl-C or --timeout, then withdraws the offer. It prints requests, also those to fields,\n"
      "like 'trestle subscribe' prints events; it reports subscribers on standard error. PAYLOAD and VALUE\n"
      "are text, @FILE or @-: hexadecimal, or values with a type. With a type, requests that are no message\n"
      "of it are answered with E_MALFORMED_MESSAGE. TYPE and ANSWER_TYPE replace --type and --answer-type\n"
      "for one method, event or field.\n"
      "With --interfaces the whole service is offered, at the port of the description: methods answer with\n"
      "zeros and fields begin so, unless --method, --error and --field say otherwise by name. With --events\n"
      "its events are sent, too, with zeros unless --event says otherwise.\n"
      "Exit status: 0; 1 when the port is taken; 2 for a wrong command line.\n\n"
      "Examples:\n"
      "  trestle offer Door --method 'open={done: true}' --field 'label=\"Push\"' --interfaces door/\n"
      "  trestle offer Door --events --event 'moved={opening: 50}' --rate 10 --interfaces door/\n"
      "  trestle offer 0x1234.0x0001\n"
      "  trestle offer 0x1234.1 --method '1=00 01' --method 2 --error 3=0x21 --tcp --udp\n"
      "  trestle offer 0x1234.1 --method '1:std_msgs/msg/String:std_msgs/msg/Bool={data: true}' --method 2\n"
      "  trestle offer 0x1234.1 --field '0x10/0x11/0x8010={data: 21.5}' --type std_msgs/msg/Float64\n"
      "  trestle offer 0x1234.1 --eventgroup 1 --eventgroup 2 --major 2");
  const auto options = std::make_shared<OfferArguments>();
  command->add_option("SERVICE.INSTANCE", options->service, "Such as 0x1234.0x0001; with --interfaces Door")
      ->required();
  const auto repeatable = [&](const char* name, std::vector<std::string>& values, const char* form,
                              const char* what) {
    command->add_option(name, values, std::string{what} + " (may be repeated)")
        ->type_name(form)
        ->allow_extra_args(false);
  };
  repeatable("--method", options->methods, "ID[:TYPE[:ANSWER_TYPE]][=PAYLOAD]", "Method and its answer");
  repeatable("--error", options->errors, "ID=CODE", "Method that answers with an error");
  repeatable("--field", options->fields, "GETTER/SETTER/NOTIFIER[:TYPE][=VALUE]",
             "Field and its value; '-' in place of an id: it has none");
  repeatable("--event", options->events, "ID[:TYPE][=PAYLOAD]",
             "Event that is sent to its subscribers again and again");
  cli::option(*command, "--rate", options->rate_hz, "HZ", "How often a second each event is sent",
              cli::number_between(0.001, 10'000));
  repeatable("--eventgroup", options->eventgroups, "ID",
             "Eventgroup with all events and notifiers of fields; the default is 1");
  cli::option(*command, "--answer-type", options->answer_type, "PKG/msg/TYPE",
              "Message type of what methods answer, if not --type");
  options->add_to(*command);
  command->add_flag("--events", options->all_events, "Send all events of the description")
      ->needs("--interfaces");
  command->callback([options, &status] {
    Service{*options}.run();
    status = cli::exit_ok;
  });
}

}  // namespace trestle::inspect
