#include "bridge/measure/demo/child.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <system_error>

namespace trestle::measure::demo {
namespace {

constexpr std::size_t output_lines_kept = 20;
constexpr std::size_t line_bytes_max = 65536;

struct PipeEnds {
  int read = -1;
  int write = -1;
};

PipeEnds make_pipe() {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw std::system_error{errno, std::generic_category(), "pipe"};
  }
  fcntl(ends[0], F_SETFL, O_NONBLOCK);
  return {ends[0], ends[1]};
}

// Between fork and exec: system calls only.
[[noreturn]] void become(const char* program, char* const* arguments, int report, int output, pid_t parent) {
  // Its own process group, so that Ctrl-C reaches only the demo, which ends its processes in order.
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) {
    _exit(127);  // the parent ended before prctl() took effect
  }
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  const int null = open("/dev/null", O_RDONLY | O_CLOEXEC);
  dup2(null, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(output, STDERR_FILENO);
  // `report` may already be descriptor 3; dup2() onto itself would leave it to be closed by exec.
  if (report == Child::report_fd) {
    fcntl(report, F_SETFD, 0);
  } else {
    dup2(report, Child::report_fd);
  }
  execv(program, arguments);
  const char* why = std::strerror(errno);
  (void)!write(STDERR_FILENO, why, std::strlen(why));
  _exit(127);
}

}  // namespace

Child::Child(std::string name, const std::string& program, const std::vector<std::string>& arguments)
    : name_{std::move(name)} {
  const PipeEnds report = make_pipe();
  const PipeEnds output = make_pipe();
  std::vector<std::string> words{"trestle"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  std::ranges::transform(words, std::back_inserter(argv), [](std::string& word) { return word.data(); });
  argv.push_back(nullptr);

  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ == 0) {
    become(program.c_str(), argv.data(), report.write, output.write, parent);
  }
  const int failure = errno;
  close(report.write);
  close(output.write);
  report_.fd = report.read;
  output_.fd = output.read;
  if (pid_ < 0) {
    close_pipe(report_);
    close_pipe(output_);
    throw std::system_error{failure, std::generic_category(), "fork"};
  }
}

Child::~Child() {
  if (!ended()) {
    kill();
    int status = 0;
    while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
  }
  close_pipe(report_);
  close_pipe(output_);
}

void Child::close_pipe(Pipe& pipe) {
  if (pipe.fd >= 0) {
    close(pipe.fd);
    pipe.fd = -1;
  }
}

void Child::read_lines(Pipe& pipe, const std::function<void(std::string_view)>& on_line) {
  std::array<char, 65536> buffer{};
  while (pipe.fd >= 0) {
    const ssize_t count = read(pipe.fd, buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) {
      continue;
    }
    if (count < 0) {
      return;  // nothing more for now
    }
    if (count == 0) {
      close_pipe(pipe);
      if (!pipe.partial.empty()) {
        on_line(pipe.partial);
      }
      return;
    }
    std::string_view bytes{buffer.data(), static_cast<std::size_t>(count)};
    for (std::size_t end = 0; (end = bytes.find('\n')) != std::string_view::npos;
         bytes.remove_prefix(end + 1)) {
      pipe.partial += bytes.substr(0, end);
      on_line(pipe.partial);
      pipe.partial.clear();
    }
    pipe.partial += bytes;
    if (pipe.partial.size() > line_bytes_max) {
      pipe.partial.clear();
    }
  }
}

void Child::read_reports(const std::function<void(std::string_view)>& on_line) {
  read_lines(report_, on_line);
}

void Child::read_output(const std::function<void(std::string_view)>& on_line) {
  read_lines(output_, [&](std::string_view line) {
    last_output_.emplace_back(line);
    if (last_output_.size() > output_lines_kept) {
      last_output_.pop_front();
    }
    if (on_line) {
      on_line(line);
    }
  });
}

void Child::stop() {
  if (!asked_to_stop_ && !ended()) {
    asked_to_stop_ = true;
    ::kill(pid_, SIGINT);
  }
}

void Child::kill() {
  if (!ended()) {
    asked_to_stop_ = true;
    ::kill(pid_, SIGKILL);
  }
}

bool Child::ended() {
  int status = 0;
  if (!wait_status_ && pid_ > 0 && waitpid(pid_, &status, WNOHANG) == pid_) {
    wait_status_ = status;
  }
  return wait_status_.has_value();
}

std::string Child::fault() const {
  if (!wait_status_) {
    return {};
  }
  if (WIFSIGNALED(*wait_status_)) {
    if (asked_to_stop_ && WTERMSIG(*wait_status_) == SIGINT) {
      return {};  // it could not handle the signal yet
    }
    return fmt::format("{} was ended by signal {} ({})", name_, WTERMSIG(*wait_status_),
                       strsignal(WTERMSIG(*wait_status_)));
  }
  const int status = WEXITSTATUS(*wait_status_);
  if (status != 0) {
    return fmt::format("{} ended with exit status {}", name_, status);
  }
  return asked_to_stop_ ? "" : name_ + " ended by itself";
}

std::string Child::last_output() const {
  std::string text;
  for (const std::string& line : last_output_) {
    text += "  " + line + "\n";
  }
  return text;
}

}  // namespace trestle::measure::demo
