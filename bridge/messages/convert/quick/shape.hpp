#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "someip/wire/types.hpp"

namespace trestle::messages::quick {

/// What became of a stretch of operations: the front of a message or of an element of an array. Mostly the
/// next one differs from it in nothing but numbers, and to compare is much quicker than to convert.
///
/// A shape has the bytes of both sides, and where the numbers stand in them. If another stretch has the same
/// bytes, but for numbers, the same is made of it, with those numbers put in. All that a converter looks at
/// (texts, counts, lengths, booleans) is among the bytes that are the same, so what was good is good again.
/// What does not fit is left to the operations, whose doing is recorded from time to time:
///
///     if (shape.is(conversion, input))      shape.write(input, room for writes() bytes), go on at end()
///     else if (shape.is_due())              begin(), run the operations and tell of what they do, finish()
///     else                                  run the operations
///
/// Numbers are compared, too, until they differ for the first time: to put them in takes longer.
class Shape {
 public:
  /// Numbers that are put in.
  struct Place {
    std::uint16_t from;
    std::uint16_t to;
    std::uint16_t bytes;
    std::uint8_t width;
    bool swap;
  };

  /// What the result depends on, beside the bytes.
  struct Conversion {
    std::uint64_t program = 0;  ///< its number
    bool to_cdr = false;
    std::endian order = std::endian::native;  ///< of the CDR
    std::size_t position = 0;                 ///< of the stretch in the CDR
  };

  /// Shorter stretches are not worth it.
  static constexpr std::size_t least_bytes = 32;
  static constexpr std::size_t least_operations = 3;
  /// On either side.
  static constexpr std::size_t most_bytes = 1024;

  Shape() = default;  // the arrays as they are: no page is touched early
  Shape(const Shape&) = delete;
  Shape& operator=(const Shape&) = delete;

  /// Whether `input` begins with this shape. Not looked at where it has long been another one.
  [[nodiscard]] bool is(const Conversion& conversion, ByteView input) noexcept {
    if (++misses_ > most_tries) {
      return false;
    }
    return fits(conversion, input);
  }
  [[nodiscard]] std::size_t reads() const noexcept { return reads_; }
  [[nodiscard]] std::size_t writes() const noexcept { return writes_; }
  /// The first operation behind the stretch.
  [[nodiscard]] std::size_t end() const noexcept { return end_; }
  /// @param input  which is() was true of.
  void write(const std::byte* input, std::byte* to) const noexcept;

  // For a message as a whole: without a copy, and without account of how often it was another one.

  /// What stands before the front of a message, an encapsulation header, and behind it: padding and a count.
  static constexpr std::size_t room_in_front = 4;
  static constexpr std::size_t room_behind = 8;

  [[nodiscard]] static std::uint64_t key(const Conversion& conversion) noexcept {
    return conversion.program << 2U | (conversion.to_cdr ? 2U : 0U) |
           (conversion.order == std::endian::big ? 1U : 0U);
  }
  /// As is().
  [[nodiscard]] bool fits(const Conversion& conversion, ByteView input) noexcept;
  /// Whether the last stretch had this shape, or it was recorded of that one.
  [[nodiscard]] bool fitted() const noexcept { return key_ != 0 && misses_ == 0; }
  /// As write(), into memory of its own. There is a header in the room in front, and zeros in that behind.
  [[nodiscard]] std::byte* write_here(const std::byte* input) noexcept {
    put_numbers(input, &output_[room_in_front]);
    return &output_[room_in_front];
  }
  /// Asks for the memory that a usual one needs.
  void fetch() const noexcept;

  /// Whether to record now. Where nothing repeats that is ever more seldom.
  [[nodiscard]] bool is_due() const noexcept { return misses_ >= patience_; }

  // Recording. Places count from anywhere, as long as it is the same: in the whole input, in the scratch.

  /// Forgets the shape.
  /// @param operation  the first one.
  void begin(const Conversion& conversion, std::size_t operation, std::size_t input_at,
             std::size_t output_at) noexcept;
  /// Numbers that were moved.  @return false: too much, stop.
  [[nodiscard]] bool numbers(std::size_t input_at, std::size_t output_at, std::size_t count,
                             std::size_t width, bool swap) noexcept;
  /// Input that nobody looks at.
  void padding(std::size_t from, std::size_t to) noexcept;
  /// Whether the stretch may reach as far as that.
  [[nodiscard]] bool has_room_to(std::size_t input_at) const noexcept {
    return input_at - input_begin_ <= most_bytes;
  }
  /// All operations before `operation` belong to the stretch.
  /// @param written  bytes of the output, since begin().
  /// @return false: too much, stop.
  [[nodiscard]] bool keep(std::size_t operation, std::size_t input_at, std::size_t written) noexcept;
  /// @param input, output  since begin(); at least what was kept.
  void finish(const std::byte* input, const std::byte* output) noexcept;

 private:
  static constexpr std::size_t most_places = 64;
  /// Longer runs of numbers are quicker by themselves.
  static constexpr std::size_t most_number_bytes = 256;
  static constexpr unsigned most_tries = 8;
  static constexpr unsigned most_patience = 1024;

  void set_loose(const std::byte* input) noexcept;
  void put_numbers(const std::byte* input, std::byte* to) const noexcept;

  std::uint64_t key_ = 0;  ///< 0: nothing is remembered
  std::size_t end_ = 0;
  std::uint32_t reads_ = 0;
  std::uint32_t writes_ = 0;
  std::uint32_t position_ = 0;   ///< the lowest bits count
  std::uint32_t alignment_ = 4;  ///< on which the result depends
  std::uint32_t loose_ = 0;      ///< places at the front that are put in; the others are compared
  std::uint32_t places_ = 0;
  unsigned misses_ = 0;    ///< since it began, or fitted
  unsigned patience_ = 2;  ///< misses until it is recorded anew: from the second message on

  // While recording.
  std::uint64_t next_key_ = 0;
  std::size_t first_ = 0;
  std::size_t input_begin_ = 0;
  std::size_t output_begin_ = 0;
  std::uint32_t noted_ = 0;  ///< places, of which places_ are kept

  std::array<Place, most_places> place_;
  std::array<std::byte, room_in_front + most_bytes + room_behind> output_;
  std::array<std::byte, most_bytes> input_;
  std::array<std::byte, most_bytes> compared_;  ///< all bits of each byte of the input that is, or none
  std::array<std::byte, most_bytes> fixed_;     ///< likewise, of each that is no number
};

}  // namespace trestle::messages::quick
