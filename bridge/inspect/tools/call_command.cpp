#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <boost/asio/steady_timer.hpp>
#include <limits>
#include <memory>
#include <utility>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/interface_options.hpp"
#include "bridge/cli/options.hpp"
#include "bridge/cli/protection.hpp"
#include "bridge/cli/session.hpp"
#include "bridge/inspect/decode/message_json.hpp"
#include "bridge/inspect/tools/beside_bridge.hpp"
#include "bridge/inspect/tools/message_text.hpp"
#include "bridge/inspect/tools/other_versions.hpp"
#include "bridge/inspect/tools/tool_commands.hpp"
#include "bridge/messages/values/left_out.hpp"
#include "sd/net/proxy.hpp"

namespace trestle::inspect {
namespace {

/// How often we try to send a request without answer, and then check whether it has been sent.
constexpr Duration sending_period = std::chrono::milliseconds{5};

struct CallArguments {
  cli::NetworkOptions network;
  cli::TlsOptions tls;
  cli::InterfaceOptions interfaces;
  cli::PayloadOptions payload;
  std::string service;
  std::string method;
  std::string value;
  std::string answer_type;
  unsigned major = 1;
  CLI::Option* major_option = nullptr;
  double timeout_s = 5;
  bool udp = false;
  bool tcp = false;
  bool forget = false;
  bool quiet = false;
};

using Bytes = std::vector<std::byte>;

// Sends a fire-and-forget request; returns the exit status.
int send(const sd::Proxy& proxy, const OtherVersions& others, const sd::CallSpec& spec, Bytes payload,
         cli::Session& session) {
  boost::asio::steady_timer timeout{session.io, spec.timeout};
  timeout.async_wait([&session](boost::system::error_code) { session.finish(); });
  auto bytes = std::make_shared<const Bytes>(std::move(payload));
  const std::weak_ptr<const Bytes> unsent = bytes;
  bool accepted = false;
  session.every(sending_period, [&] {
    accepted = accepted || proxy.send(spec, *bytes, bytes);
    if (accepted) {
      bytes.reset();  // from now on only the node holds it, until it has been sent
      if (unsent.expired()) {
        session.finish();
      }
    }
  });
  session.run();
  if (!accepted) {
    cli::Session::note("error: " + others.nobody_offers(spec.transport));
  }
  return accepted && unsent.expired() ? cli::exit_ok : cli::exit_failure;
}

/// The errors with which the method may answer, by the description.
std::string possible_errors(const cli::PayloadOptions& answer) {
  const auto* const described = answer.described();
  if (described == nullptr || described->element->part != describe::ServiceElement::Part::method) {
    return {};
  }
  const describe::Service& service = described->interfaces->model().services[described->element->service];
  const std::vector<std::string>& errors = service.methods[described->element->member].application_errors;
  return errors.empty() ? std::string{} : fmt::format("; its errors are {}", fmt::join(errors, ", "));
}

/// How a call ended.
struct Outcome {
  bool answered = false;
  std::string fault{};  ///< empty: it went well
  someip::Message answer{};
};

/// @return the exit status.
int tell(const Outcome& outcome, const cli::PayloadOptions& answer, cli::Session& session) {
  const bool failed = !outcome.fault.empty();
  if (!failed || (outcome.answered && answer.form() == cli::PayloadOptions::Form::json)) {
    const PayloadText text = answer_text(outcome.answer, answer);
    session.print(text.text);
    if (!text.fault.empty()) {
      cli::Session::note("error: " + text.fault);
      return cli::exit_failure;
    }
  }
  if (failed) {
    const ByteView payload = outcome.answer.payload;
    cli::Session::note(fmt::format("error: {}{}{}", outcome.fault,
                                   payload.empty() ? "" : ": " + hex_digits(payload),
                                   outcome.answered ? possible_errors(answer) : ""));
  }
  return !failed ? cli::exit_ok : outcome.answered ? cli::exit_error_answer : cli::exit_failure;
}

int call(sd::Proxy& proxy, const OtherVersions& others, const sd::CallSpec& spec, Bytes payload,
         const cli::PayloadOptions& answer, cli::Session& session) {
  int status = cli::exit_failure;
  proxy.call(spec, std::move(payload), [&](boost::system::error_code error, const sd::Response& response) {
    session.finish();
    const bool answered = response.header.return_code != someip::ReturnCode::ok || !error;
    const auto* const check = response.check ? &*response.check : nullptr;
    const std::string failed = check == nullptr ? "" : cli::failed_check(*check, "the answer");
    const std::string fault = !error                                ? ""
                              : !failed.empty()                     ? failed
                              : error == sd::CallFault::unavailable ? others.nobody_offers(spec.transport)
                                                                    : error.message();
    status = tell({answered, fault, {response.header, response.payload, check}}, answer, session);
  });
  session.run();
  return status;
}

/// The bridge that has the address calls, or sends.
int call_through(guest::Guest& bridge, const sd::RequireSpec& wanted, const sd::CallSpec& spec, Bytes payload,
                 bool forget, const cli::PayloadOptions& answer, cli::Session& session) {
  refuse_protection(bridge, !wanted.e2e.empty());
  int status = cli::exit_failure;
  static_cast<void>(listen(bridge, session, false, [&](const guest::Frame& frame) {
    const auto* const end = std::get_if<guest::Answer>(&frame);
    if (end == nullptr) {
      return;
    }
    session.finish();
    if (forget) {
      if (!end->fault.empty()) {
        cli::Session::note("error: " + end->fault);
      }
      status = end->fault.empty() ? cli::exit_ok : cli::exit_failure;
      return;
    }
    const auto message = someip::decode(end->message);
    status = tell({end->is_answer, end->fault, message ? *message : someip::Message{}}, answer, session);
  }));
  const auto timeout = std::chrono::ceil<std::chrono::milliseconds>(spec.timeout).count();
  bridge.say(guest::Call{.service = wanted.service,
                         .instance = wanted.instance,
                         .major = wanted.major,
                         .method = spec.method,
                         .timeout_ms = static_cast<std::uint32_t>(
                             std::min<std::int64_t>(timeout, std::numeric_limits<std::uint32_t>::max())),
                         .transport = spec.transport,
                         .forget = forget,
                         .payload = std::move(payload)});
  // The bridge says when the time is up, unless something has stopped it.
  boost::asio::steady_timer patience{session.io, spec.timeout + std::chrono::seconds{3}};
  patience.async_wait([&](boost::system::error_code error) {
    if (!error) {
      cli::Session::note("error: the bridge does not answer; it may be stopped, or very busy");
      session.finish();
    }
  });
  session.run();
  return status;
}

using Part = describe::ServiceElement::Part;

/// The method that is called: of a field without a value its getter, with one its setter.
const describe::ServiceElement& method_of(const std::vector<const describe::ServiceElement*>& elements,
                                          bool has_value) {
  for (const Part part : {Part::method, has_value ? Part::setter : Part::getter}) {
    const auto at = std::ranges::find(elements, part, &describe::ServiceElement::part);
    if (at != elements.end()) {
      return **at;
    }
  }
  const describe::ServiceElement& first = *elements.front();
  if (elements.size() == 1 && !first.is_event()) {
    return first;
  }
  throw CLI::ValidationError(
      "METHOD", first.is_field()
                    ? fmt::format("{} has no {}", first.member_name, has_value ? "setter" : "getter")
                    : fmt::format("{} is an event: see trestle subscribe", first.name));
}

struct Method {
  cli::Target target{};
  someip::MethodId id{};
  const describe::ServiceElement* element = nullptr;  ///< null: no description knows it
};

/// Reads SERVICE METHOD [PAYLOAD], or SERVICE.METHOD [PAYLOAD].
Method find_method(CallArguments& options) {
  const describe::Interfaces* const interfaces = options.interfaces.get();
  Method method{.target = cli::parse_target(interfaces, options.service, cli::UnnamedInstance::only_or_any)};
  if (!method.target.elements.empty()) {
    if (!options.value.empty()) {
      throw CLI::ValidationError(
          "PAYLOAD", fmt::format("{} is the method: expected one argument more", options.service));
    }
    options.value = std::exchange(options.method, {});
  } else if (options.method.empty()) {
    throw CLI::RequiredError("METHOD");
  } else if (cli::add_element(interfaces, method.target, "METHOD", options.method).empty()) {
    method.id = someip::MethodId{cli::parse_id("METHOD", options.method)};
    return method;
  }
  method.element = &method_of(method.target.elements, !options.value.empty());
  method.id = method.element->id;
  return method;
}

std::string names_of_values(const messages::MessageValues& values) {
  const messages::MessageDefinition& type = values.tree().root();
  const messages::Words* const words = values.words();
  if (words != nullptr && !words->argument.empty()) {
    return words->argument;
  }
  std::string names;
  for (std::size_t at = 0; at < type.fields.size(); ++at) {
    const auto& own =
        words == nullptr ? messages::Words::nothing : words->of(values.tree().messages.size() - 1);
    names += (at == 0 ? "" : ", ") + name_of(own, type, at);
  }
  return names;
}

/// Tells which arguments have values that nobody gave.
void tell_what_is_left_out(const cli::PayloadOptions& payload, const std::string& value, const Bytes& bytes) {
  // A file may be a pipe, which has been read.
  if (payload.described() == nullptr || payload.values() == nullptr || value.starts_with('@') ||
      payload.form() == cli::PayloadOptions::Form::hex) {
    return;
  }
  constexpr std::size_t longest = 20;
  const auto form = payload.form() == cli::PayloadOptions::Form::json ? messages::ValueForm::json
                                                                      : messages::ValueForm::yaml;
  const std::vector<std::string> names = messages::left_out(*payload.values(), value, form);
  const auto sent = payload.values()->print(bytes, messages::ValueForm::json, {.longest = longest});
  if (!names.empty() && sent) {
    cli::Session::warn(fmt::format("{} is left out; sent is {}", fmt::join(names, ", "), *sent));
  }
}

/// The payload of the request.
Bytes payload_of(const CallArguments& options, const cli::PayloadOptions& payload) {
  if (!options.value.empty()) {
    Bytes bytes = payload.parse(options.value);
    if (!options.quiet) {
      tell_what_is_left_out(payload, options.value, bytes);
    }
    return bytes;
  }
  const auto* const described = payload.described();
  if (described != nullptr && described->content->values) {
    throw CLI::ValidationError("PAYLOAD", fmt::format("{} needs values: {}", described->element->name,
                                                      names_of_values(*described->content->values)));
  }
  return described != nullptr && payload.values() == nullptr ? payload.parse({}) : Bytes{};
}

/// What the command line leaves to the description.
void apply_description(CallArguments& options, const Method& method, sd::CallSpec& spec) {
  if (method.target.described && options.major_option->count() == 0) {
    options.major = method.target.major;
  }
  if (method.element == nullptr) {
    return;
  }
  options.forget = options.forget || method.element->fire_and_forget;
  if (!options.udp && !options.tcp && method.element->transport == Transport::tcp) {
    spec.transport = Transport::tcp;
  }
}

int run(CallArguments& options) {
  options.interfaces.load();
  const Method method = find_method(options);
  const cli::ServiceArgument service = method.target.service;
  sd::CallSpec spec{
      .method = method.id,
      .timeout = std::chrono::duration_cast<Duration>(std::chrono::duration<double>{options.timeout_s})};
  if (options.udp || options.tcp) {
    spec.transport = options.tcp ? Transport::tcp : Transport::udp;
  }
  apply_description(options, method, spec);
  const std::string response = options.payload.take_request_of_service();
  options.payload.resolve(method.element != nullptr);
  cli::PayloadOptions request = options.payload;
  cli::PayloadOptions answer =
      options.payload.of_type("--answer-type", options.answer_type.empty() ? response : options.answer_type);
  if (method.element != nullptr) {
    request = request.of_element(*options.interfaces.get(), *method.element, false);
    answer = answer.of_element(*options.interfaces.get(), *method.element, true);
  }
  Bytes payload = payload_of(options, request);
  sd::RequireSpec wanted{.service = service.service,
                         .instance = service.instance,
                         .major = static_cast<std::uint8_t>(options.major)};
  if (method.element != nullptr) {
    wanted.e2e =
        cli::protection_of_call(*options.interfaces.get(), *method.element, wanted.instance, !options.forget);
    for (const sd::E2eSpec& e2e : wanted.e2e) {
      if (std::string why = cli::misfit_of_protection(e2e, method.element->name, payload); !why.empty()) {
        throw CLI::ValidationError("PAYLOAD", std::move(why));
      }
    }
  }
  const sd::NodeConfig network = options.tls.with(options.network.config());

  cli::Session session{0};
  const Way way = way_into(session, network, cli::named_log(options.interfaces.get(), options.quiet),
                           cli::named_warning(options.interfaces.get()), options.quiet);
  if (way.bridge) {
    return call_through(*way.bridge, wanted, spec, std::move(payload), options.forget, answer, session);
  }
  sd::Node& node = *way.node;
  sd::Proxy proxy{node, wanted};
  const OtherVersions others{node, service, options.major, options.interfaces.get(), options.quiet};
  const int status = options.forget ? send(proxy, others, spec, std::move(payload), session)
                                    : call(proxy, others, spec, std::move(payload), answer, session);
  node.shutdown();
  return status;
}

}  // namespace

void add_call_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("call", "Call a method of a service and print the answer");
  command->footer(
      "Waits for the service, calls, and prints the payload of the answer. Getters and setters of fields\n"
      "are methods, too. PAYLOAD is text, @FILE or @- (standard input): hexadecimal, or values with\n"
      "--type; without PAYLOAD the request is empty. With --type of a service, PKG/srv/TYPE, they are its\n"
      "request and its response. Uses UDP or TCP, whichever is offered; if both are, TCP for requests that\n"
      "do not fit into a datagram.\n"
      "With --interfaces, SERVICE.METHOD is a name, and values have the names of the description. A field\n"
      "is read without PAYLOAD and set with one; Door.label.get and Door.label.set say which. An argument "
      "that\n"
      "PAYLOAD leaves out is sent as zero, which a warning tells (without --quiet).\n"
      "Where a bridge of this host has the address, the call goes through that.\n"
      "Exit status: 0 when it was answered, or sent with --fire-and-forget; 1 when there was no service, no\n"
      "answer in time, or an answer that is no message of the type; 2 for a wrong command line; 3 when the\n"
      "answer is an error.\n\n"
      "Examples:\n"
      "  trestle call Door.open '{speed: FAST, opening: 80}' --interfaces Door.fidl Door.fdepl\n"
      "  trestle call Door.label '\"Push\"' --interfaces Door.fidl Door.fdepl\n"
      "  trestle call 0x1234 0x0001 '00 01 02'\n"
      "  trestle call 0x1234.1 2 --type std_msgs/msg/Float64 --tcp\n"
      "  trestle call 0x1234.1 3 '{data: 21.5}' --type std_msgs/msg/Float64 --answer-type std_msgs/msg/Bool\n"
      "  trestle call 0x1234.1 4 '{data: true}' --type std_srvs/srv/SetBool\n"
      "  trestle call 0x1234 5 @image.bin.hex --fire-and-forget");
  const auto options = std::make_shared<CallArguments>();
  command
      ->add_option("SERVICE", options->service,
                   "SERVICE or SERVICE.INSTANCE, such as 0x1234.0x0001; with --interfaces Door.open, or Door")
      ->required();
  command->add_option("METHOD", options->method, "Its id or name; not where SERVICE names it");
  command->add_option("PAYLOAD", options->value, "Payload of the request");
  cli::option(*command, "--answer-type", options->answer_type, "PKG/msg/TYPE",
              "Message type of the answer, if not --type");
  options->major_option = cli::add_major(*command, options->major);
  cli::add_seconds(*command, "--timeout", options->timeout_s,
                   "For finding the service and for the answer, together");
  CLI::Option* udp = command->add_flag("--udp", options->udp, "Call over UDP");
  command->add_flag("--tcp", options->tcp, "Call over TCP")->excludes(udp);
  command->add_flag("--fire-and-forget", options->forget, "End when the request has been sent");
  cli::add_quiet(*command, options->quiet);
  options->payload.add_to(*command);
  options->interfaces.add_to(*command, "call and print by their names");
  options->network.add_to(*command);
  options->tls.add_to(*command);
  command->callback([options, &status] { status = run(*options); });
}

}  // namespace trestle::inspect
