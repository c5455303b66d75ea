#include <fmt/format.h>

#include <memory>
#include <optional>
#include <utility>

#include "bridge/cli/exit_status.hpp"
#include "bridge/config/format.hpp"
#include "bridge/tools/message_text.hpp"
#include "bridge/tools/offer_options.hpp"
#include "bridge/tools/session.hpp"
#include "bridge/tools/tool_commands.hpp"

namespace trestle::bridge {
namespace {

using Bytes = std::vector<std::byte>;
using someip::MethodId;
using someip::ReturnCode;

struct Options : OfferOptions {
  std::vector<std::string> eventgroups;
  std::vector<std::string> methods;
  std::vector<std::string> errors;
  std::vector<std::string> fields;
  std::string answer_type;
};

/// What stands before and behind the first '='; nothing behind when there is none.
std::pair<std::string, std::optional<std::string>> split(const std::string& text) {
  const auto at = text.find('=');
  return at == std::string::npos ? std::pair{text, std::optional<std::string>{}}
                                 : std::pair{text.substr(0, at), std::optional{text.substr(at + 1)}};
}

/// GETTER/SETTER/NOTIFIER[=VALUE], each an id or '-'.
sd::FieldSpec parse_field(const std::string& text, const PayloadOptions& payload) {
  const auto [ids, value] = split(text);
  const auto first = ids.find('/');
  const auto second = first == std::string::npos ? first : ids.find('/', first + 1);
  if (second == std::string::npos) {
    throw CLI::ValidationError("--field",
                               fmt::format("expected GETTER/SETTER/NOTIFIER=VALUE, found '{}'", text));
  }
  const auto id = [](const std::string& part) {
    return part == "-" ? std::nullopt : std::optional{MethodId{parse_id("--field", part)}};
  };
  sd::FieldSpec field{.getter = id(ids.substr(0, first)),
                      .setter = id(ids.substr(first + 1, second - first - 1)),
                      .notifier = id(ids.substr(second + 1))};
  if (!field.getter && !field.setter && !field.notifier) {
    throw CLI::ValidationError("--field", fmt::format("'{}' has none of getter, setter and notifier", text));
  }
  if (value) {
    field.value = payload.parse(*value);
  }
  return field;
}

/// Makes the service, whose handlers print what comes.
class Service {
 public:
  explicit Service(Options& options) : options_{options}, spec_{options.spec()} {
    options_.payload.resolve();
    const PayloadOptions answers = options_.payload.of_type("--answer-type", options_.answer_type);
    for (const std::string& text : options_.methods) {
      const auto [id, value] = split(text);
      add_method(parse_id("--method", id), value ? answers.parse(*value) : Bytes{}, ReturnCode::ok);
    }
    for (const std::string& text : options_.errors) {
      const auto [id, value] = split(text);
      const auto format = id_number(0x01, 0x5e);
      const auto code = format.read(value.value_or(""));
      if (!code) {
        throw CLI::ValidationError(
            "--error", fmt::format("expected METHOD=CODE, the code {}, found '{}'", format.expected, text));
      }
      add_method(parse_id("--error", id), {}, ReturnCode{static_cast<std::uint8_t>(*code)});
    }
    for (const std::string& text : options_.fields) {
      add_field(parse_field(text, options_.payload));
    }
    for (const std::string& id : options_.eventgroups) {
      spec_.eventgroups.push_back(
          {.id = someip::EventgroupId{parse_id("--eventgroup", id)}, .events = notifiers_});
    }
    if (spec_.eventgroups.empty() && !notifiers_.empty()) {
      spec_.eventgroups.push_back({.id = someip::EventgroupId{1}, .events = notifiers_});
    }
  }

  /// Offers it until the session ends.
  void run() {
    const sd::NodeConfig network = options_.network.config();
    Session session{options_.timeout_s};
    session_ = &session;
    sd::Node node{session.io, network, options_.log()};
    node.offer(std::move(spec_));
    session.run();
    node.shutdown();
  }

