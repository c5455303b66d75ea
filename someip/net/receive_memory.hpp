#pragma once
#include <chrono>
#include <functional>
#include <memory>
#include <vector>

#include "someip/wire/bytes.hpp"

namespace trestle::someip {

class ReceiveMemory;

/// What one owner's connections may take together for messages in pieces, beyond what each begins with.
class ReceiveBudget {
 public:
  explicit ReceiveBudget(std::size_t max_bytes) noexcept : max_bytes_{max_bytes} {}

  [[nodiscard]] std::size_t used_bytes() const noexcept { return used_bytes_; }

 private:
  friend class ReceiveMemory;
  /// Makes room for `bytes`: takes what nobody uses, then has connections end that hold the most for the
  /// longest time. False when that is the one which asks, or there is no more to be had.
  [[nodiscard]] bool make_room(std::size_t bytes, ReceiveMemory& asks);

  std::size_t max_bytes_;
  std::size_t used_bytes_ = 0;
  std::vector<ReceiveMemory*> users_;
};

/// Where a connection puts its messages together: it grows with what has come, without moving what is there,
/// and is kept for the next message until others need it.
class ReceiveMemory {
 public:
  /// What a connection does with it now.
  struct Use {
    bool may_be_taken = false;  ///< not while its message is being handed out
    std::size_t held_bytes = 0;
    std::chrono::steady_clock::duration held_for{};
  };

  /// @param first_bytes  that it has at once, and keeps.
  /// @param use          asked when memory is short.
  /// @param taken        told that the memory is gone, as it held too much for too long; must not call back.
  /// @param moved        told of a new place of the memory.
  /// @throws std::bad_alloc
  ReceiveMemory(std::shared_ptr<ReceiveBudget> budget, std::size_t first_bytes, std::function<Use()> use,
                std::function<void()> taken, std::function<void(ByteSpan)> moved);
  ~ReceiveMemory();
  ReceiveMemory(const ReceiveMemory&) = delete;
  ReceiveMemory& operator=(const ReceiveMemory&) = delete;

  [[nodiscard]] ByteSpan bytes() const noexcept { return {place_, bytes_}; }
  /// Makes it at least so large. False when neither the budget nor the system has that much.
  [[nodiscard]] bool grow(std::size_t bytes);

 private:
  friend class ReceiveBudget;
  [[nodiscard]] bool resize(std::size_t bytes) noexcept;
  [[nodiscard]] std::size_t extra() const noexcept { return bytes_ - first_bytes_; }
  void give_back();

  std::shared_ptr<ReceiveBudget> budget_;
  std::size_t first_bytes_;
  std::function<Use()> use_;
  std::function<void()> taken_;
  std::function<void(ByteSpan)> moved_;
  std::byte* place_ = nullptr;
  std::size_t bytes_ = 0;
};

}  // namespace trestle::someip
