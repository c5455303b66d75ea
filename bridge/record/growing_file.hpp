#pragma once
#include <cstdint>
#include <string>
#include <system_error>

#include "someip/wire/types.hpp"

namespace trestle::record {

/// A new file that grows by whole pieces: what could be written only in part is taken back. So a full disk
/// leaves no half of a piece, and there is nothing that a program that is killed keeps back.
class GrowingFile {
 public:
  /// Makes the file, which must not be there yet.
  /// @throws std::system_error
  explicit GrowingFile(std::string path);
  GrowingFile(const GrowingFile&) = delete;
  GrowingFile& operator=(const GrowingFile&) = delete;
  ~GrowingFile();

  /// @return why nothing was written.
  std::error_code append(ByteView piece);
  [[nodiscard]] std::uint64_t size() const noexcept { return size_; }
  [[nodiscard]] const std::string& path() const noexcept { return path_; }

 private:
  std::string path_;
  int fd_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace trestle::record
