#include "bridge/documents/replace_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

namespace trestle::documents {
namespace {

namespace fs = std::filesystem;

/// Closes the file in any case.
class OpenFile {
 public:
  OpenFile(fs::path path, int flags)
      : path_{std::move(path)}, number_{::open(path_.c_str(), flags | O_CLOEXEC, 0666)} {}
  ~OpenFile() {
    if (number_ >= 0) {
      ::close(number_);
    }
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  [[nodiscard]] bool is_open() const noexcept { return number_ >= 0; }
  [[nodiscard]] bool write(std::string_view text) const {
    while (!text.empty()) {
      const ssize_t written = ::write(number_, text.data(), text.size());
      if (written < 0 && errno != EINTR) {
        return false;
      }
      text.remove_prefix(written < 0 ? 0 : static_cast<std::size_t>(written));
    }
    return true;
  }
  /// Empties the file, unless another process is writing it at this time, or has just renamed it.
  [[nodiscard]] bool take() const {
    if (::flock(number_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
      return false;  // any other error is that of a file system without locks
    }
    struct stat mine {};
    struct stat named {};
    if (::fstat(number_, &mine) != 0 || ::lstat(path_.c_str(), &named) != 0 || mine.st_ino != named.st_ino) {
      errno = EWOULDBLOCK;
      return false;
    }
    return ::ftruncate(number_, 0) == 0;
  }
  void set_rights(mode_t mode) const {
    // Of a file system that has none, or of a file that others own: it is written all the same.
    [[maybe_unused]] const bool is_set = ::fchmod(number_, mode & 07777U) == 0;
  }
  [[nodiscard]] bool sync() const { return ::fsync(number_) == 0; }
  /// What close() would tell, without giving the file free for others.
  [[nodiscard]] bool flush() const {
    const int copy = ::fcntl(number_, F_DUPFD_CLOEXEC, 0);
    return copy >= 0 && ::close(copy) == 0;
  }

 private:
  fs::path path_;
  int number_;
};

/// A name that nobody else takes, and that is not too long where the file's own is not.
fs::path beside(const fs::path& file) {
  constexpr std::size_t longest = 250;
  const std::string name = file.filename().string();
  return file.parent_path() / (name.size() > longest ? ".trestle.new" : "." + name + ".new");
}

}  // namespace

tl::expected<void, std::string> replace_file(const fs::path& file, std::string_view text, Outlives what) {
  std::error_code none;
  const fs::path linked = fs::canonical(file, none);
  const fs::path target = none ? file : linked;
  const fs::path fresh = beside(target);
  const auto fault = [&](const fs::path& of) {
    return tl::unexpected{fmt::format("{} cannot be written: {}: {}", file.string(), of.string(),
                                      std::generic_category().message(errno))};
  };
  const auto fail = [&](const fs::path& of) {
    const auto result = fault(of);
    ::unlink(fresh.c_str());
    return result;
  };
  struct stat before {};
  const bool is_there = ::stat(target.c_str(), &before) == 0;
  if (is_there && !S_ISREG(before.st_mode)) {
    return tl::unexpected{fmt::format("{} cannot be written: it is no file", file.string())};
  }
  const OpenFile out{fresh, O_WRONLY | O_CREAT | O_NOFOLLOW};
  if (!out.is_open() || !out.take()) {
    return fault(fresh);
  }
  if (is_there) {
    out.set_rights(before.st_mode);
  }
  if (!out.write(text) || (what == Outlives::a_power_failure && !out.sync()) || !out.flush()) {
    return fail(fresh);
  }
  if (::rename(fresh.c_str(), target.c_str()) != 0) {
    return fail(target);
  }
  if (what == Outlives::a_power_failure) {
    // So that the new name survives as well. Not every file system can do this; then the file is written all
    // the same.
    const fs::path folder = target.parent_path();
    const OpenFile place{folder.empty() ? "." : folder, O_RDONLY | O_DIRECTORY};
    [[maybe_unused]] const bool is_safe = place.is_open() && place.sync();
  }
  return {};
}

}  // namespace trestle::documents
