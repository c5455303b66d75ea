#pragma once
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

#include "dds_adapter/raw_type.hpp"

namespace trestle::dds::detail {

/// Sends the large samples of one writer, one at a time, for callers that must not wait as long as that
/// takes. A caller waits only until its sample has been copied into the memory of DDS, as it must be anyway:
/// nothing is queued here. The thread begins with the first sample.
class SendingThread final : private SliceLoan {
 public:
  /// Sends a sample, on the thread.
  using Send = std::function<void(RawSample&)>;

  explicit SendingThread(Send send) : send_{std::move(send)} {}
  SendingThread(const SendingThread&) = delete;
  SendingThread& operator=(const SendingThread&) = delete;
  ~SendingThread() { stop(); }
  /// Waits until the last sample has been sent. Nothing is given from now on.
  void stop();

  /// Waits until the sample before has been sent, and this one's slices have been copied.
  /// @throws std::system_error  the first time, if the system has no thread left.
  void give(const RawSample& sample);

  /// Nothing is being sent any more; false when time ran out.
  [[nodiscard]] bool wait_until_idle(std::chrono::nanoseconds limit) const;

 private:
  void run();
  void slices_copied() override;

  const Send send_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  RawSample sample_;
  bool is_busy_ = false;      ///< a sample is there, and has not been sent
  std::uint64_t given_ = 0;   ///< samples
  std::uint64_t copied_ = 0;  ///< ... whose slices are free again
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace trestle::dds::detail
