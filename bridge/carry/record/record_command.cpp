#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <ctime>
#include <memory>
#include <string_view>
#include <utility>

#include "bridge/carry/commands/explain.hpp"
#include "bridge/carry/config/topic_pattern.hpp"
#include "bridge/carry/record/dds_place.hpp"
#include "bridge/carry/record/record_commands.hpp"
#include "bridge/carry/record/someip_recorder.hpp"
#include "bridge/carry/record/topic_recorder.hpp"
#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/interface_options.hpp"
#include "bridge/cli/option.hpp"
#include "bridge/cli/options.hpp"
#include "bridge/traffic/live/live_frames.hpp"
#include "pcaps/capture_file.hpp"

namespace trestle::carry {
namespace {

using namespace std::chrono_literals;

constexpr Duration count_period = 1s;

struct RecordArguments {
  std::string to;
  std::string config;
  std::vector<std::string> topics;
  std::string interface;
  std::string capture;
  std::string pcapng;
  std::string compression = "lz4";
  std::uint64_t chunk_bytes = std::uint64_t{4} << 20U;
  std::uint64_t max_bytes = 0;
  std::uint64_t queue_bytes = std::uint64_t{256} << 20U;
  double max_duration_s = 0;
  double for_s = 0;
  std::optional<std::uint32_t> domain;
  std::vector<std::string> msg_path;
  bool no_dds = false;
  bool progress = false;
  bool quiet = false;
  cli::NetworkOptions network;
  cli::InterfaceOptions interfaces;
};

record::RecorderSettings settings_of(const RecordArguments& arguments) {
  record::RecorderSettings settings;
  settings.to = arguments.to.empty()
                    ? fmt::format("record_{:%Y_%m_%d-%H_%M_%S}", fmt::localtime(std::time(nullptr)))
                    : arguments.to;
  settings.pcapng = arguments.pcapng;
  settings.mcap.compression = arguments.compression == "none"  ? record::Compression::none
                              : arguments.compression == "lz4" ? record::Compression::lz4
                                                               : record::Compression::zstd;
  settings.mcap.chunk_bytes = arguments.chunk_bytes;
  settings.max_file_bytes = arguments.max_bytes;
  settings.max_file_duration = std::chrono::duration_cast<std::chrono::nanoseconds>(
      std::chrono::duration<double>{arguments.max_duration_s});
  settings.queue_bytes = arguments.queue_bytes;
  settings.waits = !arguments.capture.empty();  // a file can wait
  return settings;
}

/// What to listen to, by the configuration of a bridge or by the command line.
TopicRecorder::Settings topics_of(const RecordArguments& arguments,
                                  const std::optional<BridgeConfig>& config) {
  TopicRecorder::Settings settings;
  settings.participant = dds_place(config, arguments.domain, "record");
  settings.types = config ? config->types : messages::TypePlaces{};
  settings.types.folders.insert(settings.types.folders.end(), arguments.msg_path.begin(),
                                arguments.msg_path.end());
  settings.patterns = arguments.topics;
  if (settings.patterns.empty() && config) {
    for (const Route& route : config->routes) {
      settings.patterns.push_back(route.topic);
    }
    for (const TopicPattern& pattern : config->patterns) {
      settings.patterns.push_back(pattern.topics);
    }
  } else if (settings.patterns.empty()) {
    settings.patterns = {"/**"};
  }
  return settings;
}

/// What a loss of the recorder means, for a person.
std::string in_words(std::string_view loss) {
  constexpr std::array<std::pair<std::string_view, const char*>, 5> words{{
      {"queue_full", "messages came faster than the disk took them (queue_full)"},
      {"write_failed", "messages could not be written (write_failed)"},
      {"too_many_channels", "messages had no channel left (too_many_channels)"},
      {"frames_queue_full", "frames came faster than the disk took them (queue_full)"},
      {"frames_write_failed", "frames could not be written (write_failed)"},
  }};
  const auto found = std::ranges::find(words, loss, [](const auto& one) { return one.first; });
  return found == words.end() ? fmt::format("were dropped ({})", loss) : found->second;
}

/// What is missing, by reason; empty: nothing.
std::vector<std::pair<std::string, std::uint64_t>> losses(const record::RecorderCounters& recorder,
                                                          const record::Texts& elsewhere) {
  std::vector<std::pair<std::string, std::uint64_t>> all;
  recorder.for_each_counter([&](const char* name, std::uint64_t count, someip::CounterKind kind) {
    if (kind == someip::CounterKind::loss) {
      all.emplace_back(in_words(name), count);
    }
  });
  for (const auto& [name, count] : elsewhere) {
    all.emplace_back(fmt::format("were lost before ({})", name), std::stoull(count));
  }
  std::erase_if(all, [](const auto& one) { return one.second == 0; });
  return all;
}

/// Sources and the recorder, put together.
class Recording {
 public:
  Recording(const RecordArguments& arguments, const std::optional<BridgeConfig>& config)
      : arguments_{arguments}, session_{arguments.for_s}, recorder_{settings_of(arguments)} {
    const auto note = cli::Session::log(arguments.quiet);
    if (!arguments.interface.empty() || !arguments.capture.empty()) {
      someip_.emplace(recorder_, arguments.interfaces.get(), arguments.network.config_without_address().port);
    }
    if (!arguments.interface.empty()) {
      frames_.emplace(
          session_, traffic::where_of(arguments.interface, arguments.network),
          [this](const pcaps::Frame& frame) { someip_->on_frame(frame); },
          [](ByteView, const Endpoint&, const Endpoint&) {});
      if (!frames_->captures()) {
        throw std::runtime_error{"SOME/IP cannot be recorded without the right to capture frames"};
      }
      note(fmt::format("recording SOME/IP of {}", frames_->where()));
    }
    if (!arguments.no_dds && arguments.capture.empty()) {
      TopicRecorder::Settings settings = topics_of(arguments, config);
      settings.note = note;
      topics_.emplace(session_.io, std::move(settings), recorder_);
    }
  }

