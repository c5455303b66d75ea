#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <exception>
#include <memory>

#include "bridge/carry/commands/explain.hpp"
#include "bridge/carry/config/topic_pattern.hpp"
#include "bridge/carry/record/dds_place.hpp"
#include "bridge/carry/record/players.hpp"
#include "bridge/carry/record/record_commands.hpp"
#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/interface_options.hpp"
#include "bridge/cli/option.hpp"
#include "bridge/cli/options.hpp"
#include "bridge/cli/session.hpp"

namespace trestle::carry {
namespace {

using namespace std::chrono_literals;
using SteadyClock = std::chrono::steady_clock;

/// Messages that are sent before other handlers run.
constexpr int messages_at_a_time = 64;
/// How often it is looked whether receivers have come.
constexpr auto look_every = 20ms;
/// What is sent last has so long to leave.
constexpr auto time_to_leave = 500ms;

struct ReplayArguments {
  std::string file;
  std::string to = "dds";
  std::string config;
  std::vector<std::string> topics;
  std::vector<std::string> remaps;
  std::optional<std::uint32_t> domain;
  double speed = 1;
  double delay_s = 1;
  double wait_s = 0;
  bool loop = false;
  bool quiet = false;
  cli::NetworkOptions network;
  cli::InterfaceOptions interfaces;
};

/// "/a:=/b"
Remaps remaps_of(const std::vector<std::string>& texts) {
  Remaps remaps;
  for (const std::string& text : texts) {
    const std::size_t at = text.find(":=");
    const std::string from = text.substr(0, at);
    const std::string to = at == std::string::npos ? "" : text.substr(at + 2);
    if (!is_topic_pattern(from) || !is_topic_pattern(to) || text.find('*') != std::string::npos) {
      throw CLI::ValidationError{
          "--remap", fmt::format("expected two topics, such as /points:=/old/points, found '{}'", text)};
    }
    remaps.emplace_back(from, to);
  }
  return remaps;
}

/// Sends each message when its time has come.
class Playback {
 public:
  Playback(cli::Session& session, ReplaySource& source, Player& player, const ReplayArguments& arguments)
      : session_{session}, source_{source}, player_{player}, arguments_{arguments} {}

  /// @throws std::runtime_error  the recording is damaged.
  void run() {
    await_receivers(SteadyClock::now() + in_clock_units(arguments_.wait_s));
    session_.run();
    player_.stop();
    if (failure_) {
      std::rethrow_exception(failure_);
    }
  }

  [[nodiscard]] std::uint64_t sent() const noexcept { return sent_; }
  [[nodiscard]] std::chrono::duration<double> took() const { return SteadyClock::now() - begun_; }

 private:
  static SteadyClock::duration in_clock_units(double seconds) {
    return std::chrono::duration_cast<SteadyClock::duration>(std::chrono::duration<double>{seconds});
  }

  /// Then waits once more, and begins.
  void await_receivers(SteadyClock::time_point limit) {
    const bool ready = SteadyClock::now() >= limit || player_.has_receivers();
    timer_.expires_after(ready ? in_clock_units(arguments_.delay_s) : look_every);
    timer_.async_wait([this, ready, limit](const boost::system::error_code& error) {
      if (error) {
        return;
      }
      if (ready) {
        step();
      } else {
        await_receivers(limit);
      }
    });
  }

  void step() {
    try {
      send_due();
    } catch (const std::exception&) {
      failure_ = std::current_exception();
      session_.finish();
    }
  }

  void send_due() {
    for (int i = 0; i < messages_at_a_time; ++i) {
      if (!next_ && !read()) {
        return;
      }
      const SteadyClock::time_point due = due_of(next_->time);
      if (due > SteadyClock::now()) {
        wait_until(due);
        return;
      }
      sent_ += player_.play(*next_) ? 1 : 0;
      next_.reset();
    }
    boost::asio::post(session_.io, [this] { step(); });
  }

  /// @return false: it is over.
  bool read() {
    next_ = source_.next();
    if (!next_ && arguments_.loop && read_any_) {
      source_.rewind();
      first_.reset();
      next_ = source_.next();
    }
    if (!next_) {
      timer_.expires_after(time_to_leave);
      timer_.async_wait([this](const boost::system::error_code& error) {
        if (!error) {
          session_.finish();
        }
      });
      return false;
    }
    read_any_ = true;
    return true;
  }

  SteadyClock::time_point due_of(record::LogTime time) {
    if (!first_) {
      first_ = time;
      start_ = SteadyClock::now();
      begun_ = begun_ == SteadyClock::time_point{} ? start_ : begun_;
    }
    // What was recorded late, with an earlier time, is due at once.
    const double ns = time < *first_ ? 0 : static_cast<double>(time - *first_) / arguments_.speed;
    return start_ +
           std::chrono::duration_cast<SteadyClock::duration>(std::chrono::duration<double, std::nano>{ns});
  }

  void wait_until(SteadyClock::time_point due) {
    timer_.expires_at(due);
    timer_.async_wait([this](const boost::system::error_code& error) {
      if (!error) {
        step();
      }
    });
  }

