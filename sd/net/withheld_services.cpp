#include "sd/net/withheld_services.hpp"

#include <algorithm>
#include <utility>

namespace trestle::sd {

std::vector<RemoteHandle> WithheldServices::to_admit(const std::vector<RemoteService>& all, TimePoint now) {
  std::vector<RemoteHandle> admitted;
  const std::vector<Seen> before = std::exchange(seen_, {});
  for (const RemoteService& one : all) {
    const auto index_of = [](const Seen& seen) { return seen.service.index; };
    const auto known = std::ranges::lower_bound(before, one.handle.index, {}, index_of);
    // In the same place there may be another one by now.
    const bool is_new = known == before.end() || known->service != one.handle;
    const TimePoint first = is_new ? now : known->first;
    if (now - first >= longest_ || (is_known_ && is_known_(one))) {
      admitted.push_back(one.handle);
    } else {
      count_ += is_new ? 1U : 0U;
      seen_.push_back({one.handle, first});
    }
  }
  std::ranges::sort(seen_, {}, [](const Seen& seen) { return seen.service.index; });
  return admitted;
}

}  // namespace trestle::sd
