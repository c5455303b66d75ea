#pragma once
#include <string>

namespace trestle::carry {

/// Gives up the rights of root for those of a user, as soon as what needs root is done.
class DropRoot {
 public:
  /// Looks the user up, and keeps this process, with all threads that begin later, from ever getting more
  /// rights than it has. Call it before there are threads.
  /// @throws std::runtime_error when there is no such user, it is root itself, or we are not root.
  explicit DropRoot(const std::string& user);

  /// Makes the user the owner of a file, if that can be.
  void give(const std::string& path) const;

  /// Becomes the user, with all threads. Not to be undone.
  /// @throws std::runtime_error
  void now() const;

 private:
  std::string user_;
  unsigned uid_ = 0;
  unsigned gid_ = 0;
};

}  // namespace trestle::carry
