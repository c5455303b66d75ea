#include "bridge/console/record_process.hpp"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <ctime>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

extern char** environ;  // NOLINT(readability-redundant-declaration): POSIX leaves it to us

namespace trestle::console {
namespace {

using boost::asio::posix::stream_descriptor;
using boost::system::error_code;
using std::chrono::steady_clock;
using std::chrono::system_clock;

constexpr std::chrono::seconds patience{10};
constexpr std::size_t words_max = 2048;  ///< of what a recorder says: its last ones
constexpr std::size_t line_max = 1024;

[[noreturn]] void fail(int error, const char* what) {
  throw std::system_error{error, std::generic_category(), what};
}

struct Recorder {
  pid_t process = -1;
  int ends = -1;    ///< a pidfd, readable when it has ended
  int output = -1;  ///< of both kinds
};

/// Starts this program once more. Not by fork(), which takes the longer the more memory the bridge has.
Recorder spawn(std::vector<std::string> words) {
  std::array<int, 2> pipe{-1, -1};
  if (::pipe2(pipe.data(), O_CLOEXEC) != 0) {
    fail(errno, "pipe2");
  }
  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&files);
  posix_spawnattr_init(&attributes);
  posix_spawn_file_actions_adddup2(&files, pipe[1], STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addclosefrom_np(&files, STDERR_FILENO + 1);  // sockets of DDS are inherited
  // What comes before the recorder can read signals waits for it, so that also then its files are whole.
  sigset_t waiting;
  sigemptyset(&waiting);
  sigaddset(&waiting, SIGINT);
  sigaddset(&waiting, SIGTERM);
  posix_spawnattr_setsigmask(&attributes, &waiting);
  sigset_t usual = waiting;
  sigaddset(&usual, SIGPIPE);
  posix_spawnattr_setsigdefault(&attributes, &usual);
  // A group of its own: Ctrl-C in the terminal is for the bridge alone, which ends the record then.
  posix_spawnattr_setflags(&attributes,
                           POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  std::vector<char*> arguments;
  for (std::string& word : words) {
    arguments.push_back(word.data());
  }
  arguments.push_back(nullptr);
  Recorder made;
  int error = ::posix_spawn(&made.process, "/proc/self/exe", &files, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  ::close(pipe[1]);
  if (error == 0) {
    // NOLINTNEXTLINE(*-vararg): glibc has no function for it before 2.36
    made.ends = static_cast<int>(::syscall(SYS_pidfd_open, made.process, 0));
    error = made.ends < 0 ? errno : 0;
    if (error != 0) {
      ::kill(made.process, SIGKILL);
      ::waitpid(made.process, nullptr, 0);
    }
  }
  if (error != 0) {
    ::close(pipe[0]);
    fail(error, "the recorder cannot be started");
  }
  made.output = pipe[0];
  return made;
}

}  // namespace

class RecordProcess::State : public std::enable_shared_from_this<State> {
 public:
  State(boost::asio::io_context& io, std::string configuration,
        std::function<void(bool, const std::string&)> tell)
      : ends_{io}, output_{io}, configuration_{std::move(configuration)}, tell_{std::move(tell)} {}

  void allow(std::string folder) {
    allowed_ = std::move(folder);
    if (allowed_.empty() && is_running() && !stopping_) {
      ask_to_stop();
    }
  }
  [[nodiscard]] bool is_allowed() const noexcept { return !allowed_.empty(); }

  std::string start() {
    if (is_running()) {
      return stopping_ ? "the last record is still being written" : "a record is being made already";
    }
    folder_ = (std::filesystem::path{allowed_} / next_name()).string();
    const Recorder made = spawn(
        {"trestle", "record", "--quiet", "--progress", "--output=" + folder_, "--config=" + configuration_});
    process_ = made.process;
    stopping_ = has_begun_ = false;
    messages_ = bytes_ = 0;
    line_.clear();
    words_.clear();
    since_ = system_clock::now();
    begun_ = steady_clock::now();
    ends_.assign(made.ends);
    output_.assign(made.output);
    output_.non_blocking(true);
    wait_for_output();
    tell_(true, "begun: " + folder_);
    return {};
  }

  std::string stop() {
    if (!is_running()) {
      return "no record is being made";
    }
    if (stopping_) {
      return "the record is being stopped already";
    }
    ask_to_stop();
    return {};
  }

  void finish() {
    if (!is_running()) {
      return;
    }
    if (!stopping_) {
      ask_to_stop();
    }
    const auto end = steady_clock::now() + patience;
    pollfd wait{.fd = ends_.native_handle(), .events = POLLIN, .revents = 0};
    for (;;) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - steady_clock::now());
      const int ready = ::poll(&wait, 1, static_cast<int>(std::max<std::int64_t>(0, left.count())));
      if (ready > 0) {
        for (int i = 0; i < 32 && read(); ++i) {  // more than a pipe holds
        }
        return on_end();
      }
      if (ready == 0) {
        tell_(false, folder_ + " is still being written");
        return give_up();
      }
    }
  }

