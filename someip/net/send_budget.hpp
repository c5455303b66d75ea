#pragma once
#include <algorithm>
#include <cstddef>
#include <memory>
#include <utility>

namespace trestle::someip {

/// How much may wait to be sent over all connections of one owner together. When it is used up, a connection
/// whose peer reads too slowly gets only its share; one for which nothing waits can always send.
class SendBudget {
 public:
  explicit SendBudget(std::size_t max_bytes) noexcept : max_bytes_{max_bytes} {}

  /// Whether `more` bytes may wait for a connection for which `waiting` bytes wait now.
  [[nodiscard]] bool admits(std::size_t waiting, std::size_t more) const noexcept {
    return waiting == 0 || used_bytes_ + more <= max_bytes_ ||
           waiting + more <= max_bytes_ / std::max<std::size_t>(users_, 1);
  }
  [[nodiscard]] std::size_t used_bytes() const noexcept { return used_bytes_; }

 private:
  friend class QueuedBytes;
  std::size_t max_bytes_;
  std::size_t used_bytes_ = 0;
  std::size_t users_ = 0;  ///< connections for which something waits
};

/// The bytes that wait for one connection, which count for the budget, too.
class QueuedBytes {
 public:
  /// @param budget  none: there is no bound.
  explicit QueuedBytes(std::shared_ptr<SendBudget> budget) noexcept : budget_{std::move(budget)} {}
  ~QueuedBytes() { set(0); }
  QueuedBytes(const QueuedBytes&) = delete;
  QueuedBytes& operator=(const QueuedBytes&) = delete;

  [[nodiscard]] std::size_t count() const noexcept { return bytes_; }
  [[nodiscard]] bool admits(std::size_t more) const noexcept {
    return !budget_ || budget_->admits(bytes_, more);
  }
  void add(std::size_t bytes) noexcept { set(bytes_ + bytes); }
  void remove(std::size_t bytes) noexcept { set(bytes_ - bytes); }
  void clear() noexcept { set(0); }

 private:
  void set(std::size_t bytes) noexcept {
    if (budget_) {
      budget_->used_bytes_ = budget_->used_bytes_ - bytes_ + bytes;
      budget_->users_ = budget_->users_ - (bytes_ != 0 ? 1U : 0U) + (bytes != 0 ? 1U : 0U);
    }
    bytes_ = bytes;
  }

  std::shared_ptr<SendBudget> budget_;
  std::size_t bytes_ = 0;
};

}  // namespace trestle::someip
