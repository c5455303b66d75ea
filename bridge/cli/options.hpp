// bridge/cli: what the commands of `trestle` share.
//
//   options.hpp         options of the network, services, types and payloads; option.hpp: any option
//   interface_options.hpp  --interfaces, and arguments that are names
//   protection.hpp      end-to-end protection, as the descriptions have it
//   session.hpp         an io_context with time limit, signals and output
//   exit_status.hpp     what every command returns
//   on_signal.hpp, signals.hpp  Ctrl-C and SIGUSR1
//   terminal.hpp        colours, width, durations as text
//
// A command that needs something of another command's room finds it here, or puts it here.
#pragma once
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bridge/cli/option.hpp"
#include "bridge/describe/interfaces.hpp"
#include "bridge/messages/values/message_values.hpp"
#include "sd/net/node.hpp"

/// What the commands that talk to services have in common on their command lines. Whatever is wrong with a
/// value is thrown as CLI::ValidationError, which ends the program with exit status 2.
namespace trestle::cli {

/// What an argument means that is a text or stands in a file.
struct TextArgument {
  std::string text;
  std::string name;  ///< for error messages: that of the file, "standard input"
};
/// The text itself, or what stands in the file behind '@', a pipe too; "@-" is standard input. Not more is
/// read than a text may have, messages::max_text_bytes, and one part.
/// @param option  the option with this argument, for an error; `what` names the text that stands there
/// itself.
/// @throws CLI::ValidationError when the file cannot be read.
[[nodiscard]] TextArgument text_of_argument(const std::string& option, const std::string& what,
                                            const std::string& argument);

/// --address, --multicast, --sd-port
class NetworkOptions {
 public:
  void add_to(CLI::App& command);
  /// As it was given; empty: it was not.
  [[nodiscard]] const std::string& address() const noexcept { return address_; }
  [[nodiscard]] const std::string& multicast() const noexcept { return multicast_; }
  /// All but --address, for commands where that is something else.
  void add_group_to(CLI::App& command);
  /// As --address.
  void set_address(std::string address) { address_ = std::move(address); }

  /// @throws std::runtime_error when no address is given and none can be found.
  [[nodiscard]] sd::NodeConfig config() const;
  /// The same but for the address, which is the given one or nothing.
  [[nodiscard]] sd::NodeConfig config_without_address() const;

 private:
  std::string address_;
  std::string multicast_ = "224.244.224.245";
  std::uint16_t sd_port_ = 30490;
};

/// --tls-certificate and its like: TLS of TCP connections.
class TlsOptions {
 public:
  void add_to(CLI::App& command);
  /// With them in it, if there are any.
  [[nodiscard]] sd::NodeConfig with(sd::NodeConfig config) const;

 private:
  someip::TlsSettings settings_;
};

/// --type, --msg-path, --wire, --hex, --yaml, --json: how payloads are written.
class PayloadOptions {
 public:
  void add_to(CLI::App& command);

  /// Finds the type. Call once, before the others.
  /// @param described  payloads have the types of interface descriptions.
  void resolve(bool described = false);
  /// Before that, for a call: takes a service, "pkg/srv/Name", for its request.
  /// @return its response; nothing when the type is no service.
  std::string take_request_of_service();
  /// The same with the type that another option names; none: with the same type.
  [[nodiscard]] PayloadOptions of_type(const std::string& option, const std::string& type) const;
  /// The same for what an interface description says of an element: its names, and its type unless --type
  /// names another. Both must outlive the result.
  [[nodiscard]] PayloadOptions of_element(const describe::Interfaces& interfaces,
                                          const describe::ServiceElement& element, bool is_answer) const;
  /// The payload that an argument means: the text itself, or what stands in the file behind '@'; "@-" is
  /// standard input.
  [[nodiscard]] std::vector<std::byte> parse(const std::string& argument) const;

  enum class Form : std::uint8_t { hex, yaml, json };
  [[nodiscard]] Form form() const noexcept { return form_; }
  /// Nothing when no type is given.
  [[nodiscard]] const messages::MessageValues* values() const noexcept { return values_.get(); }

  /// What interface descriptions call this payload.
  struct Described {
    const describe::Interfaces* interfaces = nullptr;
    const describe::ServiceElement* element = nullptr;
    const describe::Content* content = nullptr;
  };
  /// Null: no description knows it.
  [[nodiscard]] const Described* described() const noexcept {
    return described_.element == nullptr ? nullptr : &described_;
  }

 private:
  void find_type(const char* option);

  std::string type_;
  std::vector<std::string> msg_path_;
  std::string wire_;
  messages::MessageRules rules_;
  bool hex_ = false;
  bool yaml_ = false;
  bool json_ = false;
  Form form_ = Form::hex;
  std::shared_ptr<const messages::MessageValues> values_;
  Described described_;
};

/// --udp, --tcp: the transport of offers and subscriptions. UDP by default; both options together mean both.
class TransportOptions {
 public:
  /// @param what  goes by them, for the help: "Events come".
  void add_to(CLI::App& command, const std::string& what);

  /// Whether the command line has one of them.
  [[nodiscard]] bool given() const noexcept { return udp_ || tcp_; }
  [[nodiscard]] bool udp() const noexcept { return udp_ || !tcp_; }
  [[nodiscard]] bool tcp() const noexcept { return tcp_; }

 private:
  bool udp_ = false;
  bool tcp_ = false;
};

/// Checks that a value is a number of this range: unlike CLI::Range also that it is one at all, no NaN.
[[nodiscard]] CLI::Validator number_between(double min, double max);

/// Times in seconds: above zero, and up to eleven days. 0 stands for an option that is not given.
CLI::Option* add_seconds(CLI::App& command, const char* name, double& seconds, const char* what);
/// --count: how many of something there are to be, at least one; likewise.
CLI::Option* add_count(CLI::App& command, std::uint64_t& count, const char* what);
/// --major, of a service.
CLI::Option* add_major(CLI::App& command, unsigned& major);
/// -q, --quiet.
void add_quiet(CLI::App& command, bool& quiet);

/// SERVICE.INSTANCE, such as "0x1234.0x0001" or "4660.1".
struct ServiceArgument {
  someip::ServiceId service{};
  someip::InstanceId instance = someip::any_instance;
};

/// @param any_instance  whether "0x1234" and "0x1234.*" are good, too.
[[nodiscard]] ServiceArgument parse_service(const std::string& text, bool any_instance);
/// An id from 1 to 0xfffe, decimal or hexadecimal after 0x.
/// @param name  of the argument, for the error.
[[nodiscard]] std::uint16_t parse_id(const std::string& name, const std::string& text);

}  // namespace trestle::cli
