#include "bridge/measure/demo/screen.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>

#include "bridge/cli/terminal.hpp"

namespace trestle::measure::demo {
namespace {

constexpr std::int64_t redraw_every_ns = second_ns / 5;
constexpr std::int64_t line_every_ns = 2 * second_ns;
constexpr std::size_t logs_shown = 8;

struct LegText {
  const char* checkpoints;
  const char* what;
};
constexpr std::array<LegText, leg_count> leg_texts{{{"①→②", "DDS to SOME/IP conversion"},
                                                    {"②→③", "SOME/IP transport"},
                                                    {"③→④", "SOME/IP to DDS conversion"},
                                                    {"   ", "publish to receive"}}};

}  // namespace

std::string table(const Figures& figures, Figures::Rate rate, std::uint64_t lost,
                  const cli::Colours& colours) {
  const CloudCounts& counts = figures.counts();
  const auto count = [&](const char* name, std::uint64_t number, bool bad) {
    return fmt::format("{}{} {}{}", bad && number > 0 ? colours.red : "", name, number,
                       bad && number > 0 ? colours.off : "");
  };
  std::string out = fmt::format("  clouds   {}   {}   {}   {}\n", count("sent", counts.sent, false),
                                count("arrived intact", counts.arrived, false), count("lost", lost, true),
                                count("corrupt", counts.corrupt, true));
  out += fmt::format("  rate     {:.1f} clouds/s   {:.1f} MB/s\n\n", rate.clouds_per_second,
                     rate.megabytes_per_second);
  out += fmt::format("  {}{:<32}{:>10}  {:>10}{}\n", colours.dim, "time between checkpoints", "p50", "p99",
                     colours.off);
  for (std::size_t i = 0; i < leg_count; ++i) {
    const statistics::Histogram& samples = figures.leg(static_cast<Leg>(i));
    const bool any = samples.count() > 0;
    out += fmt::format("  {} {:<28}{:>10}  {:>10}\n", leg_texts[i].checkpoints, leg_texts[i].what,
                       any ? cli::duration_text(samples.percentile(50)) : "-",
                       any ? cli::duration_text(samples.percentile(99)) : "-");
  }
  return out;
}

std::string one_line(const Figures& figures, std::int64_t now_ns, std::chrono::seconds running) {
  if (!figures.discovered()) {
    return fmt::format("{:4} s  discovering: {}\n", running.count(), figures.missing());
  }
  const CloudCounts& counts = figures.counts();
  const Figures::Rate rate = figures.rate_now(now_ns);
  const statistics::Histogram& end_to_end = figures.leg(Leg::end_to_end);
  return fmt::format(
      "{:4} s  sent {}  arrived {}  lost {}  corrupt {}  {:.1f} clouds/s  {:.1f} MB/s  p50 {}  p99 {}\n",
      running.count(), counts.sent, counts.arrived, figures.lost(now_ns), counts.corrupt,
      rate.clouds_per_second, rate.megabytes_per_second, cli::duration_text(end_to_end.percentile(50)),
      cli::duration_text(end_to_end.percentile(99)));
}

Screen::Screen(std::string title, bool is_terminal, cli::Colours colours)
    : title_{std::move(title)}, is_terminal_{is_terminal}, colours_{colours} {
  std::printf("%s\n", title_.c_str());
  std::fflush(stdout);
}

void Screen::log(const std::string& line) {
  if (!is_terminal_) {
    std::printf("        %s\n", line.c_str());
    std::fflush(stdout);
    return;
  }
  last_logs_.push_back(line);
  if (last_logs_.size() > logs_shown) {
    last_logs_.pop_front();
  }
}

void Screen::redraw(const std::string& text) {
  std::string out;
  if (drawn_lines_ > 0) {
    out += fmt::format("\033[{}A", drawn_lines_);  // moves up, to the first line that was drawn before
  }
  out += "\033[J";  // clear from here on
  out += text;
  std::fputs(out.c_str(), stdout);
  std::fflush(stdout);
  drawn_lines_ = static_cast<std::size_t>(std::ranges::count(text, '\n'));
}

void Screen::update(const Figures& figures, std::int64_t now_ns) {
  if (started_ns_ < 0) {
    started_ns_ = now_ns;
  }
  if (now_ns < next_ns_) {
    return;
  }
  next_ns_ = now_ns + (is_terminal_ ? redraw_every_ns : line_every_ns);
  const std::chrono::seconds running{(now_ns - started_ns_) / second_ns};
  if (!is_terminal_) {
    std::fputs(one_line(figures, now_ns, running).c_str(), stdout);
    std::fflush(stdout);
    return;
  }
  std::string text = fmt::format("  time     {} s   {}{}{}\n", running.count(), colours_.yellow,
                                 figures.discovered() ? "" : "discovering", colours_.off);
  text += table(figures, figures.rate_now(now_ns), figures.lost(now_ns), colours_) + "\n";
  // Lines that do not fit the terminal would scroll or wrap, and the count of lines to overwrite would be
  // wrong.
  const cli::TerminalSize size = cli::terminal_size(STDOUT_FILENO);
  const auto used = static_cast<std::size_t>(std::ranges::count(text, '\n')) + 1;
  const std::size_t room = size.rows > used ? size.rows - used : 0;
  for (std::size_t i = last_logs_.size() - std::min(room, last_logs_.size()); i < last_logs_.size(); ++i) {
    text += fmt::format("  {}{}{}\n", colours_.dim,
                        last_logs_[i].substr(0, size.columns - std::min<std::size_t>(size.columns, 3)),
                        colours_.off);
  }
  redraw(text);
}

void Screen::finish(const Figures& figures, const std::string& fault) {
  std::string text = "\n";
  if (figures.discovered()) {
    text += table(figures, figures.rate(), figures.outstanding(), colours_) + "\n";
  }
  if (fault.empty()) {
    text += fmt::format("{}good:{} {} of {} clouds arrived, each one byte for byte as it was sent\n",
                        colours_.green, colours_.off, figures.counts().arrived, figures.counts().sent);
  } else {
    text += fmt::format("{}failed:{} {}\n", colours_.red, colours_.off, fault);
  }
  if (is_terminal_) {
    redraw(text);
  } else {
    std::fputs(text.c_str(), stdout);
    std::fflush(stdout);
  }
}

}  // namespace trestle::measure::demo
