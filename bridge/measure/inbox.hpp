#pragma once
#include <deque>
#include <mutex>
#include <utility>

#include "bridge/measure/report.hpp"
#include "dds_adapter/participant.hpp"

namespace trestle::measure {

/// Samples on their way from the thread of DDS that receives them to the main thread, which waits for them.
class Inbox {
 public:
  struct Received {
    dds::Sample sample;
    std::int64_t at_ns = 0;
  };

  /// @param waiting  is woken by each sample.
  explicit Inbox(const StopSignals& waiting) : waiting_{waiting} {}

  void put(dds::Sample sample) {
    constexpr std::size_t most = 64;
    const std::int64_t now = monotonic_ns();
    {
      const std::lock_guard lock{mutex_};
      if (samples_.size() < most) {
        samples_.push_back({std::move(sample), now});
      } else {
        ++overrun_;
      }
    }
    waiting_.wake();
  }
  std::deque<Received> take() {
    const std::lock_guard lock{mutex_};
    return std::exchange(samples_, {});
  }
  /// How many came while 64 others were waiting: these are lost.
  [[nodiscard]] std::uint64_t overrun() {
    const std::lock_guard lock{mutex_};
    return overrun_;
  }

 private:
  const StopSignals& waiting_;
  std::mutex mutex_;
  std::deque<Received> samples_;
  std::uint64_t overrun_ = 0;
};

}  // namespace trestle::measure
