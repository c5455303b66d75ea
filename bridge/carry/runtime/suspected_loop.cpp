#include "bridge/carry/runtime/suspected_loop.hpp"

#include "someip/net/address_text.hpp"

namespace trestle::carry {
namespace {

/// As many times more repeats are needed from where nobody is known who could close a ring.
constexpr std::uint32_t far_factor = 5;

LoopCheck::Limits far(LoopCheck::Limits limits) {
  limits.repeats *= far_factor;
  return limits;
}

}  // namespace

SuspectedLoop::SuspectedLoop(RouteClock& clock, std::string what, LoopSuspects suspects, std::string words,
                             const LoopCheck::Limits& limits)
    : clock_{clock},
      what_{std::move(what)},
      suspects_{std::move(suspects)},
      words_{std::move(words)},
      near_{limits},
      far_{far(limits)} {}

bool SuspectedLoop::refuses(ByteView payload, const Endpoint& from, const DdsSide& dds,
                            LoopCheck::TimePoint now, bool caused) {
  suspects_.update(dds);
  if (!suspects_.any()) {
    return false;
  }
  const bool near = suspects_.at(from.address);
  if (!near && (!caused || (!far_.guard && !is_much(now)))) {
    return false;
  }
  auto& [limits, guard] = near ? near_ : far_;
  if (!guard) {
    guard = std::make_unique<LoopGuard>(clock_, what_, limits);
  }
  if (guard->may_carry(message_hash(payload), std::nullopt, now, [&] {
        return suspects_.name_at(from.address, dds) + words_ + someip::to_string(from);
      })) {
    return false;
  }
  guard->arm();
  return true;
}

bool SuspectedLoop::is_much(LoopCheck::TimePoint now) noexcept {
  if (now - second_begin_ > std::chrono::seconds{1}) {
    second_begin_ = now;
    in_second_ = 0;
  }
  return ++in_second_ > far_.limits.repeats / far_.limits.weight_of_unnamed;
}

}  // namespace trestle::carry