  cli::Session& session_;
  ReplaySource& source_;
  Player& player_;
  const ReplayArguments& arguments_;
  boost::asio::steady_timer timer_{session_.io};
  std::optional<Replayed> next_;
  std::optional<record::LogTime> first_;
  bool read_any_ = false;
  SteadyClock::time_point start_{};
  SteadyClock::time_point begun_{};
  std::uint64_t sent_ = 0;
  std::exception_ptr failure_;
};

std::vector<const RecordedTopic*> wanted_topics(const ReplaySource& source,
                                                const ReplayArguments& arguments) {
  std::vector<const RecordedTopic*> topics = source.topics();
  std::erase_if(topics, [&](const RecordedTopic* topic) {
    return !arguments.topics.empty() &&
           std::ranges::none_of(arguments.topics,
                                [&](const std::string& pattern) { return matches(pattern, topic->name); });
  });
  if (topics.empty()) {
    throw std::runtime_error{
        arguments.topics.empty()
            ? "the recording has no topics; for its SOME/IP messages add --config FILE, or --to someip"
            : "the recording has none of these topics"};
  }
  return topics;
}

std::unique_ptr<Player> player_of(const ReplayArguments& arguments, std::optional<BridgeConfig>& config,
                                  cli::Session& session, ReplaySource& source) {
  const Remaps remaps = remaps_of(arguments.remaps);
  if (arguments.to == "someip") {
    return play_to_someip(session.io, arguments.network.config(), source, arguments.interfaces.get(),
                          cli::named_log(arguments.interfaces.get(), arguments.quiet));
  }
  const dds::ParticipantConfig participant = dds_place(config, arguments.domain, "replay");
  if (config) {
    return play_to_routes(session.io, participant, *config, remaps);
  }
  return play_to_topics(participant, wanted_topics(source, arguments), remaps,
                        cli::Session::log(arguments.quiet));
}

int run(ReplayArguments& arguments) {
  const bool to_someip = arguments.to == "someip";
  for (const auto& [given, name] :
       {std::pair{!arguments.topics.empty(), "--topics"}, std::pair{!arguments.remaps.empty(), "--remap"},
        std::pair{!arguments.config.empty(), "--config"},
        std::pair{arguments.domain.has_value(), "--domain"}}) {
    if (given && to_someip) {
      throw CLI::ValidationError{name, "is for --to dds"};
    }
  }
  if (!arguments.topics.empty() && !arguments.config.empty()) {
    throw CLI::ValidationError{
        "--topics", "is for recorded topics: what --config makes of SOME/IP follows from its routes"};
  }
  (void)remaps_of(arguments.remaps);
  arguments.interfaces.load();
  std::optional<BridgeConfig> config;
  if (!arguments.config.empty()) {
    auto loaded = load_or_explain(arguments.config);
    if (!loaded) {
      return cli::exit_usage;
    }
    config = std::move(loaded->config);
  }
  const std::unique_ptr<ReplaySource> source =
      open_recording(arguments.file, arguments.network.config_without_address().port);
  cli::Session session{0};
  const std::unique_ptr<Player> player = player_of(arguments, config, session, *source);
  Playback playback{session, *source, *player, arguments};
  playback.run();
  fmt::print("{} messages replayed\n", playback.sent());
  for (const auto& [what, count] : player->not_sent()) {
    if (count > 0) {
      fmt::print("not replayed: {} {}\n", count, what);
    }
  }
  if (source->unknown() > 0) {
    fmt::print("not replayed: {} messages of another encoding\n", source->unknown());
  }
  if (const std::string remark = source->remark(); !remark.empty()) {
    cli::Session::warn(remark);
  }
  return playback.sent() > 0 ? cli::exit_ok : cli::exit_failure;
}

}  // namespace

void add_replay_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("replay", "Send again what was recorded, in its own time");
  command->footer(
      "Topics go to DDS with their types and quality of service. SOME/IP events, also those of a capture, go "
      "to\n"
      "DDS through the routes of a bridge's configuration, or to SOME/IP: their services are offered. Calls "
      "are\n"
      "not replayed. It ends after the last message, or on Ctrl-C. docs/record.md is the guide.\n"
      "Exit status: 0; 1 when nothing was sent or the recording is damaged; 2 for a wrong command line or\n"
      "configuration.\n\n"
      "Examples:\n"
      "  trestle replay drive\n"
      "  trestle replay drive.mcap --topics /points --remap /points:=/old/points --speed 2 --loop\n"
      "  trestle replay drive.pcapng --config bridge.yaml\n"
      "  trestle replay drive.pcapng --to someip --interfaces car.arxml");
  const auto arguments = std::make_shared<ReplayArguments>();
  command
      ->add_option(
          "FILE", arguments->file,
          "Recording: an MCAP file, the folder of a bag with such files, or a capture (pcap or pcapng)")
      ->required();
  cli::option(*command, "--to", arguments->to, "SIDE", "Where to: dds or someip",
              CLI::IsMember({"dds", "someip"}));
  cli::option(*command, "--speed", arguments->speed, "FACTOR", "So many times as fast as it was",
              cli::number_between(0.001, 1000));
  command->add_flag("--loop", arguments->loop, "Begin again at the end");
  command
      ->add_option("--topics", arguments->topics,
                   "Recorded topics, as patterns: * is any name, ** any levels (default: all)")
      ->type_name("PATTERN");
  command
      ->add_option("--remap", arguments->remaps,
                   "Write the first topic under the second name (may be repeated)")
      ->type_name("/A:=/B")
      ->allow_extra_args(false);
  command
      ->add_option("--config", arguments->config,
                   "A bridge's configuration: its routes convert SOME/IP events to topics")
      ->type_name("FILE");
  add_domain(*command, arguments->domain);
  cli::option(*command, "--delay", arguments->delay_s, "SECONDS",
              "Time for receivers to find us before the first message", cli::number_between(0, 1e6));
  cli::option(*command, "--wait", arguments->wait_s, "SECONDS",
              "Before that, wait until each topic or event has a receiver, at most so long",
              cli::number_between(0, 1e6));
  arguments->network.add_to(*command);
  arguments->interfaces.add_to(*command, "tell eventgroups of events");
  cli::add_quiet(*command, arguments->quiet);
  command->callback([arguments, &status] { status = run(*arguments); });
}

}  // namespace trestle::carry
