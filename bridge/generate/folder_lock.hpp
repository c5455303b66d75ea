#pragma once
#include <chrono>
#include <filesystem>
#include <vector>

namespace trestle::generate {

/// Keeps other runs of `trestle generate` from a folder that is read and then written, until it or the
/// program ends. It is the folder itself that is locked (flock), so that nothing has to lie there.
class FolderLock {
 public:
  /// Makes a folder that is not there yet. Waits while another run has the folder, which a line on standard
  /// error tells. Where the file system has no locks, there is none, which a warning tells.
  /// @throws std::runtime_error when it cannot be made, or when the other run takes longer than `patience`.
  explicit FolderLock(std::filesystem::path folder,
                      std::chrono::milliseconds patience = std::chrono::seconds{10});
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;
  /// Removes the folders that it has made, as far as nothing was put there.
  ~FolderLock();

 private:
  void make();
  void remove_empty();
  /// @return false: another run has it, or has removed it
  [[nodiscard]] bool take();

  std::filesystem::path folder_;
  std::vector<std::filesystem::path> made_{};  ///< inner ones first
  int descriptor_ = -1;
};

}  // namespace trestle::generate
