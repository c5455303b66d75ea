#include "bridge/record/growing_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

namespace trestle::record {

GrowingFile::GrowingFile(std::string path)
    : path_{std::move(path)}, fd_{::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644)} {
  if (fd_ < 0) {
    throw std::system_error{errno, std::generic_category(), "cannot make " + path_};
  }
}

GrowingFile::~GrowingFile() {
  ::close(fd_);
}

std::error_code GrowingFile::append(ByteView piece) {
  const std::size_t whole = piece.size();
  while (!piece.empty()) {
    const ssize_t written = ::write(fd_, piece.data(), piece.size());
    if (written < 0 && errno == EINTR) {
      continue;
    }
    if (written <= 0) {
      const std::error_code error{written < 0 ? errno : ENOSPC, std::generic_category()};
      // If even this fails, readers stop at the half piece.
      if (::ftruncate(fd_, static_cast<off_t>(size_)) == 0) {
        ::lseek(fd_, static_cast<off_t>(size_), SEEK_SET);
      }
      return error;
    }
    piece = piece.subspan(static_cast<std::size_t>(written));
  }
  size_ += whole;
  return {};
}

}  // namespace trestle::record
