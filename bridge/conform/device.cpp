#include "bridge/conform/device.hpp"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <thread>
#include <utility>

extern char** environ;  // NOLINT(readability-redundant-declaration): POSIX leaves it to us

namespace trestle::conform {
namespace {

using namespace std::chrono_literals;

/// A shell with the command, in a process group of its own.
pid_t spawn(const std::string& command, const std::string& log) {
  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&files);
  posix_spawnattr_init(&attributes);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0666);
  posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
  // Signals that this program blocks to read them later, the device gets.
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK);
  std::array<std::string, 3> words{"/bin/sh", "-c", command};
  std::array<char*, 4> arguments{words[0].data(), words[1].data(), words[2].data(), nullptr};
  pid_t process = 0;
  const int error = ::posix_spawn(&process, "/bin/sh", &files, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  if (error != 0) {
    throw std::runtime_error{"cannot start '" + command + "': " + std::strerror(error)};
  }
  return process;
}

}  // namespace

Device::Device(const Profile& profile, std::string programs, std::string log, std::string fault)
    : profile_{profile}, programs_{std::move(programs)}, log_{std::move(log)}, fault_{std::move(fault)} {}

Device::~Device() {
  try {
    stop();
  } catch (const std::exception&) {
    end_process(true);
  }
}

void Device::ask(const char* what) const {
  std::fprintf(stderr, "%s the device '%s', then press Enter. ", what, profile_.name.c_str());
  // Not through stdio, which remembers the end of a terminal's input for good.
  char c = 0;
  while (c != '\n') {
    const ssize_t count = ::read(STDIN_FILENO, &c, 1);
    if (count < 0 && errno == EINTR) {
      continue;
    }
    if (count <= 0) {
      const std::string why = count == 0 ? "standard input is at its end" : std::strerror(errno);
      std::fprintf(stderr, "\n");
      throw std::runtime_error{std::string{"nobody said that this is done: '"} + what + " the device'; " +
                               why + " (lifecycle: ask_operator)"};
    }
  }
}

void Device::start() {
  const std::string& command = fault_.empty() ? profile_.lifecycle.start : profile_.faults.start;
  if (!command.empty()) {
    // Where the shell ends before the device does, the device becomes our child, so that its end is seen.
    ::prctl(PR_SET_CHILD_SUBREAPER, 1);
    status_ = 0;
    process_ = spawn(filled_in(command, profile_, programs_, fault_), log_);
  } else if (profile_.lifecycle.ask_operator) {
    ask("Start");
    is_on_ = true;
  }
}

bool Device::collect() {
  while (true) {
    int status = 0;
    const pid_t one = ::waitpid(-process_, &status, WNOHANG);
    if (one == 0) {
      return true;
    }
    if (one < 0) {
      return false;
    }
    if (one == process_) {
      status_ = status;
    }
  }
}

std::optional<std::string> Device::ended() {
  if (process_ == 0 || collect() || !profile_.lifecycle.restart.empty() ||
      (!profile_.lifecycle.stop.empty() && status_ == 0)) {
    return std::nullopt;
  }
  // A shell tells of a signal by 128 and its number.
  const int code = WIFEXITED(status_) ? WEXITSTATUS(status_) : 0;
  const int signal = WIFSIGNALED(status_) ? WTERMSIG(status_) : code > 128 ? code - 128 : 0;
  // And by 127 that there is no such command, which is most often a mistake in the profile.
  return signal != 0   ? "was killed by signal " + std::to_string(signal)
         : code == 127 ? "exited with status 127 (no such command)"
                       : "exited with status " + std::to_string(code);
}

void Device::end_process(bool at_once) {
  if (process_ == 0 || !collect()) {
    process_ = 0;
    return;
  }
  ::kill(-process_, at_once ? SIGKILL : SIGTERM);
  for (int tries = 0;; ++tries) {
    if (!collect()) {
      break;
    }
    if (tries == 400) {
      ::kill(-process_, SIGKILL);
    }
    std::this_thread::sleep_for(5ms);
  }
  process_ = 0;
}

void Device::stop(bool at_once) {
  if (!profile_.lifecycle.stop.empty() && !at_once && process_ != 0) {
    run(profile_.lifecycle.stop);
  } else if (is_on_) {
    is_on_ = false;  // nobody is asked twice
    ask("Stop");
  }
  end_process(at_once);
}

void Device::restart(bool at_once) {
  if (!profile_.lifecycle.restart.empty()) {
    run(profile_.lifecycle.restart);
  } else if (profile_.lifecycle.ask_operator) {
    ask("Restart");
  } else {
    stop(at_once);
    start();
  }
}

void Device::run(const std::string& command) const {
  const pid_t process = spawn(filled_in(command, profile_, programs_, fault_), log_);
  int status = 0;
  ::waitpid(process, &status, 0);
  if (status != 0) {
    throw std::runtime_error{"'" + command + "' failed; see " + log_};
  }
}

}  // namespace trestle::conform
