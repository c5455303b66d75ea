#include "dds_adapter/sending_thread.hpp"

namespace trestle::dds::detail {

void SendingThread::stop() {
  {
    const std::lock_guard lock{mutex_};
    stopping_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) {
    thread_.join();
  }
}

void SendingThread::give(const RawSample& sample) {
  std::unique_lock lock{mutex_};
  if (!thread_.joinable()) {
    thread_ = std::thread{[this] { run(); }};
  }
  changed_.wait(lock, [&] { return !is_busy_; });
  is_busy_ = true;
  sample_ = sample;
  sample_.loan = this;
  const std::uint64_t number = ++given_;
  changed_.notify_all();
  changed_.wait(lock, [&] { return copied_ >= number; });
}

bool SendingThread::wait_until_idle(std::chrono::nanoseconds limit) const {
  std::unique_lock lock{mutex_};
  return changed_.wait_for(lock, limit, [&] { return !is_busy_; });
}

void SendingThread::run() {
  std::unique_lock lock{mutex_};
  while (true) {
    changed_.wait(lock, [&] { return stopping_ || is_busy_; });
    if (!is_busy_) {
      return;
    }
    lock.unlock();
    send_(sample_);
    lock.lock();
    copied_ = given_;  // also when DDS refused it without a copy
    is_busy_ = false;
    changed_.notify_all();
  }
}

void SendingThread::slices_copied() {
  {
    const std::lock_guard lock{mutex_};
    copied_ = given_;
  }
  changed_.notify_all();
}

}  // namespace trestle::dds::detail