  int run() {
    if (!arguments_.capture.empty()) {
      read_capture();
    } else {
      tell_progress();
      session_.every(count_period, [this] {
        recorder_.note_losses(lost());
        tell_progress();
      });
      session_.run();
    }
    if (topics_) {
      topics_->stop();
    }
    if (someip_) {
      someip_->finish();
    }
    recorder_.note_losses(lost());
    recorder_.finish();
    const int status = report();
    if (frames_) {
      frames_->check();
    }
    return status;
  }

 private:
  void read_capture() {
    pcaps::CaptureFile file{arguments_.capture};
    // A capture may take longer than somebody wants to wait.
    for (;;) {
      session_.io.poll();
      if (session_.io.stopped()) {
        break;
      }
      const auto frame = file.next();
      if (!frame) {
        break;
      }
      someip_->on_frame(*frame);
    }
    if (!file.error().empty()) {
      cli::Session::warn(fmt::format("{} cannot be read to its end: {}", arguments_.capture, file.error()));
    }
  }

  [[nodiscard]] record::Texts lost() const {
    record::Texts all;
    const auto add = [&](const char* reason, std::uint64_t count) {
      all.emplace(reason, std::to_string(count));
    };
    if (topics_) {
      const dds::ReaderCounters dds = topics_->counters();
      add("dds_lost", dds.lost);
      add("dds_rejected", dds.rejected);
      add("dds_oversize", dds.oversize);
      add("dds_bad_encapsulation", dds.bad_encapsulation);
    }
    if (someip_) {
      const SomeipRecordCounters someip = someip_->counters();
      add("someip_malformed", someip.malformed);
      add("someip_incomplete", someip.incomplete);
    }
    if (frames_) {
      add("capture_dropped", frames_->dropped());
    }
    return all;
  }

  // Who wants this and goes away wants no more of the record: print() ends the session then.
  void tell_progress() {
    if (arguments_.progress) {
      const record::RecorderCounters counters = recorder_.counters();
      session_.print(fmt::format("{{\"messages\":{},\"bytes\":{}}}\n", counters.messages, counters.bytes));
    }
  }

  [[nodiscard]] int report() const {
    const record::RecorderCounters counters = recorder_.counters();
    const std::vector<std::string> files = recorder_.files();
    fmt::print("{} messages{} in {}\n", counters.messages,
               arguments_.pcapng.empty() ? "" : fmt::format(" and {} frames", counters.frames),
               fmt::join(files, ", "));
    for (const auto& [what, count] : losses(counters, lost())) {
      fmt::print("{} {}\n", count, what);
    }
    if (const std::string error = recorder_.error(); !error.empty()) {
      cli::Session::warn(fmt::format("not all could be written: {}", error));
    }
    return counters.lost_any() ? cli::exit_failure : cli::exit_ok;
  }

