#include "bridge/conform/fuzz/process_watch.hpp"

#include <unistd.h>

#include <charconv>
#include <filesystem>
#include <fstream>
#include <string>

namespace trestle::conform {
namespace {

namespace fs = std::filesystem;

/// Of a process, as the kernel tells it; nothing when it cannot be read.
std::optional<pid_t> group_of(const fs::path& process) {
  std::ifstream file{process / "stat"};
  std::string text;
  std::getline(file, text);
  // The name of the program stands in brackets, and may have any letters in it.
  const auto end = text.rfind(')');
  if (end == std::string::npos || end + 4 > text.size()) {
    return std::nullopt;
  }
  const auto parent = text.find(' ', end + 4);
  pid_t group = 0;
  if (parent == std::string::npos ||
      std::from_chars(text.data() + parent + 1, text.data() + text.size(), group).ec != std::errc{}) {
    return std::nullopt;
  }
  return group;
}

}  // namespace

std::optional<ProcessMeans> means_of(pid_t process) {
  const fs::path folder = fs::path{"/proc"} / std::to_string(process);
  std::ifstream file{folder / "statm"};
  std::size_t whole = 0;
  std::size_t resident = 0;
  if (!(file >> whole >> resident)) {
    return std::nullopt;
  }
  ProcessMeans means{.memory = resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE))};
  std::error_code error;
  for (auto one = fs::directory_iterator{folder / "fd", error}; !error && one != fs::directory_iterator{};
       one.increment(error)) {
    ++means.descriptors;
  }
  return means;
}

std::optional<pid_t> largest_of_group(pid_t group) {
  std::optional<pid_t> largest;
  std::size_t memory = 0;
  std::error_code error;
  for (auto one = fs::directory_iterator{"/proc", error}; !error && one != fs::directory_iterator{};
       one.increment(error)) {
    const std::string name = one->path().filename().string();
    pid_t process = 0;
    if (std::from_chars(name.data(), name.data() + name.size(), process).ec == std::errc{} &&
        group_of(one->path()) == group) {
      if (const auto means = means_of(process); means && means->memory >= memory) {
        largest = process;
        memory = means->memory;
      }
    }
  }
  return largest;
}

}  // namespace trestle::conform
