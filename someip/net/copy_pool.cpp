#include "someip/net/copy_pool.hpp"

#include <algorithm>
#include <utility>

namespace trestle::someip {
namespace {

constexpr std::size_t max_copies = 64;  // few, because each search looks at all of them

}  // namespace

std::vector<std::byte> CopyPool::take(std::size_t bytes) {
  // Not a much larger buffer: waiting small messages would keep it, but count with their own size only.
  const auto found = std::find_if(unused_.rbegin(), unused_.rend(), [&](const std::vector<std::byte>& one) {
    return one.capacity() >= bytes && one.capacity() - bytes <= bytes;
  });
  std::vector<std::byte> memory;
  if (found == unused_.rend()) {
    memory.reserve(bytes);
  } else {
    memory = std::move(*found);
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
  unused_.push_back(std::move(used));
  while (kept_bytes_ > max_bytes_ || unused_.size() > max_copies) {
    kept_bytes_ -= unused_.front().capacity();
    unused_.erase(unused_.begin());
  }
}

}  // namespace trestle::someip
