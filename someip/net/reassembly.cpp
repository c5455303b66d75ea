#include "someip/net/reassembly.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <bit>

namespace trestle::someip {
namespace {

std::size_t in_pages(std::size_t bytes) {
  static const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  return (bytes + page - 1) / page * page;
}

}  // namespace

void ReassemblyBudget::make_room(Reassembly& asks, std::size_t slot, TimePoint now) {
  while (used_bytes_ > max_bytes_ && give_back_oldest(asks, slot)) {
  }
  while (used_bytes_ > max_bytes_) {
    Reassembly* slowest = nullptr;
    std::size_t which = 0;
    std::uint64_t least = 0;
    for (Reassembly* const one : users_) {
      for (std::size_t i = 0; i < one->places_.size(); ++i) {
        if (one->places_[i].chunks == 0 || !one->machine_.under_way(i) ||
            one->machine_.is_protected(i, now)) {
          continue;
        }
        const std::uint64_t rate = one->machine_.rate(i, now);
        if (slowest == nullptr || rate < least) {
          slowest = one;
          which = i;
          least = rate;
        }
      }
    }
    if (slowest == nullptr || (slowest == &asks && which == slot)) {
      return;
    }
    static_cast<void>(slowest->machine_.end(which, TpDrop::no_memory, now));
    slowest->empty(slowest->places_[which]);
  }
}

bool ReassemblyBudget::give_back_oldest(const Reassembly& asks, std::size_t slot) {
  Reassembly* owner = nullptr;
  std::size_t which = 0;
  for (Reassembly* const one : users_) {
    for (std::size_t i = 0; i < one->places_.size(); ++i) {
      const bool stays =
          one->places_[i].chunks == 0 || one->machine_.under_way(i) || (one == &asks && i == slot);
      if (!stays && (owner == nullptr || one->machine_.until(i) < owner->machine_.until(which))) {
        owner = one;
        which = i;
      }
    }
  }
  if (owner == nullptr) {
    return false;
  }
  owner->empty(owner->places_[which]);
  return true;
}

Reassembly::Reassembly(std::size_t max_messages, const TpReassemblyLimits& limits,
                       std::shared_ptr<ReassemblyBudget> budget)
    : max_messages_{max_messages},
      max_message_bytes_{limits.max_message_bytes},
      place_bytes_{in_pages(tp_map_words(max_message_bytes_) * sizeof(std::uint32_t)) +
                   in_pages(max_message_bytes_)},
      large_shift_{small_shift},
      budget_{budget ? std::move(budget)
                     : std::make_shared<ReassemblyBudget>(std::numeric_limits<std::size_t>::max())},
      machine_{{}, limits} {
  while (max_message_bytes_ > small_bytes && ((max_message_bytes_ - small_bytes) >> large_shift_) >= 32) {
    ++large_shift_;
  }
  places_.reserve(max_messages);
  slots_.reserve(max_messages);
  budget_->users_.push_back(this);
}

Reassembly::~Reassembly() {
  while (!places_.empty()) {
    remove_place();
  }
  std::erase(budget_->users_, this);
}

Result<std::optional<Reassembled>, TpDrop> Reassembly::count_chunks(const std::optional<Reassembled>& whole,
                                                                    std::uint64_t chunks, TimePoint now) {
  const std::size_t slot = machine_.recent();
  Place& place = places_[slot];
  budget_->used_bytes_ += bytes_of(chunks & ~place.chunks);
  place.chunks |= chunks;
  if (budget_->used_bytes_ <= budget_->max_bytes_) {
    return whole;
  }
  budget_->make_room(*this, slot, now);
  if (budget_->used_bytes_ > budget_->max_bytes_ && !whole) {  // no message is slower than this one
    auto refused = machine_.end(slot, TpDrop::no_memory, now);
    empty(place);
    return refused;
  }
  return whole;
}

std::size_t Reassembly::bytes_of(std::uint64_t chunks) const noexcept {
  constexpr std::uint64_t small = (std::uint64_t{1} << small_chunks) - 1;
  return (static_cast<std::size_t>(std::popcount(chunks & small)) << small_shift) +
         (static_cast<std::size_t>(std::popcount(chunks & ~small)) << large_shift_);
}

void Reassembly::empty(Place& place) {
  ::madvise(place.memory, place_bytes_, MADV_DONTNEED);
  budget_->used_bytes_ -= bytes_of(place.chunks);
  place.chunks = 0;
}

void Reassembly::add_place() {
  void* const memory = ::mmap(nullptr, place_bytes_, PROT_READ | PROT_WRITE,
                              MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (memory == MAP_FAILED) {
    return;  // work goes on with the places that exist
  }
  ::madvise(memory, place_bytes_, MADV_NOHUGEPAGE);  // otherwise a small message would take 2 MB
  places_.push_back({memory});
  slots_.push_back(slot_of(places_.back()));
  machine_.use(slots_);
}

TpSlot Reassembly::slot_of(const Place& place) const noexcept {
  const std::size_t words = tp_map_words(max_message_bytes_);
  auto* const buffer = static_cast<std::byte*>(place.memory) + in_pages(words * sizeof(std::uint32_t));
  return {ByteSpan{buffer, max_message_bytes_}, std::span{static_cast<std::uint32_t*>(place.memory), words}};
}

void Reassembly::forget(const IpAddress& sender, TimePoint now) {
  for (std::size_t i = 0; i < places_.size(); ++i) {
    if (!machine_.used(i) || places_[i].sender != sender) {
      continue;
    }
    if (machine_.under_way(i)) {
      static_cast<void>(machine_.end(i, TpDrop::replaced, now));  // which counts it
    }
    empty(places_[i]);
    slots_[i] = slot_of(places_[i]);
  }
}

void Reassembly::remove_place() {
  budget_->used_bytes_ -= bytes_of(places_.back().chunks);
  ::munmap(places_.back().memory, place_bytes_);
  places_.pop_back();
  slots_.pop_back();
  machine_.use(slots_);
}

void Reassembly::on_time(TimePoint now) {
  machine_.on_time(now);
  while (const auto slot = machine_.forget(now)) {
    empty(places_[*slot]);
  }
  // One place stays for the next message. Unused places in the middle cost only address space.
  while (slots_.size() > 1 && !machine_.used(slots_.size() - 1) && !machine_.used(slots_.size() - 2)) {
    remove_place();
  }
}

std::optional<TimePoint> Reassembly::deadline() const {
  const auto under_way = machine_.deadline();
  const auto remembered = machine_.forget_deadline();
  return under_way && remembered ? earlier(*under_way, *remembered) : under_way ? under_way : remembered;
}

}  // namespace trestle::someip
