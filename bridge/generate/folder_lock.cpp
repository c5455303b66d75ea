#include "bridge/generate/folder_lock.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include "bridge/cli/terminal.hpp"

namespace trestle::generate {

FolderLock::FolderLock(std::filesystem::path folder, std::chrono::milliseconds patience)
    : folder_{std::move(folder)} {
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::milliseconds pause{20};
  const auto end = Clock::now() + patience;
  for (bool told = false; !take(); told = true) {
    if (Clock::now() >= end) {
      remove_empty();
      throw std::runtime_error{fmt::format(
          "{} has been used by another `trestle generate` for {} s: let that one end, and run this "
          "one again",
          folder_.string(), std::chrono::duration<double>{patience}.count())};
    }
    if (!told) {
      fmt::print(stderr, "waiting for another `trestle generate`, which uses {}\n", folder_.string());
    }
    std::this_thread::sleep_for(pause);
  }
}

FolderLock::~FolderLock() {
  remove_empty();  // before others may use it
  if (descriptor_ >= 0) {
    ::close(descriptor_);
  }
}

void FolderLock::make() {
  std::vector<std::filesystem::path> missing;
  std::error_code error;
  for (std::filesystem::path at = folder_; !at.empty() && !std::filesystem::exists(at, error);
       at = at.parent_path()) {
    missing.push_back(at);
  }
  if (missing.empty()) {
    if (!std::filesystem::is_directory(folder_, error)) {
      throw std::runtime_error{folder_.string() + " is no folder"};
    }
    return;
  }
  made_ = std::move(missing);
  if (std::filesystem::create_directories(folder_, error); error) {
    remove_empty();
    throw std::runtime_error{fmt::format("{} cannot be made: {}", folder_.string(), error.message())};
  }
}

void FolderLock::remove_empty() {
  for (const std::filesystem::path& one : std::exchange(made_, {})) {
    std::error_code not_empty;
    std::filesystem::remove(one, not_empty);
  }
}

bool FolderLock::take() {
  make();
  descriptor_ = ::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const auto give_up = [this] {
    ::close(std::exchange(descriptor_, -1));
    return false;
  };
  const bool was_removed = descriptor_ < 0 && errno == ENOENT;
  if (was_removed) {
    return false;
  }
  if (descriptor_ < 0 || ::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
    if (errno == EWOULDBLOCK) {
      return give_up();
    }
    const cli::Colours colour = cli::colours_for(STDERR_FILENO);
    fmt::print(stderr, "{}warning:{} {} cannot be locked ({}): let no other `trestle generate` use it now\n",
               colour.yellow, colour.off, folder_.string(), std::generic_category().message(errno));
    return true;
  }
  struct stat mine {};
  struct stat named {};
  const bool is_still_there = ::fstat(descriptor_, &mine) == 0 && ::stat(folder_.c_str(), &named) == 0 &&
                              mine.st_ino == named.st_ino && mine.st_dev == named.st_dev;
  return is_still_there || give_up();
}

}  // namespace trestle::generate
