#include "bridge/cli/signals.hpp"

#include <sys/signalfd.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <system_error>

namespace trestle::cli {

Signals::Signals(std::initializer_list<int> numbers) {
  sigset_t wanted;
  sigemptyset(&wanted);
  for (const int number : numbers) {
    sigaddset(&wanted, number);
  }
  pthread_sigmask(SIG_BLOCK, &wanted, nullptr);
  fd_ = signalfd(-1, &wanted, SFD_CLOEXEC | SFD_NONBLOCK);
  if (fd_ < 0) {
    throw std::system_error{errno, std::generic_category(), "signalfd"};
  }
}

Signals::~Signals() {
  close(fd_);
}

std::optional<int> Signals::next() {
  signalfd_siginfo info{};
  const ssize_t size = read(fd_, &info, sizeof info);
  return size == static_cast<ssize_t>(sizeof info) ? std::optional{static_cast<int>(info.ssi_signo)}
                                                   : std::nullopt;
}

}  // namespace trestle::cli
