#include "bridge/carry/runtime/onlookers.hpp"

#include <algorithm>

#include "bridge/carry/runtime/running_route.hpp"

namespace trestle::carry {

void Onlooker::keep(bool is_cdr, ByteView bytes) {
  const auto now = clock_.now();
  if (bytes.size() > often_bytes && now < next_) {
    return;
  }
  next_ = now + spacing;
  auto copy = std::make_shared<SeenMessage>();
  copy->is_cdr = is_cdr;
  copy->size = bytes.size();
  copy->at_ns = clock_.since_1970().count();
  if (bytes.size() <= most_bytes) {
    copy->bytes.assign(bytes.begin(), bytes.end());
  }
  newest_ = std::move(copy);
}

Onlookers::Onlookers(RouteClock& clock)
    : clock_{clock}, over_{clock.timer([this] { end_those_that_are_over(); })} {}

Onlookers::~Onlookers() {
  std::ranges::for_each(looks_, end);
}

std::shared_ptr<const SeenMessage> Onlookers::look(const std::shared_ptr<RunningRoute>& route) {
  const auto until = clock_.now() + look_for;
  auto found = std::ranges::find_if(looks_, [&](const Look& one) { return one.route.lock() == route; });
  if (found == looks_.end()) {
    if (looks_.size() == most_routes) {
      const auto oldest = std::ranges::min_element(looks_, {}, &Look::until);
      end(*oldest);
      looks_.erase(oldest);
    }
    looks_.push_back({route, std::make_unique<Onlooker>(clock_), until});
    found = std::prev(looks_.end());
    route->shown_to(found->onlooker.get());
  }
  found->until = until;
  if (!over_->armed()) {
    over_->set(until);
  }
  return found->onlooker->newest();
}

void Onlookers::end(const Look& look) {
  if (const auto route = look.route.lock()) {
    route->shown_to(nullptr);
  }
}

void Onlookers::end_those_that_are_over() {
  const auto now = clock_.now();
  std::erase_if(looks_, [&](const Look& one) {
    const bool is_over = one.until <= now || one.route.expired();
    if (is_over) {
      end(one);
    }
    return is_over;
  });
  if (!looks_.empty()) {
    over_->set(std::ranges::min_element(looks_, {}, &Look::until)->until);
  }
}

}  // namespace trestle::carry
