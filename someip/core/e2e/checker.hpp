#pragma once
#include <optional>

#include "someip/core/e2e/layout.hpp"
#include "someip/core/e2e/state_machine.hpp"
#include "someip/wire/header.hpp"

namespace trestle::someip::e2e {

/// What made a check end in CheckStatus::error.
enum class Fault : std::uint8_t {
  none,
  data_length,      ///< the Data is shorter or longer than the configuration allows
  header_in_front,  ///< the configured offset lies in `front`
  crc,
  counter,         ///< a value that the profile's counter never has
  length_field,    ///< the header's length is not that of the Data
  data_id,         ///< some other message
  message_type,    ///< a request where a response was expected, or the reverse
  message_result,  ///< ok where an error was expected, or the reverse
  source_id,       ///< an answer to somebody else
};
/// The fault's name as it stands above, for logs and counters.
[[nodiscard]] const char* to_string(Fault fault) noexcept;

/// The code by which a server answers a request whose check says this; ok: the request is good.
[[nodiscard]] constexpr ReturnCode code_of(CheckStatus status) noexcept {
  switch (status) {
    case CheckStatus::ok:
    case CheckStatus::ok_some_lost:
      return ReturnCode::ok;
    case CheckStatus::repeated:
      return ReturnCode::e2e_repeated;
    case CheckStatus::wrong_sequence:
      return ReturnCode::e2e_wrong_sequence;
    case CheckStatus::no_new_data:
      return ReturnCode::e2e_no_new_data;
    case CheckStatus::error:
      break;
  }
  return ReturnCode::e2e;
}

/// What is expected of a method's message in profiles 4m, 7m, 8m and 44m; the other profiles ignore it.
struct MethodExpectation {
  bool response = false;
  bool error = false;
  /// Clients: their own. Servers: nothing, and then CheckResult::source_id for the answer.
  std::optional<std::uint32_t> source_id{};
};

/// What Checker found out about one message, and of the communication so far.
struct CheckResult {
  CheckStatus status = CheckStatus::no_new_data;
  Fault fault = Fault::none;
  State state = State::no_data;  ///< of the communication, this check included
  std::uint32_t counter = 0;     ///< as received; 0 after a fault
  std::uint32_t source_id = 0;   ///< as received, in profiles that have it; 0 after a fault
};

/// The receiving end of one E2E-protected event or method. Use the data only while `state` is what the safety
/// concept asks for, State::valid as a rule, and the status is ok or ok_some_lost.
///
/// A receiver that joins a running stream reports wrong_sequence for its first message, as AUTOSAR does:
/// every profile but 1 and 2 begins as if the counter before the sender's first had just been received.
class Checker {
 public:
  /// Fails naming the field of the profile or of the state machine that cannot be.
  [[nodiscard]] static tl::expected<Checker, ConfigError> create(
      const Config& config, const StateMachineConfig& state_machine = {}) noexcept;

  /// Checks the Data that is `front` and then `data`; see Protector::protect(). Any bytes may come in. A bad
  /// message changes nothing but the state machine.
  CheckResult check(ByteView front, ByteView data, const MethodExpectation& expected = {}) noexcept;
  CheckResult check(ByteView data, const MethodExpectation& expected = {}) noexcept {
    return check(ByteView{}, data, expected);
  }

  /// To be called instead of check() in a cycle that brought no message.
  CheckResult no_new_data() noexcept;

  [[nodiscard]] State state() const noexcept { return machine_.state(); }
  /// Back to the beginning, for a new stream: after a reboot of the sender, or a new subscription.
  void reset() noexcept;

 private:
  Checker(const Layout& layout, const StateMachine& machine) noexcept;

  struct Received {
    std::uint32_t counter = 0;
    std::uint32_t source_id = 0;
    Fault fault = Fault::none;
  };
  [[nodiscard]] Received read(ByteView front, ByteView data,
                              const MethodExpectation& expected) const noexcept;
  CheckStatus judge_sequence(std::uint32_t counter) noexcept;
  CheckStatus judge_early_sequence(std::uint32_t counter) noexcept;
  CheckStatus after_disturbance(CheckStatus status) noexcept;

  Layout layout_;
  StateMachine machine_;
  std::uint32_t last_counter_ = 0;
  // Profiles 1 and 2 only, named as in AUTOSAR.
  bool wait_for_first_data_ = true;
  std::uint32_t max_delta_counter_ = 0;
  std::uint32_t no_new_or_repeated_data_ = 0;
  std::uint32_t sync_counter_ = 0;
};

}  // namespace trestle::someip::e2e
