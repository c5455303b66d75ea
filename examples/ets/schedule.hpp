#pragma once
#include <optional>

#include "ets/interface.hpp"

namespace ets {

using trestle::TimePoint;

/// The events that are to be sent because of triggers. Several triggers go on beside each other; of more than
/// `places` the one that came first gives way.
class Schedule {
 public:
  static constexpr std::size_t places = 8;

  /// @param parameters  of the request: three uint32, in milliseconds: wait, how long, pause between two.
  ///                    Without them the event is sent once, at once.
  void trigger(const Trigger& what, ByteView parameters, TimePoint now) noexcept;

  /// An event that is due now, or null. To be asked until it is null.
  [[nodiscard]] const Trigger* next(TimePoint now) noexcept;

  /// When the next one is due; nothing: none is.
  [[nodiscard]] std::optional<TimePoint> deadline() const noexcept;

 private:
  struct Place {
    const Trigger* what = nullptr;  // null: free
    TimePoint due{};
    std::chrono::milliseconds left{0};
    std::chrono::milliseconds pause{0};
  };
  std::array<Place, places> places_{};  // those in use first, as they came
};

}  // namespace ets
