#include "bridge/carry/runtime/recent_messages.hpp"

#include <algorithm>
#include <new>
#include <span>
#include <utility>

namespace trestle::carry {
namespace {

// Where all places are of the last second, one new message in so many takes one.
constexpr std::uint32_t gives_way_to_one_in = 8;

std::uint32_t name_of(std::uint64_t hash) noexcept {
  hash = (hash ^ (hash >> 33U)) * 0xff51afd7ed558ccdU;
  const auto name = static_cast<std::uint32_t>(hash >> 32U);
  return name == 0 ? 1 : name;
}

// Wraps after 71 minutes; what is older than that may once be taken for recent, which counts as one repeat.
std::uint32_t microseconds(RecentMessages::TimePoint now) noexcept {
  return static_cast<std::uint32_t>(
      std::chrono::duration_cast<std::chrono::microseconds>(now.time_since_epoch()).count());
}

}  // namespace

RecentMessages::RecentMessages() : places_{std::make_unique<Place[]>(least)} {}

RecentMessages::Place* RecentMessages::places_of(std::uint32_t message) const noexcept {
  return &places_[message % (room_ / ways) * ways];
}

RecentMessages::Place* RecentMessages::free_place(std::uint32_t message,
                                                  std::uint32_t now_us) const noexcept {
  const std::span places{places_of(message), ways};
  const auto oldest = std::ranges::max_element(
      places, {}, [&](const Place& one) { return one.message == 0 ? ~0U : now_us - one.last_us; });
  return oldest->message == 0 || now_us - oldest->last_us > memory.count() ? &*oldest : nullptr;
}

RecentMessages::Place* RecentMessages::find(std::uint32_t message, std::uint32_t now_us) const noexcept {
  for (Place& one : std::span{places_of(message), ways}) {
    if (one.message == message && now_us - one.last_us <= memory.count()) {
      return &one;
    }
  }
  return nullptr;
}

bool RecentMessages::has(std::uint64_t hash, TimePoint now) const noexcept {
  return find(name_of(hash), microseconds(now)) != nullptr;
}

std::optional<RecentMessages::Before> RecentMessages::note(std::uint64_t hash,
                                                           std::optional<std::uint64_t> from,
                                                           TimePoint now) noexcept {
  const std::uint32_t message = name_of(hash);
  const std::uint32_t sender = from ? name_of(*from) : 0;
  const std::uint32_t now_us = microseconds(now);
  if (Place* const known = find(message, now_us)) {
    const std::chrono::microseconds ago{now_us - std::exchange(known->last_us, now_us)};
    return Before{sender != 0 && known->first_from == sender, ago, &known->mark};
  }
  Place* place = free_place(message, now_us);
  while (place == nullptr && grow(now_us)) {
    place = free_place(message, now_us);
  }
  if (place == nullptr && ++turned_away_ % gives_way_to_one_in == 0) {
    place = places_of(message) + turned_away_ / gives_way_to_one_in % ways;
  }
  if (place != nullptr) {
    *place = {message, sender, now_us};
  }
  return std::nullopt;
}

bool RecentMessages::grow(std::uint32_t now_us) noexcept {
  if (room_ == most) {
    return false;
  }
  const std::size_t before = room_;
  std::unique_ptr<Place[]> larger{new (std::nothrow) Place[before * 2]};
  if (!larger) {
    return false;
  }
  const auto old = std::exchange(places_, std::move(larger));
  room_ = before * 2;
  for (const Place& one : std::span{old.get(), before}) {
    if (one.message != 0 && now_us - one.last_us <= memory.count()) {
      if (Place* const place = free_place(one.message, now_us)) {
        *place = one;
      }
    }
  }
  return true;
}

}  // namespace trestle::carry
