#pragma once
#include "sd/wire/message.hpp"

namespace trestle::sd {

/// Writes one SD message, a whole datagram. An entry that does not fit starts the next datagram.
///
///     SdWriter writer{room};
///     while (more && writer.add(entry, options)) { ... }
///     const ByteView datagram = writer.finish(flags, session);
class SdWriter {
 public:
  /// The smallest buffer that an SdWriter works with: SOME/IP header, SD header and two empty arrays.
  static constexpr std::size_t min_room_bytes = someip::header_bytes + 12;

  /// @param room  at least `min_room_bytes`; its size bounds the datagram. Must outlive the writer.
  explicit SdWriter(ByteSpan room) noexcept;

  /// Adds an entry that references `options` (30 at most), after those that are there. Options that are there
  /// already are shared [feat_req_someipsd_900], empty runs get index 0 [feat_req_someipsd_348].
  /// @return false when it does not fit: the message is as it was.
  [[nodiscard]] bool add(const Entry& entry, std::span<const Option> options) noexcept;

  /// Adds an option that no entry references, such as an SD endpoint option, which has to be the first of its
  /// message: call this before add().  [feat_req_someipsd_1151] [feat_req_someipsd_1114]
  /// @return false when it does not fit.
  [[nodiscard]] bool add_unreferenced(const Option& option) noexcept;

  /// Whether `entries` more entries fit that add `option_bytes` of options together.
  [[nodiscard]] bool fits(std::size_t entries, std::size_t option_bytes) const noexcept {
    return entries_end() + entries * entry_bytes + 4 + options_bytes_ + option_bytes <= room_.size();
  }

  [[nodiscard]] std::size_t entry_count() const noexcept { return entry_count_; }

  /// Completes headers and lengths.
  /// @return the whole SOME/IP message, at the front of the buffer.
  [[nodiscard]] ByteView finish(std::uint8_t flags, SessionId session, someip::ClientId client = {}) noexcept;

 private:
  struct Place {
    std::size_t index = 0;   // of the run's first option in the array
    std::size_t shared = 0;  // how many of its options, from the first, are there already
  };

  [[nodiscard]] std::size_t entries_end() const noexcept;
  [[nodiscard]] ByteView options() const noexcept;
  [[nodiscard]] Place locate(std::span<const Option> run, bool may_continue_the_end) const noexcept;
  void append(std::span<const Option> run) noexcept;

  ByteSpan room_;
  std::size_t entry_count_ = 0;
  std::size_t option_count_ = 0;
  std::size_t options_bytes_ = 0;
};

}  // namespace trestle::sd
