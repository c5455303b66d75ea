#include "someip/core/e2e/state_machine.hpp"

#include <algorithm>

#include "someip/core/e2e/requirements.hpp"
#include "someip/wire/enumerator_name.hpp"

namespace trestle::someip::e2e {

const char* to_string(CheckStatus status) noexcept {
  static constexpr std::array names{"ok",    "ok_some_lost", "repeated", "wrong_sequence",
                                    "error", "no_new_data"};
  return enumerator_name<CheckStatus::no_new_data>(names, status, "?");
}

const char* to_string(State state) noexcept {
  static constexpr std::array names{"no_data", "init", "valid", "invalid"};
  return enumerator_name<State::invalid>(names, state, "?");
}

tl::expected<StateMachine, ConfigError> StateMachine::create(const StateMachineConfig& config) noexcept {
  const StateMachineConfig& c = config;
  Requirements rules;
  rules.require(c.window_size_valid >= 1, "window_size_valid", "at least 1");
  rules.require(c.window_size_init >= 1 && c.window_size_init <= c.window_size_valid, "window_size_init",
                "1 to window_size_valid");
  rules.require(c.window_size_invalid >= 1 && c.window_size_invalid <= c.window_size_valid,
                "window_size_invalid", "1 to window_size_valid");
  rules.require(c.min_ok_valid >= 1, "min_ok_valid", "at least 1");
  rules.require(c.min_ok_init >= c.min_ok_valid, "min_ok_init", "at least min_ok_valid");
  rules.require(c.min_ok_invalid >= c.min_ok_init, "min_ok_invalid", "at least min_ok_init");
  rules.require(c.max_error_init <= c.max_error_valid, "max_error_init", "at most max_error_valid");
  rules.require(c.max_error_invalid <= c.max_error_init, "max_error_invalid", "at most max_error_init");
  rules.require(c.min_ok_valid + c.max_error_valid <= c.window_size_valid, "max_error_valid",
                "at most window_size_valid - min_ok_valid");
  rules.require(c.min_ok_init + c.max_error_init <= c.window_size_init, "max_error_init",
                "at most window_size_init - min_ok_init");
  rules.require(c.min_ok_invalid + c.max_error_invalid <= c.window_size_invalid, "max_error_invalid",
                "at most window_size_invalid - min_ok_invalid");
  if (rules.broken()) {
    return tl::unexpected{*rules.broken()};
  }
  return StateMachine{config};
}

State StateMachine::on_check(CheckStatus status) noexcept {
  const StateMachineConfig& c = config_;
  add(status);
  switch (state_) {
    case State::no_data:
      // The figure of the specification does not say which window is meant here; we take that of init.
      if (c.transit_to_invalid_extended && checks_ >= c.window_size_init) {
        enter_invalid();
      } else if (status != CheckStatus::error && status != CheckStatus::no_new_data) {
        forget_all_but(0);  // the message that ends no_data is not counted
        state_ = State::init;
      }
      break;
    case State::init:
      if (bad(c.window_size_init) > c.max_error_init || cannot_become_valid()) {
        enter_invalid();
      } else if (good(c.window_size_init) >= c.min_ok_init) {
        enter_valid(c.window_size_init);
      }
      break;
    case State::valid:
      if (bad(c.window_size_valid) > c.max_error_valid || good(c.window_size_valid) < c.min_ok_valid) {
        enter_invalid();
      }
      break;
    case State::invalid:
      if (bad(c.window_size_invalid) <= c.max_error_invalid &&
          good(c.window_size_invalid) >= c.min_ok_invalid) {
        enter_valid(c.window_size_invalid);
      }
      break;
  }
  return state_;
}

void StateMachine::reset() noexcept {
  forget_all_but(0);
  state_ = State::no_data;
}

void StateMachine::add(CheckStatus status) noexcept {
  good_ <<= 1U;
  bad_ <<= 1U;
  good_[0] = status == CheckStatus::ok || status == CheckStatus::ok_some_lost;
  bad_[0] = status == CheckStatus::error;
  checks_ += checks_ < max_window ? 1 : 0;
}

void StateMachine::forget_all_but(std::size_t checks) noexcept {
  const Window kept = checks == 0 ? Window{} : ~Window{} >> (max_window - checks);
  good_ &= kept;
  bad_ &= kept;
  checks_ = std::min(checks_, checks);
}

std::size_t StateMachine::good(std::size_t window) const noexcept {
  return (good_ << (max_window - window)).count();
}

std::size_t StateMachine::bad(std::size_t window) const noexcept {
  return (bad_ << (max_window - window)).count();
}

/// Whether too many checks since the beginning of init were not good for the window to hold enough good ones.
bool StateMachine::cannot_become_valid() const noexcept {
  const std::size_t window = config_.window_size_init;
  return config_.transit_to_invalid_extended && checks_ - good(window) > window - config_.min_ok_init;
}

/// The window of valid may be larger than the one before: checks that have left that one must not come back.
void StateMachine::enter_valid(std::size_t window) noexcept {
  forget_all_but(window);
  state_ = State::valid;
}

/// Nothing older than the window of init can count here, even in a larger window of invalid: the errors that
/// led here are younger and have to leave first.
void StateMachine::enter_invalid() noexcept {
  if (config_.clear_to_invalid) {
    forget_all_but(0);
  }
  state_ = State::invalid;
}

}  // namespace trestle::someip::e2e
