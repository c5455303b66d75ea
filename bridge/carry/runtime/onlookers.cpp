#include "bridge/carry/runtime/onlookers.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "bridge/carry/runtime/running_route.hpp"

namespace trestle::carry {

void Onlooker::ask(bool is_asked) {
  is_asked_ = is_asked;
  if (!is_asked) {
    newest_.reset();
  }
}

void Onlooker::keep(bool is_cdr, ByteView bytes) {
  const auto now = clock_.now();
  if (bytes.size() > often_bytes && now < next_ && !is_followed()) {
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
  const std::shared_ptr<const SeenMessage> seen = std::move(copy);
  if (is_asked_) {
    newest_ = seen;
  }
  for (const auto& [id, sink] : sinks_) {
    sink(seen);
  }
}

/// Somebody follows a route.
struct Onlookers::Following {
  Following(std::weak_ptr<Onlookers*> whose, std::weak_ptr<RunningRoute> which, std::uint64_t number)
      : onlookers{std::move(whose)}, route{std::move(which)}, sink{number} {}
  ~Following() {
    const auto still = onlookers.lock();
    const auto followed = route.lock();
    Look* const look = still && followed ? (*still)->look_of(followed) : nullptr;
    if (look != nullptr) {
      look->onlooker->remove(sink);
    }
    if (still) {
      (*still)->end_those_that_are_over();
    }
  }
  Following(const Following&) = delete;
  Following& operator=(const Following&) = delete;

  std::weak_ptr<Onlookers*> onlookers;
  std::weak_ptr<RunningRoute> route;
  std::uint64_t sink;
};

Onlookers::Onlookers(RouteClock& clock)
    : clock_{clock}, over_{clock.timer([this] { end_those_that_are_over(); })} {}

Onlookers::~Onlookers() {
  std::ranges::for_each(looks_, end);
}

std::shared_ptr<const SeenMessage> Onlookers::look(const std::shared_ptr<RunningRoute>& route) {
  if (const Look* const known = look_of(route); known == nullptr || !known->until) {
    make_room();
  }
  Look* look = look_of(route);
  if (look == nullptr) {
    look = &begin(route);
  }
  look->until = clock_.now() + look_for;
  look->onlooker->ask(true);
  if (!over_->armed()) {
    over_->set(*look->until);
  }
  return look->onlooker->newest();
}

std::shared_ptr<void> Onlookers::follow(const std::shared_ptr<RunningRoute>& route, MessageSink sink) {
  Look* look = look_of(route);
  if (look == nullptr) {
    look = &begin(route);
  }
  return std::make_shared<Following>(self_, route, look->onlooker->add(std::move(sink)));
}

Onlookers::Look* Onlookers::look_of(const std::shared_ptr<RunningRoute>& route) {
  const auto found = std::ranges::find_if(looks_, [&](const Look& one) { return one.route.lock() == route; });
  return found == looks_.end() ? nullptr : &*found;
}

Onlookers::Look& Onlookers::begin(const std::shared_ptr<RunningRoute>& route) {
  looks_.push_back({route, std::make_unique<Onlooker>(clock_), {}});
  route->shown_to(looks_.back().onlooker.get());
  return looks_.back();
}

void Onlookers::end(const Look& look) {
  if (const auto route = look.route.lock()) {
    route->shown_to(nullptr);
  }
}

// For one more that is asked about.
void Onlookers::make_room() {
  Look* oldest = nullptr;
  std::size_t asked_about = 0;
  for (Look& look : looks_) {
    if (look.until) {
      ++asked_about;
      oldest = oldest == nullptr || *look.until < *oldest->until ? &look : oldest;
    }
  }
  if (asked_about >= most_routes) {
    oldest->until.reset();
    end_those_that_are_over();
  }
}

void Onlookers::end_those_that_are_over() {
  const auto now = clock_.now();
  std::optional<RouteClock::TimePoint> next;
  for (Look& look : looks_) {
    if (look.until && *look.until <= now) {
      look.until.reset();
    }
    if (look.until) {
      next = std::min(next.value_or(*look.until), *look.until);
    } else {
      look.onlooker->ask(false);
    }
  }
  std::erase_if(looks_, [&](const Look& look) {
    const bool is_over = look.route.expired() || (!look.until && !look.onlooker->is_followed());
    if (is_over) {
      end(look);
    }
    return is_over;
  });
  if (next) {
    over_->set(*next);
  }
}

}  // namespace trestle::carry
