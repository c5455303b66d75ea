#pragma once
#include <chrono>
#include <cstddef>
#include <memory>
#include <vector>

#include "someip/wire/types.hpp"

namespace boost::asio {
class io_context;
}

namespace trestle::someip {

/// Memory for copies of messages that have to wait to be sent. What is given back is kept for the next ones,
/// up to a bound, so that the heap is not asked again for what is sent again and again. Nothing is zeroed.
/// What nobody has used for a second or two goes back to the heap: a burst leaves nothing behind.
class CopyPool {
 public:
  static constexpr Duration quiet_after = std::chrono::seconds{1};

  /// Without a timer: drop_unused() is to be called.
  /// @param max_bytes  that are kept while nobody uses them.
  explicit CopyPool(std::size_t max_bytes) noexcept : max_bytes_{max_bytes} {}
  /// @param quiet  from one look at what was not used to the next, while something is kept.
  CopyPool(std::size_t max_bytes, boost::asio::io_context& io, Duration quiet = quiet_after);
  ~CopyPool();
  CopyPool(const CopyPool&) = delete;
  CopyPool& operator=(const CopyPool&) = delete;

  /// An empty vector with room for so many bytes, and for twice as many at most.
  [[nodiscard]] std::vector<std::byte> take(std::size_t bytes);
  /// Takes the memory back. What has not been used for the longest gives way to it.
  void give_back(std::vector<std::byte> used);

  /// Frees what nobody has used since the last call.
  void drop_unused();

  [[nodiscard]] std::size_t kept_bytes() const noexcept { return kept_bytes_; }

 private:
  struct Unused {
    std::vector<std::byte> memory;
    bool is_old = false;  ///< it was there at the last drop_unused()
  };
  void drop(std::size_t count);
  void wait_for_quiet();

  std::size_t max_bytes_;
  std::size_t kept_bytes_ = 0;
  std::vector<Unused> unused_;  // the one last used is last
  struct Clock;
  std::shared_ptr<Clock> clock_{};  // its handler keeps it, too
};

}  // namespace trestle::someip
