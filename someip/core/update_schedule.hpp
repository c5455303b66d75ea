#pragma once
#include <optional>

#include "someip/wire/types.hpp"

namespace trestle::someip {

/// When the value of a field, or of an event, is sent to its subscribers.  [feat_req_someip_635]
struct UpdateRule {
  /// As soon as it differs from the one that was sent last; what counts as a difference is the caller's to
  /// say: any other byte, or a distance greater than some epsilon.
  bool on_change = true;
  /// And every so often, whether it has changed or not, from the first value on; 0: no.
  Duration cycle{0};
  friend constexpr bool operator==(const UpdateRule&, const UpdateRule&) = default;
};

/// The rule at work for one value, sans I/O.
class UpdateSchedule {
 public:
  explicit constexpr UpdateSchedule(const UpdateRule& rule) noexcept : rule_{rule} {}

  /// There is a value.
  /// @param differs  from the value that was sent last; true for the first.
  /// @return whether to send it now.
  bool on_value(bool differs, TimePoint now) noexcept;

  /// @return whether to send the current value again. Early and repeated calls change nothing.
  bool on_time(TimePoint now) noexcept;

  /// When on_time() has something to do.
  [[nodiscard]] constexpr std::optional<TimePoint> deadline() const noexcept { return due_; }

 private:
  UpdateRule rule_;
  std::optional<TimePoint> due_;  ///< the next of the cycle
};

}  // namespace trestle::someip
