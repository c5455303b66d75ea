#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

namespace trestle::carry {

/// The messages of the last second that a route has carried, and who sent each first. It grows with them, up
/// to some thousand; beyond that it keeps those that it has, as a ring brings them again.
class RecentMessages {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  static constexpr std::chrono::microseconds memory = std::chrono::seconds{1};
  static constexpr std::size_t least = 256;  ///< messages there is room for, 16 bytes each
  static constexpr std::size_t most = 8192;

  struct Before {
    bool same_sender = false;         ///< as the first time. Not where it has no name.
    std::chrono::microseconds ago{};  ///< since the last time
    std::uint32_t* mark = nullptr;  ///< of its place: the caller's, 0 for a new message. Until the next call.
  };

  RecentMessages();

  /// Notes a message.
  /// @param hash  names it; one in a million is taken for another.
  /// @param from  names its sender, if that is known.
  /// @return how it came before; nothing: not within the last second, or it was forgotten.
  std::optional<Before> note(std::uint64_t hash, std::optional<std::uint64_t> from, TimePoint now) noexcept;
  /// Whether it came within the last second.
  [[nodiscard]] bool has(std::uint64_t hash, TimePoint now) const noexcept;
  [[nodiscard]] std::size_t room() const noexcept { return room_; }

 private:
  struct Place {
    std::uint32_t message = 0;  ///< 0: free
    std::uint32_t first_from = 0;
    std::uint32_t last_us = 0;
    std::uint32_t mark = 0;
  };
  static constexpr std::size_t ways = 4;  ///< places in which a message can be

  [[nodiscard]] Place* places_of(std::uint32_t message) const noexcept;
  /// The place where it stands, from the last second; nullptr: nowhere.
  [[nodiscard]] Place* find(std::uint32_t message, std::uint32_t now_us) const noexcept;
  /// The place that it takes; nullptr: all are of the last second.
  [[nodiscard]] Place* free_place(std::uint32_t message, std::uint32_t now_us) const noexcept;
  [[nodiscard]] bool grow(std::uint32_t now_us) noexcept;

  std::size_t room_ = least;
  std::unique_ptr<Place[]> places_;
  std::uint32_t turned_away_ = 0;
};

}  // namespace trestle::carry