 private:
  /// @return false: it is no message of the type.
  bool print(const someip::Message& request, const Endpoint* from) {
    const auto text = message_text(request, from, options_.payload);
    if (!text) {
      Session::note("warning: " + text.error());
      return false;
    }
    session_->print(*text);
    return true;
  }

  void add_method(std::uint16_t id, Bytes answer, ReturnCode code) {
    spec_.methods.push_back({.id = MethodId{id},
                             .handler =
                                 [this, code, answer = std::make_shared<const Bytes>(std::move(answer))](
                                     const someip::Message& request, sd::Responder responder) {
                                   if (!print(request, &responder.caller())) {
                                     responder.error(ReturnCode::malformed_message);
                                   } else if (code != ReturnCode::ok) {
                                     responder.error(code);
                                   } else {
                                     const ByteView bytes{*answer};
                                     responder.respond({&bytes, 1}, answer);
                                   }
                                 },
                             .kind = someip::MethodKind::either});
  }

  void add_field(sd::FieldSpec field) {
    if (field.notifier) {
      notifiers_.push_back(*field.notifier);
    }
    if (field.setter) {
      field.on_set = [this, id = *field.setter](ByteView wanted) -> someip::Result<Bytes, ReturnCode> {
        if (!print({{.service = spec_.service, .method = id}, wanted}, nullptr)) {
          return tl::unexpected{ReturnCode::malformed_message};
        }
        return Bytes{wanted.begin(), wanted.end()};
      };
    }
    spec_.fields.push_back(std::move(field));
  }

  Options& options_;
  sd::ServiceSpec spec_;
  std::vector<MethodId> notifiers_;
  Session* session_ = nullptr;  ///< while it is offered
};

}  // namespace

void add_offer_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("offer", "Offer a service: answer its methods, keep its fields");
  command->footer(
      "Runs until Ctrl-C or --timeout, then withdraws the offer. Requests are printed like events by "
      "'trestle "
      "subscribe';\n"
      "subscribers are told of on standard error. PAYLOAD and VALUE are text, @FILE or @-: hexadecimal, or "
      "values with\n"
      "--type. With it, requests that are no message of the type are answered with E_MALFORMED_MESSAGE. To "
      "send "
      "events that\n"
      "are no field, use 'trestle notify'.\n"
      "Exit status: 0; 1 when the port is taken; 2 for a wrong command line.\n\n"
      "Examples:\n"
      "  trestle offer 0x1234.0x0001\n"
      "  trestle offer 0x1234.1 --method '1=00 01' --method 2 --error 3=0x21 --tcp --udp\n"
      "  trestle offer 0x1234.1 --field '0x10/0x11/0x8010={data: 21.5}' --type std_msgs/msg/Float64\n"
      "  trestle offer 0x1234.1 --eventgroup 1 --eventgroup 2 --major 2");
  const auto options = std::make_shared<Options>();
  command->add_option("SERVICE.INSTANCE", options->service, "Such as 0x1234.0x0001")->required();
  const auto repeatable = [&](const char* name, std::vector<std::string>& values, const char* form,
                              const char* what) {
    command->add_option(name, values, std::string{what} + " (may be repeated)")
        ->type_name(form)
        ->allow_extra_args(false);
  };
  repeatable("--method", options->methods, "ID[=PAYLOAD]", "Method, and what it answers with");
  repeatable("--error", options->errors, "ID=CODE", "Method that answers with an error");
  repeatable("--field", options->fields, "GETTER/SETTER/NOTIFIER[=VALUE]",
             "Field, and its value; '-' in place of an id: it has none");
  repeatable("--eventgroup", options->eventgroups, "ID",
             "Eventgroup, with the notifiers of all fields; without any it is 1");
  command
      ->add_option("--answer-type", options->answer_type,
                   "Message type of what methods answer, if not --type")
      ->type_name("PKG/MSG/TYPE");
  options->add_to(*command);
  command->callback([options, &status] {
    Service{*options}.run();
    status = exit_ok;
  });
}

}  // namespace trestle::bridge
