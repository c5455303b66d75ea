#pragma once
#include "someip/wire/types.hpp"

namespace trestle::someip {

/// The value of a Session ID where session handling is off.  [feat_req_someip_700]
inline constexpr SessionId no_session{0};

/// The Session IDs of one client, event or SD relation: 1, 2, ... 0xffff, 1, ...  [feat_req_someip_88]
class SessionCounter {
 public:
  /// @param first  the first id; tests may want another than the specification's 1.  [feat_req_someip_649]
  explicit constexpr SessionCounter(SessionId first = SessionId{1}) noexcept : next_{first} {}

  [[nodiscard]] constexpr SessionId next() noexcept {
    const SessionId session = next_;
    wrapped_ = wrapped_ || wraps_next_;
    wraps_next_ = session == SessionId{0xffff};
    // 0 is skipped: it would say that session handling is off.  [feat_req_someip_677]
    next_ = wraps_next_ ? SessionId{1} : SessionId{static_cast<std::uint16_t>(value(session) + 1U)};
    return session;
  }

  /// Whether the last id that next() gave, or one before it, came after 0xffff. The Reboot flag of SD is 1 as
  /// long as this is false.  [feat_req_someipsd_41]
  [[nodiscard]] constexpr bool wrapped() const noexcept { return wrapped_; }

  /// Whether this one goes on from a later id than `other`, or has come after 0xffff and the other has not.
  [[nodiscard]] constexpr bool is_ahead_of(const SessionCounter& other) const noexcept {
    return place() > other.place();
  }

 private:
  [[nodiscard]] constexpr std::uint32_t place() const noexcept {
    return (wrapped_ || wraps_next_ ? 0x10000U : 0U) + value(next_);
  }

  SessionId next_;
  bool wraps_next_ = false;
  bool wrapped_ = false;
};

}  // namespace trestle::someip
