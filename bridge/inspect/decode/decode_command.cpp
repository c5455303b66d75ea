#include "bridge/inspect/decode/decode_command.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <csignal>
#include <iostream>
#include <memory>
#include <set>
#include <system_error>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/interface_options.hpp"
#include "bridge/cli/terminal.hpp"
#include "bridge/documents/hex_line.hpp"
#include "bridge/documents/problems.hpp"
#include "bridge/inspect/decode/capture_decoder.hpp"
#include "pcaps/capture_file.hpp"

namespace trestle::inspect {
namespace {

/// Writes JSON objects to a file descriptor, one a line, many lines at a time.
class LineOutput {
 public:
  /// Ignores SIGPIPE in the whole process: see closed().
  explicit LineOutput(int fd) : fd_{fd} { std::signal(SIGPIPE, SIG_IGN); }

  /// Throws std::system_error when it has to write and cannot.
  void print(const Json& object) {
    constexpr std::size_t buffer_bytes = std::size_t{64} << 10U;
    // JSON is UTF-8, but text from the network need not be.
    buffer_ += documents::printable_json(object.dump(-1, ' ', false, Json::error_handler_t::replace));
    buffer_ += '\n';
    if (buffer_.size() >= buffer_bytes) {
      flush();
    }
  }
  void flush() {
    for (std::string_view rest{buffer_}; !rest.empty() && !closed_;) {
      const ssize_t written = ::write(fd_, rest.data(), rest.size());
      if (written >= 0) {
        rest.remove_prefix(static_cast<std::size_t>(written));
      } else if (errno == EPIPE) {
        closed_ = true;
      } else if (errno != EINTR) {
        throw std::system_error{errno, std::generic_category(), "cannot write the output"};
      }
    }
    buffer_.clear();
  }

  /// The reader has closed its end (`| head`). That is no error: what is printed from now on is dropped.
  [[nodiscard]] bool closed() const noexcept { return closed_; }

