#pragma once
#include <algorithm>
#include <array>

#include "sd/core/reboot_detector.hpp"
#include "someip/core/guards.hpp"

namespace trestle::sd {

/// FNV-1a over some bytes, begun with `seed`. Somebody who looks for two with the same hash can find them.
[[nodiscard]] constexpr std::uint32_t hash_of(std::uint32_t seed, ByteView bytes) noexcept {
  std::uint32_t hash = 0x811c9dc5U ^ seed;
  for (const std::byte byte : bytes) {
    hash = (hash ^ static_cast<std::uint32_t>(byte)) * 0x01000193U;
  }
  return hash;
}

/// The last messages of one peer, by a hash of what is in them: networks may bring a message twice, also
/// behind the one that was sent after it. That must not be taken for a sign of a reboot. Empty without
/// guards.
class RecentMessages {
 public:
  /// @param payload  of the SD message
  [[nodiscard]] static std::uint32_t hash(RebootDetector::Channel channel, SessionId session,
                                          ByteView payload) noexcept {
    const std::uint32_t hash =
        hash_of((static_cast<std::uint32_t>(channel) << 16U) ^ static_cast<std::uint32_t>(session), payload);
    return hash == 0 ? 1 : hash;
  }
  [[nodiscard]] bool has(std::uint32_t hash) const noexcept {
    return std::ranges::find(last_, hash) != last_.end();
  }
  /// In place of the oldest one.
  void add(std::uint32_t hash) noexcept {
    if constexpr (guards) {
      std::ranges::copy_backward(last_.begin(), last_.end() - 1, last_.end());
      last_.front() = hash;
    }
  }

 private:
  std::array<std::uint32_t, guards ? 4 : 0> last_{};  // 0: none
};

}  // namespace trestle::sd
