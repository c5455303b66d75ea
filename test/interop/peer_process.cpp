#include "test/interop/peer_process.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <stdexcept>
#include <thread>

namespace trestle::interop {

PeerProcess::PeerProcess(const std::vector<std::string>& command, const std::vector<std::string>& environment,
                         const std::string& errors) {
  std::array<int, 2> in{};
  std::array<int, 2> out{};
  if (pipe2(in.data(), O_CLOEXEC) != 0 || pipe2(out.data(), O_CLOEXEC) != 0) {
    throw std::runtime_error{"cannot make a pipe"};
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, in[0], 0);
  posix_spawn_file_actions_adddup2(&actions, out[1], 1);
  posix_spawn_file_actions_addopen(&actions, 2, errors.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  // A group of its own, so that kill() meets its children too.
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF);
  // To write to a peer that has ended is an error, not our end.
  std::signal(SIGPIPE, SIG_IGN);
  sigset_t of_peer;
  sigemptyset(&of_peer);
  sigaddset(&of_peer, SIGPIPE);
  posix_spawnattr_setsigdefault(&attributes, &of_peer);

  std::vector<std::string> settings = environment;
  for (char** one = environ; *one != nullptr; ++one) {
    settings.emplace_back(*one);
  }
  const auto pointers = [](const std::vector<std::string>& strings) {
    std::vector<char*> result;
    result.reserve(strings.size() + 1);
    for (const std::string& one : strings) {
      result.push_back(const_cast<char*>(one.c_str()));
    }
    result.push_back(nullptr);
    return result;
  };
  const int error = posix_spawnp(&pid_, command.front().c_str(), &actions, &attributes,
                                 pointers(command).data(), pointers(settings).data());
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  close(in[0]);
  close(out[1]);
  in_ = in[1];
  out_ = out[0];
  fcntl(out_, F_SETFL, O_NONBLOCK);
  if (error != 0) {
    pid_ = -1;
    throw std::runtime_error{"cannot start " + command.front()};
  }
}

PeerProcess::~PeerProcess() {
  close(in_);
  if (pid_ > 0) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds{30};
    while (waitpid(pid_, nullptr, WNOHANG) == 0) {
      if (std::chrono::steady_clock::now() > end) {
        kill();
        break;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds{10});
    }
  }
  close(out_);
}

void PeerProcess::tell(const std::string& line) {
  const std::string text = line + "\n";
  if (write(in_, text.data(), text.size()) != static_cast<ssize_t>(text.size())) {
    throw std::runtime_error{"the peer does not listen"};
  }
}

void PeerProcess::read() {
  std::array<char, 4096> room{};
  for (ssize_t got = 0; (got = ::read(out_, room.data(), room.size())) > 0;) {
    part_.append(room.data(), static_cast<std::size_t>(got));
  }
  for (std::size_t end = 0; (end = part_.find('\n')) != std::string::npos;) {
    lines_.push_back(part_.substr(0, end));
    part_.erase(0, end + 1);
  }
}

std::size_t PeerProcess::count(const std::string& beginning) const {
  return static_cast<std::size_t>(std::ranges::count_if(
      lines_, [&](const std::string& line) { return line.compare(0, beginning.size(), beginning) == 0; }));
}

bool PeerProcess::ended() {
  if (pid_ > 0 && waitpid(pid_, nullptr, WNOHANG) == pid_) {
    pid_ = -1;
    ended_ = true;
  }
  return ended_;
}

void PeerProcess::kill() {
  if (pid_ > 0) {
    ::kill(-pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    pid_ = -1;
  }
}

}  // namespace trestle::interop
