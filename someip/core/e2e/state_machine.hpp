#pragma once
#include <bitset>
#include <cstdint>
#include <limits>

#include "someip/core/e2e/config.hpp"
#include "someip/wire/types.hpp"

namespace trestle::someip::e2e {

/// What one check says of one message.
enum class CheckStatus : std::uint8_t {
  ok,              ///< good, and the one after the last
  ok_some_lost,    ///< good, but up to max_delta_counter - 1 messages before it are missing
  repeated,        ///< good, but has the counter of the last
  wrong_sequence,  ///< good, but too far from the last
  error,           ///< not to be used: CRC, length, Data ID or another field is wrong
  no_new_data,     ///< nothing arrived since the last check
};
/// The status's name as it stands above, for logs and counters.
[[nodiscard]] const char* to_string(CheckStatus status) noexcept;

/// What the last checks together say of the communication.
enum class State : std::uint8_t {
  no_data,  ///< nothing usable has arrived yet
  init,     ///< something has; not enough to tell
  valid,    ///< the data may be used
  invalid,  ///< too many errors or too little data: do not use it
};
/// The state's name as it stands above, for logs.
[[nodiscard]] const char* to_string(State state) noexcept;

/// AUTOSAR's parameters of the E2E state machine. AUTOSAR has no defaults; these suit a cyclic event: valid
/// from the third good message on, invalid after three checks without a good one.
///
/// Windows are counted in checks, 1 to 255. There must hold, each broken rule being an error:
/// min_ok + max_error <= window_size for each state, the windows of init and invalid at most that of valid,
/// 1 <= min_ok_valid <= min_ok_init <= min_ok_invalid and max_error_valid >= max_error_init >=
/// max_error_invalid.
struct StateMachineConfig {
  std::uint8_t window_size_init = 3;
  std::uint8_t window_size_valid = 3;
  std::uint8_t window_size_invalid = 3;
  std::uint8_t min_ok_init = 2;  ///< so many good checks of the window lead from init to valid
  std::uint8_t min_ok_valid = 1;
  std::uint8_t min_ok_invalid = 2;
  std::uint8_t max_error_init = 1;  ///< more bad checks of the window lead from init to invalid
  std::uint8_t max_error_valid = 2;
  std::uint8_t max_error_invalid = 1;
  bool clear_to_invalid = false;  ///< forget the window on the way to invalid
  /// Since R20-11: go to invalid also when a full window brought nothing usable, or too little of it.
  bool transit_to_invalid_extended = false;
  friend constexpr bool operator==(const StateMachineConfig&, const StateMachineConfig&) = default;
};

/// AUTOSAR's E2E state machine (E2E_SMCheck): judges the channel from the window of the last checks.
class StateMachine {
 public:
  [[nodiscard]] static tl::expected<StateMachine, ConfigError> create(
      const StateMachineConfig& config) noexcept;

  /// Takes the status of one check and tells the state after it. A lost or late message counts as good or bad
  /// only if its status is ok, ok_some_lost or error; the others merely fill the window.
  State on_check(CheckStatus status) noexcept;

  [[nodiscard]] State state() const noexcept { return state_; }
  void reset() noexcept;

 private:
  static constexpr std::size_t max_window = std::numeric_limits<std::uint8_t>::max();
  using Window = std::bitset<max_window>;  ///< bit 0 is the latest check

  explicit StateMachine(const StateMachineConfig& config) noexcept : config_{config} {}

  void add(CheckStatus status) noexcept;
  void forget_all_but(std::size_t checks) noexcept;
  [[nodiscard]] std::size_t good(std::size_t window) const noexcept;
  [[nodiscard]] std::size_t bad(std::size_t window) const noexcept;
  [[nodiscard]] bool cannot_become_valid() const noexcept;
  void enter_valid(std::size_t window) noexcept;
  void enter_invalid() noexcept;

  StateMachineConfig config_;
  State state_ = State::no_data;
  Window good_;
  Window bad_;
  std::size_t checks_ = 0;  ///< in the windows; stops at max_window
};

}  // namespace trestle::someip::e2e
