#include "bridge/conform/commands/replay_command.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <memory>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/shell_word.hpp"
#include "bridge/conform/commands/result_output.hpp"
#include "bridge/conform/replay/replay.hpp"
#include "bridge/conform/replay/rules.hpp"
#include "bridge/traffic/capture_reader.hpp"
#include "pcaps/capture_file.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::conform {
namespace {

struct ReplayArguments {
  std::vector<std::string> captures;
  std::vector<std::uint16_t> ports;
  std::vector<std::string> only;
  std::string host;
  std::string folder;
  bool quiet = false;
};

/// Whether a capture holds most packets twice. It is read for that alone.
bool holds_most_twice(const std::string& path, const ReplayArguments& arguments) {
  pcaps::CaptureFile file{path};
  CopyCount count;
  traffic::CaptureReader reader{arguments.ports, count};
  pcaps::Traffic traffic{reader};
  while (const auto frame = file.next()) {
    traffic.on_frame(*frame);
  }
  return count.most_twice();
}

/// @throws CLI::ValidationError when the file is no capture.
void read_capture(const std::string& path, const ReplayArguments& arguments, Replay& replay) {
  std::optional<pcaps::CaptureFile> file;
  try {
    file.emplace(path);
  } catch (const std::runtime_error& error) {
    throw CLI::ValidationError{"CAPTURE", error.what()};
  }
  const bool twice = holds_most_twice(path, arguments);
  if (twice) {
    fmt::print(stderr, "{}: holds most packets twice, as mirror ports make it; copies are left out\n", path);
  }
  traffic::CaptureReader reader{arguments.ports, replay};
  pcaps::Traffic traffic{reader};
  replay.begin(
      arguments.captures.size() == 1 ? "" : path,
      [&](Transport transport, const Endpoint& endpoint) { reader.learn(transport, endpoint); }, twice);
  while (const auto frame = file->next()) {
    traffic.on_frame(*frame);
  }
  traffic.finish();
  reader.finish();
  replay.end();
  if (!file->error().empty()) {
    fmt::print(stderr, "{}: cannot be read to its end: {}\n", path, file->error());
  }
}

int replay(const ReplayArguments& arguments) {
  const auto began = std::chrono::steady_clock::now();
  std::optional<IpAddress> host;
  if (!arguments.host.empty()) {
    host = someip::parse_address(arguments.host);
    if (!host) {
      throw CLI::ValidationError{"--host", "'" + arguments.host + "' is no IP address"};
    }
  }
  for (const std::string& selector : arguments.only) {
    if (choose(replay_rules(), {selector}, Level::tc8).empty()) {
      throw CLI::ValidationError{
          "--only", "'" + selector +
                        "' chooses no rule of replay. It is the id of a rule ('pcap.sd.session'), the start "
                        "of one ('pcap.sd'), a pattern ('*.session'), a TC8 id, or the id of a requirement"};
    }
  }
  Replay judge{host};
  std::string files;
  std::string words;
  for (const std::string& path : arguments.captures) {
    read_capture(path, arguments, judge);
    files += (files.empty() ? "" : " ") + path;
    words += " " + cli::shell_word(path);
  }
  const std::string ports =
      arguments.ports.empty() ? "" : fmt::format(" --port {}", fmt::join(arguments.ports, " --port "));
  const RunInfo info{.profile_file = files,
                     .device = host ? someip::to_string(*host) : files,
                     .folder = arguments.folder.empty() ? "." : arguments.folder,
                     .command = "trestle conform replay" + words + (host ? " --host " + arguments.host : "") +
                                ports + " --only"};
  RunResult run{.started = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)))};
  for (CaseResult& one :
       judge.results(std::filesystem::proximate(arguments.captures.front(), info.folder).string())) {
    if (arguments.only.empty() || std::ranges::any_of(arguments.only, [&](const std::string& selector) {
          return chosen(*one.what, selector);
        })) {
      run.cases.push_back(std::move(one));
    }
  }
  run.took = std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() - began);
  ResultTree tree{info};
  for (const CaseResult& one : run.cases) {
    if (!arguments.quiet || !is_good(one.outcome.verdict)) {
      if (!arguments.quiet || one.outcome.verdict != Verdict::unsupported) {
        tree.add(one);
      }
    }
  }
  fmt::print("{} messages; {}\n", judge.messages(), summary(run, tree.colours()));
  if (!arguments.folder.empty()) {
    std::filesystem::create_directories(arguments.folder);
    write_results(run, info);
  }
  return run.count(Verdict::fail) == 0 ? cli::exit_ok : cli::exit_failure;
}

}  // namespace

void add_replay_command(CLI::App& conform, int& status) {
  const auto arguments = std::make_shared<ReplayArguments>();
  CLI::App* one = conform.add_subcommand("replay", "Judge what a capture shows, without a device");
  one->add_option("CAPTURE", arguments->captures, "Captures, pcap or pcapng")->required();
  one->add_option("--host", arguments->host, "Judge only what this host sends")->type_name("IP");
  one->add_option("--port", arguments->ports,
                  "Take all that this UDP or TCP port carries for SOME/IP; can be repeated")
      ->type_name("N")
      ->check(CLI::Range(1, 65535))
      ->allow_extra_args(false);
  one->add_option("--only", arguments->only, "Only these rules, as SELECTOR of run; can be repeated")
      ->type_name("SELECTOR")
      ->allow_extra_args(false);
  one->add_option("--out", arguments->folder, "A folder for report.html, results.json and junit.xml")
      ->type_name("DIR");
  one->add_flag("-q,--quiet", arguments->quiet, "Print only rules that are broken");
  one->footer(
      "Examples:\n"
      "  trestle conform replay drive.pcapng --host 192.168.1.10\n"
      "  trestle conform replay monday.pcap tuesday.pcap --out results\n"
      "Exit status: 0 when no rule of the specification is broken, 1 when one is, 2 when a capture cannot be "
      "read or\nthe command line is wrong. docs/conform.md says what can be judged.");
  one->callback([arguments, &status] { status = replay(*arguments); });
}

}  // namespace trestle::conform