  [[nodiscard]] std::string state_json() const {
    nlohmann::json state{{"allowed", is_allowed()},
                         {"recording", is_running()},
                         {"stopping", is_running() && stopping_},
                         {"folder", is_running() ? folder_ : ""},
                         {"since_ns", 0},
                         {"running_s", 0.0},
                         {"messages", messages_},
                         {"bytes", bytes_},
                         {"last", nullptr}};
    if (is_running()) {
      state["since_ns"] = std::chrono::nanoseconds{since_.time_since_epoch()}.count();
      state["running_s"] = std::chrono::duration<double>{steady_clock::now() - begun_}.count();
    }
    if (last_) {
      state["last"] = {{"folder", last_->folder}, {"words", last_->words}, {"ok", last_->ok}};
    }
    return state.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);  // a path may be anything
  }

 private:
  struct Last {
    std::string folder;
    std::string words;
    bool ok = false;
  };

  [[nodiscard]] bool is_running() const noexcept { return process_ > 0; }

  // By the time, as `trestle record` does; two may begin in one second.
  std::string next_name() {
    std::string name = fmt::format("record_{:%Y_%m_%d-%H_%M_%S}", fmt::localtime(std::time(nullptr)));
    same_names_ = name == name_ ? same_names_ + 1 : 1;
    name_ = name;
    return same_names_ == 1 ? name : fmt::format("{}_{}", name, same_names_);
  }

  void ask_to_stop() {
    stopping_ = true;
    ::kill(process_, SIGINT);  // it is there: nobody else waits for it
  }

  void wait_for_output() {
    output_.async_wait(stream_descriptor::wait_read, [self = shared_from_this()](const error_code& error) {
      if (error) {
        return;  // closed
      }
      if (self->read()) {
        self->wait_for_output();
      } else {
        self->wait_for_end();  // it is about to end: nobody else has the other side
      }
    });
  }
  void wait_for_end() {
    ends_.async_wait(stream_descriptor::wait_read, [self = shared_from_this()](const error_code& error) {
      if (!error) {
        self->on_end();
      }
    });
  }

  // Some of its output, without waiting. False: no more comes.
  bool read() {
    std::array<char, 4096> room{};
    const ssize_t size = ::read(output_.native_handle(), room.data(), room.size());
    if (size > 0) {
      take({room.data(), static_cast<std::size_t>(size)});
    }
    return size > 0 || (size < 0 && (errno == EAGAIN || errno == EINTR));
  }
  void take(std::string_view text) {
    for (const char c : text) {
      if (c == '\n') {
        take_line();
        line_.clear();
      } else if (line_.size() < line_max) {
        line_ += c;
      }
    }
  }
  void take_line() {
    if (!line_.starts_with('{')) {
      words_ += (words_.empty() ? "" : "\n") + line_;
      words_.erase(0, words_.size() - std::min(words_.size(), words_max));
      return;
    }
    if (!std::exchange(has_begun_, true)) {
      words_.clear();  // warnings of the configuration, which the bridge has told already
    }
    const auto progress = nlohmann::json::parse(line_, nullptr, false);
    const auto take_number = [&](const char* key, std::uint64_t& into) {
      if (const auto found = progress.find(key); found != progress.end() && found->is_number_unsigned()) {
        into = found->get<std::uint64_t>();
      }
    };
    take_number("messages", messages_);
    take_number("bytes", bytes_);
  }

  void on_end() {
    if (!line_.empty()) {
      take_line();
    }
    int status = 0;
    ::waitpid(std::exchange(process_, -1), &status, 0);
    const bool ok = WIFEXITED(status) && WEXITSTATUS(status) == 0;
    if (WIFSIGNALED(status)) {
      words_ += fmt::format("{}ended by signal {}", words_.empty() ? "" : "\n", WTERMSIG(status));
    } else if (words_.empty()) {
      words_ = fmt::format("ended with exit status {}", WEXITSTATUS(status));
    }
    give_up();
    last_ = Last{folder_, words_, ok};
    tell_(ok, words_);
  }
  void give_up() {
    process_ = -1;
    error_code ignored;
    ends_.close(ignored);
    output_.close(ignored);
  }

  stream_descriptor ends_;
  stream_descriptor output_;
  std::string configuration_;
  std::function<void(bool, const std::string&)> tell_;
  std::string allowed_{};
  std::string name_{};
  int same_names_ = 0;

  pid_t process_ = -1;
  bool stopping_ = false;
  bool has_begun_ = false;
  std::string folder_{};
  system_clock::time_point since_{};
  steady_clock::time_point begun_{};
  std::uint64_t messages_ = 0;
  std::uint64_t bytes_ = 0;
  std::string line_{};   ///< of its output, not whole yet
  std::string words_{};  ///< that it said
  std::optional<Last> last_{};
};

RecordProcess::RecordProcess(boost::asio::io_context& io, std::string configuration,
                             std::function<void(bool, const std::string&)> tell)
    : state_{std::make_shared<State>(io, std::move(configuration), std::move(tell))} {}

RecordProcess::~RecordProcess() {
  finish();
}

void RecordProcess::allow(std::string folder) {
  state_->allow(std::move(folder));
}

bool RecordProcess::is_allowed() const noexcept {
  return state_->is_allowed();
}

std::string RecordProcess::start() {
  return state_->start();
}

std::string RecordProcess::stop() {
  return state_->stop();
}

void RecordProcess::finish() {
  state_->finish();
}

std::string RecordProcess::state_json() const {
  return state_->state_json();
}

std::string RecordProcess::none_json() {
  return R"({"allowed":false,"recording":false})";
}

}  // namespace trestle::console
