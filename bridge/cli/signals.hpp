#pragma once
#include <initializer_list>
#include <optional>

namespace trestle::cli {

/// Signals as something to read: they wait until somebody does, and no handler interrupts anything.
///
/// They are blocked in this thread and in all that it starts from then on, so this is to be made first. They
/// stay blocked, as one that comes while the program ends must not kill it.
class Signals {
 public:
  /// @throws std::system_error when the system has no file descriptors left.
  explicit Signals(std::initializer_list<int> numbers);
  ~Signals();
  Signals(const Signals&) = delete;
  Signals& operator=(const Signals&) = delete;

  /// Readable while one waits.
  [[nodiscard]] int fd() const noexcept { return fd_; }
  /// The number of one that has come; nothing when none has.
  [[nodiscard]] std::optional<int> next();

 private:
  int fd_ = -1;
};

}  // namespace trestle::cli
