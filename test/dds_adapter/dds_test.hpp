#pragma once
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "dds_adapter/participant.hpp"
#include "test/source_dir.hpp"

namespace trestle::test {

using namespace std::chrono_literals;

/// Far more than anything takes on a busy machine, also with a sanitizer: running into it is a failure.
inline constexpr auto patience = 100s;

/// A DDS domain that no other test program on this host uses at the same time.
class TestDomain {
 public:
  TestDomain() {
    constexpr std::uint32_t first = 20;
    constexpr std::uint32_t count = 80;  // above about 100 the ports are those that clients get
    for (std::uint32_t i = 0; i < count; ++i) {
      id_ = first + (static_cast<std::uint32_t>(getpid()) + i) % count;
      const std::string path = "/tmp/trestle-test-domain-" + std::to_string(id_);
      file_ = open(path.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0666);
      if (file_ >= 0 && flock(file_, LOCK_EX | LOCK_NB) == 0) {
        return;
      }
      close(file_);
    }
    throw std::runtime_error{"no DDS domain is free"};
  }
  ~TestDomain() { close(file_); }
  TestDomain(const TestDomain&) = delete;
  TestDomain& operator=(const TestDomain&) = delete;

  [[nodiscard]] std::uint32_t id() const { return id_; }

 private:
  std::uint32_t id_ = 0;
  int file_ = -1;
};

/// Values that callbacks put in and a test waits for.
template <typename T>
class Inbox {
 public:
  void put(T value) {
    {
      const std::lock_guard lock{mutex_};
      values_.push_back(std::move(value));
    }
    arrived_.notify_all();
  }
  /// Waits until `enough(values)`; false when it never was.
  template <typename Enough>
  bool wait(Enough enough) {
    std::unique_lock lock{mutex_};
    return arrived_.wait_for(lock, patience, [&] { return enough(std::as_const(values_)); });
  }
  bool wait_for_count(std::size_t count) {
    return wait([count](const auto& values) { return values.size() >= count; });
  }
  [[nodiscard]] std::size_t size() const {
    const std::lock_guard lock{mutex_};
    return values_.size();
  }
  [[nodiscard]] std::vector<T> take() {
    const std::lock_guard lock{mutex_};
    return std::exchange(values_, {});
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable arrived_;
  std::vector<T> values_;
};

/// Stops a reader in its first callback. One that does not return keeps its participant from acknowledging
/// anything.
class Stuck {
 public:
  /// In the callback: only the first call waits.
  void wait_once() {
    std::unique_lock lock{mutex_};
    if (std::exchange(came_, true)) {
      return;
    }
    is_stuck_ = true;
    changed_.notify_all();
    changed_.wait_for(lock, 2 * patience, [&] { return !is_stuck_; });  // so that a failed test can end
  }
  [[nodiscard]] bool wait_until_stuck(std::chrono::nanoseconds limit = patience) {
    std::unique_lock lock{mutex_};
    return changed_.wait_for(lock, limit, [&] { return is_stuck_; });
  }
  void free() {
    const std::lock_guard lock{mutex_};
    is_stuck_ = false;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool came_ = false;
  bool is_stuck_ = false;
};

/// Polls what has no callback.
template <typename Condition>
bool eventually(Condition condition) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) {
      return false;
    }
    usleep(1000);
  }
  return true;
}

/// A little-endian sample of `size` bytes, header included, whose contents depend on `seed`.
inline std::vector<std::byte> make_sample(std::size_t size, std::uint32_t seed) {
  std::vector<std::byte> sample(size);
  std::uint32_t state = seed * 2654435761U + 1;
  for (std::size_t i = 4; i < size; ++i) {
    state = state * 1664525U + 1013904223U;
    sample[i] = static_cast<std::byte>(state >> 24U);
  }
  sample[1] = std::byte{1};
  return sample;
}

inline std::vector<std::byte> copy(std::span<const std::byte> bytes) {
  return {bytes.begin(), bytes.end()};
}

class DdsTest : public testing::Test {
 protected:
  DdsTest() {
    // Until 2.x and from 3.0 on.
    for (const char* name : {"FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE"}) {
      setenv(name, (test::source_dir() + "/test/dds_adapter/no_intraprocess.xml").c_str(), 1);
    }
  }

  [[nodiscard]] dds::ParticipantConfig config(
      std::function<void(const dds::Happening&)> on_event = {}) const {
    dds::ParticipantConfig result;
    result.domain = domain_.id();
    result.interfaces = {"127.0.0.1"};
    result.on_event = std::move(on_event);
    return result;
  }

  TestDomain domain_;
};

}  // namespace trestle::test
