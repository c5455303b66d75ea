#pragma once
#include <bit>
#include <cstdint>
#include <cstring>
#include <vector>

#include "someip/wire/types.hpp"

namespace trestle::bridge {

/// What became of one array in the message before: what describes the points of a cloud or names the joints
/// of a robot is the same in all messages of a topic, and to compare it is much quicker than to convert it.
class Repetition {
 public:
  /// What the result depends on, beside the bytes.
  struct Conversion {
    std::uint64_t program = 0;  ///< its number
    bool to_cdr = false;
    std::endian order = std::endian::native;  ///< of the CDR
    std::size_t position = 0;                 ///< of the array in the CDR
    friend bool operator==(const Conversion& a, const Conversion& b) noexcept {
      constexpr std::size_t largest_alignment = 8;
      return a.program == b.program && a.to_cdr == b.to_cdr && a.order == b.order &&
             a.position % largest_alignment == b.position % largest_alignment;
    }
  };

  /// Whether `input` begins with the same array in the same place: then reads() bytes of it become written().
  [[nodiscard]] bool is(const Conversion& conversion, ByteView input) noexcept {
    const bool same = conversion_ == conversion && input.size() >= read_.size() &&
                      std::memcmp(input.data(), read_.data(), read_.size()) == 0;
    misses_ = same ? 0 : misses_;
    return same;
  }
  [[nodiscard]] std::size_t reads() const noexcept { return read_.size(); }
  [[nodiscard]] ByteView written() const noexcept { return written_; }

  /// For the next message. Does nothing for long arrays, and after some that were never the same.
  /// @param written  empty: it did not stay in one piece.
  void note(const Conversion& conversion, ByteView read, ByteView written) {
    if (read.size() > most_bytes || written.empty() || written.size() > most_bytes ||
        misses_ == most_misses) {
      return;
    }
    ++misses_;
    conversion_ = conversion;
    read_.reserve(most_bytes);
    written_.reserve(most_bytes);
    read_.assign(read.begin(), read.end());
    written_.assign(written.begin(), written.end());
  }

 private:
  static constexpr std::size_t most_bytes = 1024;
  static constexpr unsigned most_misses = 8;

  Conversion conversion_;  ///< of no program at first
  std::vector<std::byte> read_;
  std::vector<std::byte> written_;
  unsigned misses_ = 0;  ///< since an array was last the same
};

}  // namespace trestle::bridge