  const RecordArguments& arguments_;
  cli::Session session_;
  record::Recorder recorder_;
  std::optional<SomeipRecorder> someip_;
  std::optional<traffic::LiveFrames> frames_;
  std::optional<TopicRecorder> topics_;
};

int run(RecordArguments& arguments) {
  for (const std::string& pattern : arguments.topics) {
    if (!is_topic_pattern(pattern)) {
      throw CLI::ValidationError{
          "--topics", fmt::format("'{}' is no pattern of topics, such as /points or /sensing/**", pattern)};
    }
  }
  if (arguments.no_dds && arguments.interface.empty() && arguments.capture.empty()) {
    throw CLI::ValidationError{"--no-dds", "leaves nothing to record without --interface or --capture"};
  }
  if (!arguments.pcapng.empty() && arguments.interface.empty() && arguments.capture.empty()) {
    throw CLI::ValidationError{"--pcapng", "needs --interface or --capture"};
  }
  arguments.interfaces.load();
  std::optional<BridgeConfig> config;
  if (!arguments.config.empty()) {
    auto loaded = load_or_explain(arguments.config);
    if (!loaded) {
      return cli::exit_usage;
    }
    config = std::move(loaded->config);
  }
  Recording recording{arguments, config};
  return recording.run();
}

}  // namespace

void add_record_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("record", "Record topics and SOME/IP messages to MCAP files");
  command->footer(
      "Topics of ROS 2 are recorded as they come, with their type and quality of service, and with "
      "--interface\n"
      "the SOME/IP messages of a network beside them. A folder is a bag of rosbag2; Foxglove, rosbags and\n"
      "'trestle replay' read the files, too. It ends on Ctrl-C. What cannot be kept is dropped, counted, "
      "and\n"
      "told at the end. docs/record.md is the guide.\n"
      "Exit status: 0; 1 when something could not be recorded; 2 for a wrong command line or "
      "configuration.\n\n"
      "Examples:\n"
      "  trestle record\n"
      "  trestle record -o drive --topics /points '/sensing/**' --max-size 1GiB\n"
      "  trestle record -o drive --config bridge.yaml --interface eth0 --interfaces car.arxml\n"
      "  trestle record -o someip.mcap --no-dds --interface eth0 --pcapng someip.pcapng --for 60\n"
      "  trestle record -o old.mcap --capture drive.pcapng");
  const auto arguments = std::make_shared<RecordArguments>();
  command
      ->add_option("-o,--output", arguments->to,
                   "A new folder, or a new file if it ends in .mcap (default: a folder named by the time)")
      ->type_name("DIR|FILE");
  command
      ->add_option(
          "--topics", arguments->topics,
          "Topics of ROS 2, as patterns: * is any name, ** any levels (default: those of --config, else all)")
      ->type_name("PATTERN");
  command
      ->add_option("--config", arguments->config,
                   "A bridge's configuration: its DDS settings, types and topics")
      ->type_name("FILE");
  add_domain(*command, arguments->domain);
  command
      ->add_option("--msg-path", arguments->msg_path,
                   "Folder with .msg packages, searched before AMENT_PREFIX_PATH (may be repeated)")
      ->type_name("DIR")
      ->allow_extra_args(false);
  CLI::Option* interface = command
                               ->add_option("--interface", arguments->interface,
                                            "Also record SOME/IP of this network interface, or any")
                               ->type_name("NAME");
  CLI::Option* capture = command
                             ->add_option("--capture", arguments->capture,
                                          "Record SOME/IP of a capture (pcap or pcapng), and nothing else")
                             ->type_name("FILE")
                             ->excludes(interface);
  command->add_flag("--no-dds", arguments->no_dds, "Record no topics")->excludes(capture);
  command
      ->add_option("--pcapng", arguments->pcapng, "Also write the frames that carry SOME/IP to this new file")
      ->type_name("FILE");
  cli::option(*command, "--compression", arguments->compression, "HOW",
              "Of chunks: none, lz4 or zstd (smaller and slower)", CLI::IsMember({"none", "lz4", "zstd"}));
  const auto size = [&](const char* name, std::uint64_t& value, const char* what) {
    return command->add_option(name, value, what)->type_name("SIZE")->transform(CLI::AsSizeValue(false));
  };
  size("--max-size", arguments->max_bytes, "Begin another file when one has this size: 500MB, 1GiB");
  cli::add_seconds(*command, "--max-duration", arguments->max_duration_s,
                   "Begin another file after this time");
  size("--chunk-size", arguments->chunk_bytes,
       "Write when so much has come, or after a second (default: 4MiB)")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{256} << 20U));
  size("--queue", arguments->queue_bytes, "What may wait for the disk; more is dropped (default: 256MiB)");
  cli::add_seconds(*command, "--for", arguments->for_s, "End after this time");
  command
      ->add_flag("--progress", arguments->progress,
                 "Print what the record has as a line of JSON each second; it ends when nobody reads these")
      ->excludes(capture);
  arguments->network.add_to(*command);
  arguments->interfaces.add_to(*command, "name the topics of SOME/IP messages");
  cli::add_quiet(*command, arguments->quiet);
  command->callback([arguments, &status] { status = run(*arguments); });
}

}  // namespace trestle::carry
