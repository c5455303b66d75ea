#pragma once
#include <cstddef>
#include <optional>

#include "someip/wire/tp.hpp"
#include "someip/wire/types.hpp"

namespace trestle::someip {

/// Segments that leave at once for a receiver of which nothing is known: a message of 64 KB and a little.
/// With what Linux gives a socket that nobody tuned, 208 KB, they fill half of it.
inline constexpr std::size_t default_burst = 48;

/// What follows leaves in pieces of so many segments, `default_pieces` in each separation: 153 MB/s. In
/// larger pieces the rest of that room would have to take more; and other stacks read some 160 MB/s.
inline constexpr std::size_t default_piece = 11;
inline constexpr std::size_t default_pieces = 5;

/// The fewest that leave at once for one that tells less: 5.6 KB.
inline constexpr std::size_t least_burst = 4;

/// The fewest that leave at once for a multicast group, where the smallest claim of a member counts: one that
/// tells of a byte must not have a message of 1 MB take a third of a second for all. Where a member takes
/// less, TpPacing::burst is to say so.
inline constexpr std::size_t least_burst_to_group = 32;

/// The most that leave at once for one that tells more: 5.7 MB in one burst (500 us) is faster than any
/// network.
inline constexpr std::size_t most_burst = 4096;

/// How many segments may leave at once for a receiver whose socket has room for so many bytes of datagrams
/// (what it asks for as SO_RCVBUF, and is granted); 0: it does not tell.
/// @return from `least` to most_burst; nothing, as for one that does not tell, if that is quicker and it has
///         as much room as is assumed then.
///
/// They fill a quarter of it: others may send there too, the burst before may not be read yet, and Linux
/// gives room back late. It charges 2304 bytes for a segment of 1392 that has not been joined to others, and
/// has twice the room that is asked for.
[[nodiscard]] std::optional<std::size_t> burst_into(std::size_t receive_buffer_bytes,
                                                    std::size_t least = least_burst) noexcept;

/// Of what burst_into() gives for two receivers, what suits both.
[[nodiscard]] std::optional<std::size_t> lesser_burst(const std::optional<std::size_t>& a,
                                                      const std::optional<std::size_t>& b) noexcept;

/// How the segments of large messages leave, not to overrun the receiver.  [feat_req_someiptp_801]
struct TpPacing {
  std::size_t segment_bytes = tp_default_segment_bytes;  ///< payload per segment; a multiple of 16
  /// Segments that leave at once for one receiver, at least 1; nothing: burst_into() of what it can take, or
  /// if it does not tell, default_burst and then pieces.
  std::optional<std::size_t> burst{};
  /// From one burst to the next, for one receiver; 0: there are no pauses, whatever the burst.
  Duration separation = std::chrono::microseconds{500};
  friend constexpr bool operator==(const TpPacing&, const TpPacing&) = default;
};

/// What has left for one receiver since the last burst began. Without a burst: what has left and is not made
/// up for yet, by the time of a piece each. Then a late timer costs nothing, as the next burst has more.
class PaceWindow {
 public:
  /// How many segments may leave now; none: ask again at resume().
  [[nodiscard]] std::size_t room(const TpPacing& pacing, TimePoint now) noexcept;
  /// So many have left.
  void sent(std::size_t segments) noexcept { sent_ += segments; }
  [[nodiscard]] TimePoint resume(const TpPacing& pacing) const noexcept;
  [[nodiscard]] TimePoint begin() const noexcept { return begin_; }

 private:
  TimePoint begin_{};
  std::size_t sent_ = 0;
  bool is_first_ = true;  // nothing of it is made up for yet
};

}  // namespace trestle::someip
