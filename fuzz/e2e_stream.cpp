// Property: whatever a channel does to a protected stream, the checker takes no message for good that was
// changed, says of each other one what its counter says by the text of the profile, and its state follows
// from the last checks as AUTOSAR's state machine has it. A plain model says what should come out.
//
// Input: 11 bytes of the state machine and the profile, then a byte for each cycle: what the channel does.
#include <algorithm>
#include <cstdlib>
#include <deque>
#include <optional>
#include <vector>

#include "someip/core/e2e/checker.hpp"
#include "someip/core/e2e/protector.hpp"
#include "someip/wire/bytes.hpp"

using namespace trestle;
using namespace trestle::someip;
using namespace trestle::someip::e2e;

namespace {

constexpr std::uint32_t max_delta = 3;
constexpr std::size_t data_bytes = 30;  // profile 11 takes no more, profile 7 no less than 28
constexpr std::uint32_t data_bits = data_bytes * 8;

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

/// A profile whose counter begins at 0 and has so many values.
struct Choice {
  Config config;
  std::uint64_t counters;
  /// From here on bits are changed. In profile 22 another counter means another Data ID in the CRC of 8 bits,
  /// which may make up for it.
  std::size_t first_changed = 0;
};

Choice choose(std::uint8_t which) {
  constexpr std::array<std::uint8_t, 16> ids{3, 14, 15, 92, 65, 35, 89, 79, 32, 38, 46, 26, 43, 38, 32, 79};
  switch (which % 6) {
    case 0:
      return {Profile4{.data_id = 0x0a0b'0c0d, .max_delta_counter = max_delta}, 0x1'0000};
    case 1:
      return {Profile5{.data_id = 0x1234, .data_bits = data_bits, .max_delta_counter = max_delta}, 0x100};
    case 2:
      return {Profile6{.data_id = 0x1234, .max_delta_counter = max_delta}, 0x100};
    case 3:
      return {Profile7{.data_id = 0x0a0b'0c0d, .max_delta_counter = max_delta}, 0x1'0000'0000};
    case 4:
      return {Profile11{.data_id = 0x0123, .data_bits = data_bits, .max_delta_counter = max_delta}, 15};
    default:
      return {Profile22{.data_id_list = ids, .data_bits = data_bits, .max_delta_counter = max_delta}, 16, 10};
  }
}

/// AUTOSAR's E2E state machine, from the list of the last checks.
class PlainMachine {
 public:
  explicit PlainMachine(const StateMachineConfig& config) : config_{config} {}

  State on_check(CheckStatus status) {
    last_.push_front(status);
    switch (state_) {
      case State::no_data:
        if (status != CheckStatus::error && status != CheckStatus::no_new_data) {
          state_ = State::init;
          last_.clear();  // it is not counted
        }
        break;
      case State::init:
        leave(config_.window_size_init, config_.min_ok_init, config_.max_error_init);
        break;
      case State::valid:
        if (bad(config_.window_size_valid) > config_.max_error_valid ||
            good(config_.window_size_valid) < config_.min_ok_valid) {
          state_ = State::invalid;
        }
        break;
      case State::invalid:
        if (bad(config_.window_size_invalid) <= config_.max_error_invalid &&
            good(config_.window_size_invalid) >= config_.min_ok_invalid) {
          enter_valid(config_.window_size_invalid);
        }
        break;
    }
    return state_;
  }

 private:
  void leave(std::size_t window, std::size_t min_ok, std::size_t max_error) {
    if (bad(window) > max_error) {
      state_ = State::invalid;
    } else if (good(window) >= min_ok) {
      enter_valid(window);
    }
  }
  /// What has left the window does not come back in a larger one.
  void enter_valid(std::size_t window) {
    state_ = State::valid;
    last_.resize(std::min(window, last_.size()));
  }
  [[nodiscard]] std::size_t count(std::size_t window, bool is_good) const {
    std::size_t found = 0;
    for (std::size_t at = 0; at < std::min(window, last_.size()); ++at) {
      const bool good = last_[at] == CheckStatus::ok || last_[at] == CheckStatus::ok_some_lost;
      found += (is_good ? good : last_[at] == CheckStatus::error) ? 1U : 0U;
    }
    return found;
  }
  [[nodiscard]] std::size_t good(std::size_t window) const { return count(window, true); }
  [[nodiscard]] std::size_t bad(std::size_t window) const { return count(window, false); }

  StateMachineConfig config_;
  State state_ = State::no_data;
  std::deque<CheckStatus> last_;
};

class Channel {
 public:
  Channel(const Choice& choice, Protector protector, Checker checker)
      : counters_{choice.counters},
        first_changed_{choice.first_changed},
        protector_{std::move(protector)},
        checker_{std::move(checker)} {}

  CheckResult cycle(std::uint8_t what) {
    switch (what % 8) {
      case 0:
        return checker_.no_new_data();
      case 1:
        return receive(old_.empty() ? send() : old_[what / 8 % old_.size()], true);
      case 2: {
        std::vector<std::byte> changed = send();
        changed[first_changed_ + what / 8 % (data_bytes - first_changed_)] ^= std::byte{1} << (what / 16 % 8);
        const CheckResult result = checker_.check(changed);
        require(result.status == CheckStatus::error && result.fault != Fault::none);
        return result;
      }
      case 3:
        for (int lost = what / 8 % 8; lost > 0; --lost) {
          (void)send();
        }
        return receive(send(), true);
      case 4:
        require(checker_.check(ByteView{}).status == CheckStatus::error);
        return checker_.check(ByteView{old_.empty() ? send() : old_.front()}.first(3));
      default:
        return receive(send(), true);
    }
  }

 private:
  std::vector<std::byte> send() {
    std::vector<std::byte> data(data_bytes);
    require(protector_.protect(data).has_value());
    old_.push_front(data);
    old_.resize(std::min<std::size_t>(old_.size(), 8));
    return data;
  }

  CheckResult receive(const std::vector<std::byte>& data, bool is_good) {
    const CheckResult result = checker_.check(data);
    require(is_good == (result.fault == Fault::none));
    // The receiver begins as if the counter before the sender's first had just been received.
    const std::uint64_t before = last_.value_or(counters_ - 1);
    const std::uint64_t delta = (result.counter + counters_ - before) % counters_;
    const CheckStatus expected = delta == 0           ? CheckStatus::repeated
                                 : delta == 1         ? CheckStatus::ok
                                 : delta <= max_delta ? CheckStatus::ok_some_lost
                                                      : CheckStatus::wrong_sequence;
    require(result.status == expected);
    last_ = result.counter;
    return result;
  }

  std::uint64_t counters_;
  std::size_t first_changed_;
  Protector protector_;
  Checker checker_;
  std::deque<std::vector<std::byte>> old_;
  std::optional<std::uint64_t> last_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ByteReader in{std::as_bytes(std::span{data, size})};
  const Choice choice = choose(in.u8());
  const auto small = [&] { return static_cast<std::uint8_t>(1 + in.u8() % 6); };
  StateMachineConfig config{
      .window_size_init = small(), .window_size_valid = small(), .window_size_invalid = small()};
  config.min_ok_init = small();
  config.min_ok_valid = small();
  config.min_ok_invalid = small();
  config.max_error_init = static_cast<std::uint8_t>(in.u8() % 4);
  config.max_error_valid = static_cast<std::uint8_t>(in.u8() % 4);
  config.max_error_invalid = static_cast<std::uint8_t>(in.u8() % 4);
  auto checker = Checker::create(choice.config, config);
  if (!checker) {
    config = {};
    checker = Checker::create(choice.config, config);
  }
  auto protector = Protector::create(choice.config);
  require(checker && protector);
  if (in.failed()) {
    return 0;
  }
  protector->resume(in.u8());
  PlainMachine machine{config};
  Channel channel{choice, std::move(*protector), std::move(*checker)};
  while (!in.rest().empty()) {
    const std::uint8_t what = in.u8();
    const CheckResult result = channel.cycle(what);
    if (what % 8 == 4) {
      (void)machine.on_check(CheckStatus::error);  // the empty one before
    }
    require(machine.on_check(result.status) == result.state);
  }
  return 0;
}
