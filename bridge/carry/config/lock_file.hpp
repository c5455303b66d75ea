#pragma once
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/carry/config/load.hpp"

namespace trestle::carry {

/// The file that keeps the ids of discovered topics: YAML for people and version control, sorted by topic.
/// What stands in it wins over what would be chosen today, so ids stay as they are over the years.
///
///     version: 1
///     topics:
///       - {service: 0x6a31, topic: /sensing/imu, type: sensor_msgs/msg/Imu}
///       - {service: 0x6ab8, topic: /map, type: nav_msgs/msg/OccupancyGrid, durability: transient_local}
class LockFile {
 public:
  /// A missing file has no topics. Reports all errors: bad YAML, unknown keys, bad names and ids, a topic or
  /// an id that appears twice.
  [[nodiscard]] static tl::expected<LockFile, std::vector<documents::Problem>> read(const std::string& file);

  [[nodiscard]] const std::string& file() const noexcept { return file_; }
  /// Sorted by topic.
  [[nodiscard]] const std::vector<LockedTopic>& topics() const noexcept { return topics_; }
  /// Nothing: it has no id yet. Valid until add().
  [[nodiscard]] const LockedTopic* find(std::string_view topic) const;
  [[nodiscard]] bool has(someip::ServiceId service) const;

  /// Writes the file anew with further topics, which it does not have yet: beside it, to the disk, then in
  /// its place. After a power failure there is the old file or the new one, and no half of one.
  /// @return why not; then nothing has changed. Also when somebody else has written the file since it was
  ///         read.
  [[nodiscard]] tl::expected<void, std::string> add(const std::vector<LockedTopic>& more);

 private:
  LockFile() = default;

  std::string file_;
  std::string text_;  ///< of the file as we know it; empty when there is none
  std::vector<LockedTopic> topics_;
};

/// The text of a lock file; the topics in the order in which they shall stand.
[[nodiscard]] std::string lock_text(const std::vector<LockedTopic>& topics);

}  // namespace trestle::carry
