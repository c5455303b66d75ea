#pragma once
#include <cstddef>
#include <vector>

namespace trestle::someip {

/// Memory for copies of messages that have to wait to be sent. What is given back is kept for the next ones,
/// up to a bound, so that the heap is not asked again for what is sent again and again. Nothing is zeroed.
class CopyPool {
 public:
  /// @param max_bytes  that are kept while nobody uses them.
  explicit CopyPool(std::size_t max_bytes) noexcept : max_bytes_{max_bytes} {}

  /// An empty vector with room for so many bytes, and for twice as many at most.
  [[nodiscard]] std::vector<std::byte> take(std::size_t bytes);
  /// Takes the memory back. What has not been used for the longest gives way to it.
  void give_back(std::vector<std::byte> used);

  [[nodiscard]] std::size_t kept_bytes() const noexcept { return kept_bytes_; }

 private:
  std::size_t max_bytes_;
  std::size_t kept_bytes_ = 0;
  std::vector<std::vector<std::byte>> unused_;  // the one last used is last
};

}  // namespace trestle::someip