 private:
  int fd_;
  std::string buffer_;
  bool closed_ = false;
};

struct Arguments {
  std::string file;
  bool hex = false;
  bool reassemble = false;
  std::vector<std::uint16_t> ports;
  cli::InterfaceOptions interfaces;
};

/// --interfaces takes all files behind it, also the capture when that is the last one.
void find_file(Arguments& arguments) {
  std::vector<std::string>& files = arguments.interfaces.files();
  const auto is_capture = [](const std::string& name) {
    return name == "-" || name.ends_with(".pcap") || name.ends_with(".pcapng") || name.ends_with(".cap");
  };
  if (arguments.file.empty() && !arguments.hex && files.size() > 1 && is_capture(files.back())) {
    arguments.file = files.back();
    files.pop_back();
  }
}

void tell(const char* colour, const char* kind, const std::string& text) {
  fmt::print(stderr, "{}{}:{} {}\n", colour, kind, cli::colours_for(STDERR_FILENO).off, text);
}

int status_of(std::uint64_t malformed) {
  return malformed > 0 ? cli::exit_failure : cli::exit_ok;
}

/// Reports what the objects on standard output cannot say.
void note(std::uint64_t count, const char* what) {
  if (count > 0) {
    tell(cli::colours_for(STDERR_FILENO).yellow, "note", fmt::format("{} {}", count, what));
  }
}

/// Else the output looks as if there were no description.
void note_of_strangers(const MessageDecoder& decoder, const describe::Interfaces* interfaces) {
  if (interfaces == nullptr || decoder.saw_described()) {
    return;
  }
  constexpr std::size_t most = 20;
  const auto list = [](const auto& all, const auto& word) {
    std::string text;
    std::size_t count = 0;
    for (const auto& one : all) {
      if (++count <= most) {
        text += (count == 1 ? "" : ", ") + word(one);
      }
    }
    return count > most ? text + fmt::format(" and {} more", count - most) : text;
  };
  const std::set<std::string>& others = decoder.undescribed();
  tell(cli::colours_for(STDERR_FILENO).yellow, "note",
       fmt::format("no message is of a service that the interfaces describe ({}); there are {}",
                   list(interfaces->model().services,
                        [](const describe::Service& service) {
                          return service.name +
                                 (service.id ? fmt::format(" 0x{:04x}", someip::value(*service.id)) : "") +
                                 (service.id_is_chosen ? ", an id that Trestle chose" : "");
                        }),
                   others.empty() ? "none at all"
                                  : "messages of " + list(others, [](const std::string& id) { return id; })));
}

constexpr const char* other_version_note =
    "messages have another interface version than the interfaces (described_version)";
constexpr const char* left_over_note =
    "messages have bytes left over behind their values (left_over): is the description as new as the sender?";

int decode_capture(const Arguments& arguments) {
  std::optional<pcaps::CaptureFile> file;
  try {
    file.emplace(arguments.file);
  } catch (const std::runtime_error& error) {
    tell(cli::colours_for(STDERR_FILENO).red, "error", error.what());
    return cli::exit_usage;
  }
  LineOutput output{STDOUT_FILENO};
  CaptureDecoder decoder{{arguments.reassemble, arguments.ports, arguments.interfaces.get()},
                         [&](const Json& object) { output.print(object); }};
  pcaps::Traffic traffic{decoder};
  // Somebody may watch the output while the recording grows.
  const bool live = arguments.file == "-" || cli::is_terminal(STDOUT_FILENO);
  while (!output.closed()) {
    const std::optional<pcaps::Frame> frame = file->next();
    if (!frame) {
      break;
    }
    traffic.on_frame(*frame);
    if (live) {
      output.flush();
    }
  }
  traffic.finish();
  decoder.finish();
  output.flush();
  if (output.closed()) {
    return status_of(decoder.messages().malformed());  // not read to its end, so nothing counts as missing
  }
  note(decoder.foreign_datagrams(),
       "UDP datagrams were not taken for SOME/IP (--port N takes all on a port for it)");
  note(decoder.foreign_streams(), "directions of TCP connections were not taken for SOME/IP (see --port)");
  note(traffic.fragments().dropped() + traffic.fragments().incomplete(), "IP packets lack fragments");
  note(decoder.messages().incomplete(), "segmented messages lack segments");
  note(decoder.messages().with_left_over(), left_over_note);
  note(decoder.messages().with_other_version(), other_version_note);
  note_of_strangers(decoder.messages(), arguments.interfaces.get());
  if (!file->error().empty()) {
    tell(cli::colours_for(STDERR_FILENO).red, "error",
         "the capture cannot be read to its end: " + file->error());
    return cli::exit_failure;
  }
  return status_of(decoder.messages().malformed());
}

void decode_line(MessageDecoder& decoder, const traffic::Place& place, std::string_view line) {
  const tl::expected<std::vector<std::byte>, std::size_t> bytes = documents::parse_hex_line(line);
  if (!bytes) {
    decoder.unreadable(
        place, {"bad_hex", "", bytes.error(),
                fmt::format("two hexadecimal digits expected, not complete at character {}", bytes.error())});
  } else if (bytes->empty()) {
    decoder.undecodable(place, 0, {}, someip::WireError::truncated);
  } else {
    decoder.datagram(place, *bytes);
  }
}

int decode_hex(const Arguments& arguments) {
  LineOutput output{STDOUT_FILENO};
  MessageDecoder decoder{arguments.reassemble,
                         {[&](const Json& object) { output.print(object); }, {}},
                         arguments.interfaces.get()};
  std::ios::sync_with_stdio(false);
  std::uint64_t number = 0;
  for (std::string line; !output.closed() && std::getline(std::cin, line);) {
    traffic::Place place;
    place.line = ++number;
    decode_line(decoder, place, line);
    // Flush, so that a sender that waits for the answer before its next line gets it.
    if (std::cin.rdbuf()->in_avail() <= 0) {
      output.flush();
    }
  }
  output.flush();
  if (!output.closed()) {
    note(decoder.incomplete(), "segmented messages lack segments");
    note(decoder.with_left_over(), left_over_note);
    note(decoder.with_other_version(), other_version_note);
    note_of_strangers(decoder, arguments.interfaces.get());
  }
  return status_of(decoder.malformed());
}

}  // namespace

void add_decode_command(CLI::App& app, int& status) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("decode", "Print the SOME/IP messages of a capture, one JSON object per line");
  CLI::Option* file =
      command->add_option("FILE", arguments->file, "Capture (pcap or pcapng); - for standard input");
  CLI::Option* hex = command->add_flag(
      "--hex", arguments->hex, "Read lines of hexadecimal from standard input, one message or datagram each");
  command->add_flag("--reassemble", arguments->reassemble,
                    "Also print the messages that SOME/IP-TP segments make up");
  CLI::Option* port = command->add_option(
      "--port", arguments->ports, "Take all that this UDP or TCP port carries for SOME/IP (may be repeated)");
  port->type_name("N")->check(CLI::Range(1, 65535))->excludes(hex);
  port->allow_extra_args(false);  // otherwise FILE would be taken for a port
  file->excludes(hex);
  arguments->interfaces.add_to(*command, "print names, and values beside payloads");
  command->footer(
      "docs/decode.md explains every field and how SOME/IP is told from other traffic. Examples:\n"
      "  trestle decode drive.pcapng --interfaces car.arxml | jq -c '[.service_name, .event_name, .values]'\n"
      "  trestle decode drive.pcapng | jq -c 'select(.sd) | .sd.entries[]'\n"
      "  tcpdump -i eth0 -U -w - udp | trestle decode -\n"
      "  echo '1234 0421 00000008 0001 0001 01 01 00 00' | trestle decode --hex\n"
      "Exit status: 0, or 1 when anything was malformed, or 2 when the capture cannot be opened.");
  command->callback([arguments, &status] {
    find_file(*arguments);
    if (!arguments->hex && arguments->file.empty()) {
      throw CLI::RequiredError{"FILE (or - or --hex)"};
    }
    arguments->interfaces.load();
    status = arguments->hex ? decode_hex(*arguments) : decode_capture(*arguments);
  });
}

}  // namespace trestle::inspect
