#pragma once
#include <sys/types.h>

#include <optional>
#include <string>

#include "bridge/conform/profile.hpp"

namespace trestle::conform {

/// Starts and stops the device as its profile says.
class Device {
 public:
  /// @param programs  the folder of the running program.
  /// @param log       the file that gets what the device prints.
  /// @param fault     start it with this fault; empty: as it is.
  Device(const Profile& profile, std::string programs, std::string log, std::string fault = {});
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  /// Nothing happens where the profile has no command for it.
  /// @throws std::runtime_error when a command cannot be run or fails, or nobody is there to be asked:
  ///         standard input is at its end.
  void start();
  /// In order (SIGTERM), or at once.
  void stop(bool at_once = false);
  void restart(bool at_once = false);
  /// How the device that start() began has ended by itself, "exited with status 1"; nothing: it runs,
  /// somebody else runs it, or stop() ended it. Where commands of the profile stop or restart it, what
  /// start() began may end as it pleases, unless with an error.
  [[nodiscard]] std::optional<std::string> ended();
  /// The process group of what start() began; 0: there is none.
  [[nodiscard]] pid_t group() const noexcept { return process_; }

 private:
  void run(const std::string& command) const;
  void end_process(bool at_once);
  void ask(const char* what) const;
  /// Collects what has ended of the process group. False: nothing of it is left.
  bool collect();

  const Profile& profile_;
  std::string programs_;
  std::string log_;
  std::string fault_;
  pid_t process_ = 0;
  int status_ = 0;      ///< of the shell that start() began, once it has ended
  bool is_on_ = false;  ///< a person was asked to start it, and not yet to stop it
};

}  // namespace trestle::conform
