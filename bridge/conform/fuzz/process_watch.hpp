#pragma once
#include <sys/types.h>

#include <cstddef>
#include <optional>

namespace trestle::conform {

/// What a process has of the system's means.
struct ProcessMeans {
  std::size_t memory = 0;  ///< resident, in bytes
  std::size_t descriptors = 0;
};

/// @return nothing: there is no such process, or we may not look.
[[nodiscard]] std::optional<ProcessMeans> means_of(pid_t process);

/// The process of a process group that has the most memory: where a shell starts the device, the device.
/// @return nothing: there is none.
[[nodiscard]] std::optional<pid_t> largest_of_group(pid_t group);

}  // namespace trestle::conform
