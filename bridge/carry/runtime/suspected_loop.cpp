#include "bridge/carry/runtime/suspected_loop.hpp"

#include "someip/net/address_text.hpp"

namespace trestle::carry {

SuspectedLoop::SuspectedLoop(RouteClock& clock, std::string what, LoopSuspects suspects, std::string words,
                             const LoopCheck::Limits& limits)
    : clock_{clock},
      what_{std::move(what)},
      suspects_{std::move(suspects)},
      words_{std::move(words)},
      limits_{limits} {}

bool SuspectedLoop::refuses(ByteView payload, const Endpoint& from, const DdsSide& dds,
                            LoopCheck::TimePoint now) {
  suspects_.update(dds);
  if (!suspects_.at(from.address)) {
    return false;
  }
  if (!guard_) {
    guard_ = std::make_unique<LoopGuard>(clock_, what_, limits_);
  }
  if (guard_->may_carry(message_hash(payload), std::nullopt, now, [&] {
        return suspects_.name_at(from.address, dds) + words_ + someip::to_string(from);
      })) {
    return false;
  }
  guard_->arm();
  return true;
}

}  // namespace trestle::carry
