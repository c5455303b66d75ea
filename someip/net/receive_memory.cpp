#include "someip/net/receive_memory.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <new>

namespace trestle::someip {
namespace {

std::size_t whole_pages(std::size_t bytes) {
  static const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  return (bytes + page - 1) / page * page;
}

/// Soon high for a sender that begins large messages and does not continue them; low for a quick one.
double byte_seconds(const ReceiveMemory::Use& use) {
  return static_cast<double>(use.held_bytes) * std::chrono::duration<double>(use.held_for).count();
}

}  // namespace

bool ReceiveBudget::make_room(std::size_t bytes, ReceiveMemory& asks) {
  if (bytes > max_bytes_) {
    return false;
  }
  for (ReceiveMemory* const one : users_) {
    if (used_bytes_ + bytes <= max_bytes_) {
      return true;
    }
    const auto use = one->use_();
    if (one != &asks && use.may_be_taken && use.held_bytes == 0) {
      one->give_back();
    }
  }
  while (used_bytes_ + bytes > max_bytes_) {
    ReceiveMemory* worst = nullptr;
    double most = byte_seconds(asks.use_());
    for (ReceiveMemory* const one : users_) {
      const auto use = one->use_();
      if (one != &asks && one->extra() != 0 && use.may_be_taken && byte_seconds(use) > most) {
        most = byte_seconds(use);
        worst = one;
      }
    }
    if (worst == nullptr) {
      return false;
    }
    worst->give_back();
    worst->taken_();
  }
  return true;
}

ReceiveMemory::ReceiveMemory(std::shared_ptr<ReceiveBudget> budget, std::size_t first_bytes,
                             std::function<Use()> use, std::function<void()> taken,
                             std::function<void(ByteSpan)> moved)
    : budget_{std::move(budget)},
      first_bytes_{whole_pages(first_bytes)},
      use_{std::move(use)},
      taken_{std::move(taken)},
      moved_{std::move(moved)} {
  budget_->users_.push_back(this);
  void* const place =
      ::mmap(nullptr, first_bytes_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (place == MAP_FAILED) {
    budget_->users_.pop_back();
    throw std::bad_alloc{};
  }
  place_ = static_cast<std::byte*>(place);
  bytes_ = first_bytes_;
}

ReceiveMemory::~ReceiveMemory() {
  budget_->used_bytes_ -= extra();
  std::erase(budget_->users_, this);
  ::munmap(place_, bytes_);
}

bool ReceiveMemory::grow(std::size_t bytes) {
  bytes = whole_pages(bytes);
  if (bytes <= bytes_) {
    return true;
  }
  const std::size_t more = bytes - bytes_;
  if (budget_->used_bytes_ + more > budget_->max_bytes_ && !budget_->make_room(more, *this)) {
    return false;
  }
  return resize(bytes);
}

void ReceiveMemory::give_back() {
  if (extra() != 0) {
    static_cast<void>(resize(first_bytes_));
  }
}

bool ReceiveMemory::resize(std::size_t bytes) noexcept {
  void* const place = ::mremap(place_, bytes_, bytes, MREMAP_MAYMOVE);  // moves pages, copies nothing
  if (place == MAP_FAILED) {
    return false;
  }
  budget_->used_bytes_ += bytes;
  budget_->used_bytes_ -= bytes_;
  place_ = static_cast<std::byte*>(place);
  bytes_ = bytes;
  moved_(ByteSpan{place_, bytes_});
  return true;
}

}  // namespace trestle::someip
