#include "someip/net/copy_pool.hpp"

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <utility>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "someip/net/handler_memory.hpp"

namespace trestle::someip {
namespace {

constexpr std::size_t max_copies = 64;  // few, because each search looks at all of them
constexpr std::size_t worth_trimming = std::size_t{1} << 20U;  // bytes

}  // namespace

struct CopyPool::Clock {
  Clock(boost::asio::io_context& io, CopyPool* owner, Duration between)
      : timer{io}, pool{owner}, quiet{between} {}
  boost::asio::steady_timer timer;
  CopyPool* pool;  ///< null: it has ended
  Duration quiet;
  bool runs = false;
  HandlerMemory memory;
};

CopyPool::CopyPool(std::size_t max_bytes, boost::asio::io_context& io, Duration quiet)
    : max_bytes_{max_bytes}, clock_{std::make_shared<Clock>(io, this, quiet)} {}

CopyPool::~CopyPool() {
  if (clock_) {
    clock_->pool = nullptr;
    clock_->timer.cancel();
  }
}

std::vector<std::byte> CopyPool::take(std::size_t bytes) {
  // Not a much larger buffer: waiting small messages would keep it, but count with their own size only.
  const auto found = std::find_if(unused_.rbegin(), unused_.rend(), [&](const Unused& one) {
    return one.memory.capacity() >= bytes && one.memory.capacity() - bytes <= bytes;
  });
  std::vector<std::byte> memory;
  if (found == unused_.rend()) {
    memory.reserve(bytes);
  } else {
    memory = std::move(found->memory);
    unused_.erase(std::next(found).base());
    kept_bytes_ -= memory.capacity();
  }
  return memory;
}

void CopyPool::give_back(std::vector<std::byte> used) {
  if (used.capacity() == 0) {
    return;
  }
  used.clear();
  kept_bytes_ += used.capacity();
  unused_.push_back({std::move(used)});
  std::size_t too_many = 0;
  for (std::size_t left = kept_bytes_; left > max_bytes_ || unused_.size() - too_many > max_copies;) {
    left -= unused_[too_many++].memory.capacity();
  }
  drop(too_many);
  wait_for_quiet();
}

// The old ones stand first: what is used is put last.
void CopyPool::drop_unused() {
  [[maybe_unused]] const std::size_t kept = kept_bytes_;
  drop(static_cast<std::size_t>(std::ranges::count_if(unused_, &Unused::is_old)));
  for (Unused& one : unused_) {
    one.is_old = true;
  }
#ifdef __GLIBC__
  if (kept - kept_bytes_ >= worth_trimming) {
    malloc_trim(0);  // else it stays with the process, below what was allocated since
  }
#endif
}

void CopyPool::drop(std::size_t count) {
  const auto end = unused_.begin() + static_cast<std::ptrdiff_t>(count);
  for (auto one = unused_.begin(); one != end; ++one) {
    kept_bytes_ -= one->memory.capacity();
  }
  unused_.erase(unused_.begin(), end);
}

void CopyPool::wait_for_quiet() {
  if (!clock_ || unused_.empty() || std::exchange(clock_->runs, true)) {
    return;
  }
  clock_->timer.expires_after(clock_->quiet);
  clock_->timer.async_wait(clock_->memory.hold([clock = clock_](const boost::system::error_code&) {
    clock->runs = false;
    if (clock->pool != nullptr) {
      clock->pool->drop_unused();
      clock->pool->wait_for_quiet();
    }
  }));
}

}  // namespace trestle::someip
