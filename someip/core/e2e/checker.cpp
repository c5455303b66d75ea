#include "someip/core/e2e/checker.hpp"

#include <algorithm>

#include "someip/wire/enumerator_name.hpp"

namespace trestle::someip::e2e {

const char* to_string(Fault fault) noexcept {
  static constexpr std::array names{"none",           "data_length",  "header_in_front", "crc",
                                    "counter",        "length_field", "data_id",         "message_type",
                                    "message_result", "source_id"};
  return enumerator_name<Fault::source_id>(names, fault, "?");
}

tl::expected<Checker, ConfigError> Checker::create(const Config& config,
                                                   const StateMachineConfig& state_machine) noexcept {
  const auto layout = make_layout(config);
  if (!layout) {
    return tl::unexpected{layout.error()};
  }
  const auto machine = StateMachine::create(state_machine);
  if (!machine) {
    return tl::unexpected{machine.error()};
  }
  return Checker{*layout, *machine};
}

Checker::Checker(const Layout& layout, const StateMachine& machine) noexcept
    : layout_{layout}, machine_{machine} {
  reset();
}

void Checker::reset() noexcept {
  machine_.reset();
  last_counter_ = layout_.counter_max;
  wait_for_first_data_ = true;
  max_delta_counter_ = 0;
  no_new_or_repeated_data_ = 0;
  sync_counter_ = 0;
}

CheckResult Checker::check(ByteView front, ByteView data, const MethodExpectation& expected) noexcept {
  CheckResult result;
  // After each check the next good message may have missed one message more.
  max_delta_counter_ = std::min(max_delta_counter_ + 1, layout_.counter_max);
  const Received received = read(front, data, expected);
  result.fault = received.fault;
  if (received.fault != Fault::none) {
    result.status = CheckStatus::error;
  } else {
    result.counter = received.counter;
    result.source_id = received.source_id;
    result.status = layout_.early ? judge_early_sequence(received.counter) : judge_sequence(received.counter);
  }
  result.state = machine_.on_check(result.status);
  return result;
}

CheckResult Checker::no_new_data() noexcept {
  max_delta_counter_ = std::min(max_delta_counter_ + 1, layout_.counter_max);
  no_new_or_repeated_data_ = std::min(no_new_or_repeated_data_ + 1, layout_.counter_max);
  return {.status = CheckStatus::no_new_data, .state = machine_.on_check(CheckStatus::no_new_data)};
}

/// Everything but the sequence.
Checker::Received Checker::read(ByteView front, ByteView data,
                                const MethodExpectation& expected) const noexcept {
  const std::size_t bytes = front.size() + data.size();
  if (bytes < layout_.min_bytes || bytes > layout_.max_bytes) {
    return {.fault = Fault::data_length};
  }
  if (layout_.header_at() < front.size()) {
    return {.fault = Fault::header_in_front};
  }
  const auto field = [&](HeaderField which) {
    return static_cast<std::uint32_t>(read_field(which, data, front.size()));
  };
  const std::uint32_t counter = field(layout_.counter);
  if (read_field(layout_.crc, data, front.size(), layout_.crc_order) !=
      checksum(layout_, front, data, counter)) {
    return {.fault = Fault::crc};
  }
  if (counter > layout_.counter_max) {
    return {.fault = Fault::counter};
  }
  if (layout_.length.size != 0 && field(layout_.length) != bytes) {
    return {.fault = Fault::length_field};
  }
  if ((layout_.data_id.size != 0 && field(layout_.data_id) != layout_.id) ||
      (layout_.data_id_nibble.size != 0 && field(layout_.data_id_nibble) != ((layout_.id >> 8U) & 0x0fU))) {
    return {.fault = Fault::data_id};
  }
  Received received{.counter = counter};
  if (layout_.source.size != 0) {
    const std::uint32_t source = field(layout_.source);
    received.source_id = source & 0x0fffffffU;
    if (source >> 30U != (expected.response ? 1U : 0U)) {
      return {.fault = Fault::message_type};
    }
    if (((source >> 28U) & 3U) != (expected.error ? 1U : 0U)) {
      return {.fault = Fault::message_result};
    }
    if (expected.source_id && *expected.source_id != received.source_id) {
      return {.fault = Fault::source_id};
    }
  }
  return received;
}

CheckStatus Checker::judge_sequence(std::uint32_t counter) noexcept {
  const std::uint32_t delta = layout_.steps(last_counter_, counter);
  last_counter_ = counter;
  if (delta == 0) {
    return CheckStatus::repeated;
  }
  if (delta > layout_.max_delta_counter) {
    return CheckStatus::wrong_sequence;
  }
  return delta == 1 ? CheckStatus::ok : CheckStatus::ok_some_lost;
}

/// Profiles 1 and 2. A message out of sequence is accepted as a new beginning only if synchronising is on.
CheckStatus Checker::judge_early_sequence(std::uint32_t counter) noexcept {
  const EarlySequence& sequence = *layout_.early;
  if (wait_for_first_data_) {
    wait_for_first_data_ = false;
    max_delta_counter_ = sequence.max_delta_counter_init;
    last_counter_ = counter;
    return sequence.behavior == Behavior::r4_2 ? CheckStatus::wrong_sequence : CheckStatus::ok;
  }
  const std::uint32_t delta = layout_.steps(last_counter_, counter);
  if (delta == 0) {
    no_new_or_repeated_data_ = std::min(no_new_or_repeated_data_ + 1, layout_.counter_max);
    return CheckStatus::repeated;
  }
  if (delta <= max_delta_counter_) {
    max_delta_counter_ = sequence.max_delta_counter_init;
    last_counter_ = counter;
    if (no_new_or_repeated_data_ > sequence.max_no_new_or_repeated_data) {
      sync_counter_ = sequence.sync_counter_init;
    }
    no_new_or_repeated_data_ = 0;
    return after_disturbance(delta == 1 ? CheckStatus::ok : CheckStatus::ok_some_lost);
  }
  no_new_or_repeated_data_ = 0;
  sync_counter_ = sequence.sync_counter_init;
  if (sync_counter_ > 0) {
    max_delta_counter_ = sequence.max_delta_counter_init;
    last_counter_ = counter;
  }
  return CheckStatus::wrong_sequence;
}

/// `status`, unless the receiver is still synchronising after a disturbance.
CheckStatus Checker::after_disturbance(CheckStatus status) noexcept {
  if (sync_counter_ == 0) {
    return status;
  }
  --sync_counter_;
  return layout_.early->behavior == Behavior::r4_2 ? status : CheckStatus::wrong_sequence;
}

}  // namespace trestle::someip::e2e
