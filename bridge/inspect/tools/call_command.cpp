#include <fmt/format.h>

#include <memory>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/options.hpp"
#include "bridge/cli/session.hpp"
#include "bridge/inspect/decode/message_json.hpp"
#include "bridge/inspect/tools/message_text.hpp"
#include "bridge/inspect/tools/other_versions.hpp"
#include "bridge/inspect/tools/tool_commands.hpp"
#include "sd/net/proxy.hpp"

namespace trestle::inspect {
namespace {

/// How often we try to send a request without answer, and then check whether it has been sent.
constexpr Duration sending_period = std::chrono::milliseconds{5};

struct CallArguments {
  cli::NetworkOptions network;
  cli::PayloadOptions payload;
  std::string service;
  std::string method;
  std::string value;
  std::string answer_type;
  unsigned major = 1;
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
    cli::Session::note("error: " + others.nobody_offers());
  }
  return accepted && unsent.expired() ? cli::exit_ok : cli::exit_failure;
}

int call(sd::Proxy& proxy, const OtherVersions& others, const sd::CallSpec& spec, Bytes payload,
         const cli::PayloadOptions& answer, cli::Session& session) {
  int status = cli::exit_failure;
  proxy.call(spec, std::move(payload), [&](boost::system::error_code error, const sd::Response& response) {
    session.finish();
    const bool answered = response.header.return_code != someip::ReturnCode::ok || !error;
    if (!error || (answered && answer.form() == cli::PayloadOptions::Form::json)) {
      const auto text = answer_text({response.header, response.payload}, answer);
      if (!text) {
        cli::Session::note("error: " + text.error());
        return;
      }
      session.print(*text);
    }
    status = error ? answered ? cli::exit_error_answer : cli::exit_failure : cli::exit_ok;
    if (error) {
      cli::Session::note(fmt::format(
          "error: {}{}", error == sd::CallFault::unavailable ? others.nobody_offers() : error.message(),
          response.payload.empty() ? "" : ": " + hex_digits(response.payload)));
    }
  });
  session.run();
  return status;
}

int run(CallArguments& options) {
  const cli::ServiceArgument service = cli::parse_service(options.service, true);
  sd::CallSpec spec{
      .method = someip::MethodId{cli::parse_id("METHOD", options.method)},
      .timeout = std::chrono::duration_cast<Duration>(std::chrono::duration<double>{options.timeout_s})};
  if (options.udp || options.tcp) {
    spec.transport = options.tcp ? Transport::tcp : Transport::udp;
  }
  const std::string response = options.payload.take_request_of_service();
  options.payload.resolve();
  const cli::PayloadOptions answer =
      options.payload.of_type("--answer-type", options.answer_type.empty() ? response : options.answer_type);
  Bytes payload = options.value.empty() ? Bytes{} : options.payload.parse(options.value);
  const sd::NodeConfig network = options.network.config();

  cli::Session session{options.forget ? options.timeout_s : 0};
  sd::Node node{session.io, network, cli::Session::log(options.quiet), cli::Session::warn};
  sd::Proxy proxy{node,
                  {.service = service.service,
                   .instance = service.instance,
                   .major = static_cast<std::uint8_t>(options.major)}};
  const OtherVersions others{node, service, options.major, options.quiet};
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
      "--type; without PAYLOAD the request is empty. With --type of a service, PKG/SRV/TYPE, they are its\n"
      "request and its response. Uses UDP or TCP, whichever is offered; if both are, TCP for requests that\n"
      "do not fit into a datagram.\n"
      "Exit status: 0 when it was answered, or sent with --fire-and-forget; 1 when there was no service, no\n"
      "answer in time, or an answer that is no message of the type; 2 for a wrong command line; 3 when the\n"
      "answer is an error.\n\n"
      "Examples:\n"
      "  trestle call 0x1234 0x0001 '00 01 02'\n"
      "  trestle call 0x1234.1 2 --type std_msgs/msg/Float64 --tcp\n"
      "  trestle call 0x1234.1 3 '{data: 21.5}' --type std_msgs/msg/Float64 --answer-type std_msgs/msg/Bool\n"
      "  trestle call 0x1234.1 4 '{data: true}' --type std_srvs/srv/SetBool\n"
      "  trestle call 0x1234 5 @image.bin.hex --fire-and-forget");
  const auto options = std::make_shared<CallArguments>();
  command->add_option("SERVICE", options->service, "SERVICE or SERVICE.INSTANCE, such as 0x1234.0x0001")
      ->required();
  command->add_option("METHOD", options->method, "Its id")->required();
  command->add_option("PAYLOAD", options->value, "Payload of the request");
  cli::option(*command, "--answer-type", options->answer_type, "PKG/MSG/TYPE",
              "Message type of the answer, if not --type");
  cli::add_major(*command, options->major);
  cli::add_seconds(*command, "--timeout", options->timeout_s,
                   "For finding the service and for the answer, together");
  CLI::Option* udp = command->add_flag("--udp", options->udp, "Call over UDP");
  command->add_flag("--tcp", options->tcp, "Call over TCP")->excludes(udp);
  command->add_flag("--fire-and-forget", options->forget, "End when the request has been sent");
  cli::add_quiet(*command, options->quiet);
  options->payload.add_to(*command);
  options->network.add_to(*command);
  command->callback([options, &status] { status = run(*options); });
}

}  // namespace trestle::inspect
