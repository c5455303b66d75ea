#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "bridge/messages/convert/program/gathered.hpp"
#include "bridge/messages/convert/program/program.hpp"
#include "bridge/messages/convert/quick/shape.hpp"
#include "someip/wire/types.hpp"

namespace trestle::messages::quick {

/// What became of a whole message: of its front, which is a Shape, of one array of bytes, which stays as it
/// is, and of few bytes behind it. So are clouds, images and maps.
///
/// In a running bridge most of what a conversion looks at comes from memory, its own code above all, as what
/// was carried meanwhile has gone through the caches. So the usual case is done here in little code and with
/// few lines of memory, and its front is not even copied: the numbers that differ are put into what the one
/// before became. All else is left to the operations.
class alignas(64) MessageShape {
 public:
  MessageShape() noexcept {}                // the arrays as they are: no page is touched early
  MessageShape(MessageShape&&) noexcept {}  // which forgets
  MessageShape& operator=(MessageShape&&) noexcept {
    key_ = 0;
    return *this;
  }
  ~MessageShape() = default;

  /// Asks for the memory that a usual message needs, which so comes at once and not one after another.
  void fetch() const noexcept {
    constexpr std::size_t line = 64;
    constexpr std::size_t usual_bytes = 256;
    const auto ask = [](const void* from, std::size_t bytes) {
      const auto* const at = static_cast<const std::byte*>(from);
      for (std::size_t i = 0; i < bytes; i += line) {
        __builtin_prefetch(at + i);
      }
    };
    ask(this, offsetof(MessageShape, output_) + usual_bytes);
    ask(front_.data(), 2 * usual_bytes);
  }

  /// @param input   of CDR: the body.
  /// @param result  front, array and what is behind. Lives until the next one is converted or learnt.
  /// @return false: this is another one, and nothing was done.
  [[nodiscard]] bool convert(const Shape::Conversion& conversion, ByteView input, Gathered& result) noexcept;

  /// Remembers a message that the operations have converted, if it is one of this kind.
  /// @param front  of a message of this program, direction and order; of this one if it fitted().
  /// @param input  what was read of it.
  /// @param made   of it.
  void learn(const Program& program, const Shape& front, const Shape::Conversion& conversion, ByteView input,
             const Gathered& made) noexcept;

 private:
  /// Of the front, on either side.
  static constexpr std::size_t most_bytes = 512;
  static constexpr std::size_t most_bytes_behind = 16;
  static constexpr std::size_t most_numbers = 16;
  /// Before and behind the front in the output: an encapsulation header; padding and a count.
  static constexpr std::size_t room_in_front = 4;
  static constexpr std::size_t room_behind = 8;

  /// One that is put in.
  struct Number {
    std::uint16_t from;
    std::uint16_t to;
    std::uint8_t shift;  ///< bits that it has less than 64
    bool swap;
  };
  /// Bytes that are compared at once.
  static constexpr std::size_t block_bytes = 16;
  static_assert(Shape::least_bytes >= block_bytes);
  struct Block {
    std::array<std::byte, block_bytes> bytes;
    std::array<std::byte, block_bytes> compared;
  };

  [[nodiscard]] static std::uint64_t key(const Shape::Conversion& conversion) noexcept {
    return conversion.program << 2U | (conversion.to_cdr ? 2U : 0U) |
           (conversion.order == std::endian::big ? 1U : 0U);
  }
  [[nodiscard]] bool is_front(const std::byte* input) const noexcept;
  void put_numbers(const std::byte* input) noexcept;
  [[nodiscard]] bool learn_numbers(std::span<const Shape::Place> places) noexcept;
  void learn_front(const Shape& front) noexcept;

  std::uint64_t key_ = 0;       ///< 0: nothing is remembered
  std::uint32_t reads_ = 0;     ///< bytes of the front
  std::uint32_t array_at_ = 0;  ///< behind the front, and behind what counts its bytes
  std::uint32_t most_ = 0;      ///< bytes of the array
  std::uint16_t count_to_ = 0;  ///< where the count stands in output_
  std::uint8_t numbers_ = 0;
  std::uint8_t reads_behind_ = 0;  ///< bytes behind the array
  std::uint8_t writes_behind_ = 0;
  std::endian count_order_{};
  std::endian count_order_to_{};
  bool to_cdr_ = false;
  bool may_be_longer_ = false;  ///< the input, by anything
  std::array<ByteView, 3> slices_;
  std::array<std::byte, most_bytes_behind> behind_;
  std::array<std::byte, most_bytes_behind> output_behind_;
  std::array<Number, most_numbers> number_;
  std::array<std::byte, room_in_front + most_bytes + room_behind> output_;
  std::array<Block, most_bytes / block_bytes> front_;
};

}  // namespace trestle::messages::quick
