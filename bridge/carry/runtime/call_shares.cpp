#include "bridge/carry/runtime/call_shares.hpp"

#include <algorithm>
#include <utility>

namespace trestle::carry {

CallShares::Caller* CallShares::find(const CallerKey& caller) {
  const auto found = std::ranges::find(callers_, caller, &Caller::key);
  return found == callers_.end() ? nullptr : &*found;
}

// In place of the one that has been silent for the longest, and has nothing waiting; null when all have.
CallShares::Caller* CallShares::add(const CallerKey& caller) {
  if (callers_.size() < most_callers) {
    return &callers_.emplace_back(Caller{caller});
  }
  const auto oldest = std::ranges::min_element(callers_, [](const Caller& a, const Caller& b) {
    return std::pair{a.waiting > 0, a.last} < std::pair{b.waiting > 0, b.last};
  });
  if (oldest->waiting > 0) {
    return nullptr;
  }
  *oldest = {caller};
  return &*oldest;
}

bool CallShares::take(const CallerKey& caller, TimePoint now) {
  std::erase_if(callers_, [&](const Caller& one) { return one.waiting == 0 && now - one.last >= lately; });
  Caller* const known = find(caller);
  Caller* const its = known != nullptr ? known : add(caller);
  if (its == nullptr) {
    ++waiting_;
    return true;
  }
  its->last = now;
  const std::size_t share = std::max<std::size_t>(places_ / callers_.size(), 1);
  if (waiting_ >= places_ / 2 && its->waiting >= share) {
    return false;
  }
  ++its->waiting;
  ++waiting_;
  return true;
}

void CallShares::take_over(const CallerKey& caller) {
  ++waiting_;
  if (Caller* const its = find(caller); its != nullptr) {
    ++its->waiting;
  }
}

void CallShares::give_back(const CallerKey& caller) {
  --waiting_;
  if (Caller* const its = find(caller); its != nullptr && its->waiting > 0) {
    --its->waiting;
  }
}

}  // namespace trestle::carry
