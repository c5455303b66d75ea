#include <fmt/format.h>

#include <memory>
#include <optional>
#include <utility>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/session.hpp"
#include "bridge/documents/format.hpp"
#include "bridge/inspect/tools/message_text.hpp"
#include "bridge/inspect/tools/service_arguments.hpp"
#include "bridge/inspect/tools/tool_commands.hpp"

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

/// The service to offer. Its handlers print the requests.
class Service {
 public:
  explicit Service(OfferArguments& options) : options_{options}, spec_{options.spec()} {
    options_.payload.resolve();
    const cli::PayloadOptions answers = options_.payload.of_type("--answer-type", options_.answer_type);
    for (const std::string& text : options_.methods) {
      const Definition method = parse_definition(text);
      // A method with its own type also answers with that type, unless it names another one.
      const cli::PayloadOptions& usual = method.type.empty() ? answers : options_.payload;
      const std::string& type = method.answer_type.empty() ? method.type : method.answer_type;
      add_method(cli::parse_id("--method", method.ids), method.type,
                 method.value ? usual.of_type("--method", type).parse(*method.value) : Bytes{},
                 ReturnCode::ok);
    }
    for (const std::string& text : options_.errors) {
      const auto [id, value] = split(text, '=');
      const auto format = documents::id_number(0x01, 0x5e);
      const auto code = format.read(value.value_or(""));
      if (!code) {
        throw CLI::ValidationError(
            "--error", fmt::format("expected METHOD=CODE, the code {}, found '{}'", format.expected, text));
      }
      add_method(cli::parse_id("--error", id), "", {}, ReturnCode{static_cast<std::uint8_t>(*code)});
    }
    for (const std::string& text : options_.fields) {
      add_field(parse_definition(text));
    }
    for (const std::string& id : options_.eventgroups) {
      spec_.eventgroups.push_back(
          {.id = someip::EventgroupId{cli::parse_id("--eventgroup", id)}, .events = notifiers_});
    }
    if (spec_.eventgroups.empty() && !notifiers_.empty()) {
      spec_.eventgroups.push_back({.id = someip::EventgroupId{1}, .events = notifiers_});
    }
  }

  /// Offers it until the session ends.
  void run() {
    const sd::NodeConfig network = options_.network.config();
    cli::Session session{options_.timeout_s};
    session_ = &session;
    sd::Node node{session.io, network, cli::Session::log(options_.quiet), cli::Session::warn};
    node_ = &node;
    offer_ = node.offer(std::move(spec_));
    session.run();
    node.shutdown();
  }

 private:
  /// @return false if it is no message of the type.
  bool print(const someip::Message& request, const Endpoint& from, const cli::PayloadOptions& payload) {
    const auto text = message_text(request, &from, payload);
    if (!text) {
      cli::Session::warn(text.error());
      return false;
    }
    session_->print(*text);
    return true;
  }

  void add_method(std::uint16_t id, const std::string& type, Bytes answer, ReturnCode code) {
    const auto handler = [this, code, payload = options_.payload.of_type("--method", type),
                          answer = std::make_shared<const Bytes>(std::move(answer))](
                             const someip::Message& request, sd::Responder responder) {
      if (!print(request, responder.caller(), payload)) {
        responder.error(ReturnCode::malformed_message);
      } else if (code != ReturnCode::ok) {
        responder.error(code);
      } else {
        respond(responder, answer);
      }
    };
    spec_.methods.push_back({.id = MethodId{id}, .handler = handler, .kind = someip::MethodKind::either});
  }

  /// Getter and setter are our own methods, so that their requests can be printed. The notifier is a field of
  /// the Node, which sends the value to new subscribers.
  void add_field(const Definition& definition) {
    const auto field = std::make_shared<Field>(parse_field(definition.ids));
    const cli::PayloadOptions payload = options_.payload.of_type("--field", definition.type);
    if (definition.value) {
      field->value = std::make_shared<const Bytes>(payload.parse(*definition.value));
    }
    if (field->notifier) {
      notifiers_.push_back(*field->notifier);
      spec_.fields.push_back(
          {.notifier = field->notifier, .value = field->value ? std::optional{*field->value} : std::nullopt});
    }
    if (field->getter) {
      spec_.methods.push_back(
          {.id = *field->getter,
           .handler = [this, field, payload](const someip::Message& request, sd::Responder responder) {
             print(request, responder.caller(), payload);
             if (field->value) {
               respond(responder, field->value);
             } else {
               responder.error(ReturnCode::not_ok);
             }
           }});
    }
    if (field->setter) {
      spec_.methods.push_back(
          {.id = *field->setter,
           .handler = [this, field, payload](const someip::Message& request, sd::Responder responder) {
             if (!print(request, responder.caller(), payload)) {
               responder.error(ReturnCode::malformed_message);
               return;
             }
             field->value = std::make_shared<const Bytes>(request.payload.begin(), request.payload.end());
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

  OfferArguments& options_;
  sd::ServiceSpec spec_;
  std::vector<MethodId> notifiers_;
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
      "for one method or field. To send events that belong to no field, use 'trestle notify'.\n"
      "Exit status: 0; 1 when the port is taken; 2 for a wrong command line.\n\n"
      "Examples:\n"
      "  trestle offer 0x1234.0x0001\n"
      "  trestle offer 0x1234.1 --method '1=00 01' --method 2 --error 3=0x21 --tcp --udp\n"
      "  trestle offer 0x1234.1 --method '1:std_msgs/msg/String:std_msgs/msg/Bool={data: true}' --method 2\n"
      "  trestle offer 0x1234.1 --field '0x10/0x11/0x8010={data: 21.5}' --type std_msgs/msg/Float64\n"
      "  trestle offer 0x1234.1 --eventgroup 1 --eventgroup 2 --major 2");
  const auto options = std::make_shared<OfferArguments>();
  command->add_option("SERVICE.INSTANCE", options->service, "Such as 0x1234.0x0001")->required();
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
  repeatable("--eventgroup", options->eventgroups, "ID",
             "Eventgroup with the notifiers of all fields; the default is 1");
  cli::option(*command, "--answer-type", options->answer_type, "PKG/MSG/TYPE",
              "Message type of what methods answer, if not --type");
  options->add_to(*command);
  command->callback([options, &status] {
    Service{*options}.run();
    status = cli::exit_ok;
  });
}

}  // namespace trestle::inspect
