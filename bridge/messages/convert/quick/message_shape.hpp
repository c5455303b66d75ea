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
/// In a running bridge most of what a conversion needs has to come from memory, above all its own code,
/// because the messages carried meanwhile have gone through the caches. So the usual case is done here with
/// little code and few cache lines. Its front is not even copied: the numbers that differ are written into
/// the result of the message before. The operations do everything else.
class alignas(64) MessageShape {
 public:
  MessageShape() noexcept {}  // the arrays as they are

  [[nodiscard]] Shape& front() noexcept { return front_; }

  /// @param input   of CDR: the body.
  /// @param result  front, array and what is behind. Lives until the next one is converted or learnt.
  /// @return false: this is another one, and nothing was done.
  [[nodiscard]] bool convert(const Shape::Conversion& conversion, ByteView input, Gathered& result) noexcept;

  /// Remembers a message that the operations have converted, if it is one of this kind and front() fitted().
  /// @param input  what was read of it.
  /// @param made   of it.
  void learn(const Program& program, const Shape::Conversion& conversion, ByteView input,
             const Gathered& made) noexcept;

  /// Asks for the memory that a usual message needs, which so comes at once and not one after another.
  void fetch() const noexcept {
    __builtin_prefetch(this);
    __builtin_prefetch(&slices_);
    front_.fetch();
  }

 private:
  static constexpr std::size_t most_bytes_behind = 16;

  /// Between the front and the array there are padding, in CDR, and what counts the array's bytes.
  struct Places {
    std::size_t array;  ///< in the input
    std::size_t count;  ///< in the output, from the front's first byte on
  };
  [[nodiscard]] Places places() const noexcept;

  std::uint64_t key_ = 0;      ///< 0: nothing is remembered
  std::size_t array_op_ = 0;   ///< the array
  std::uint64_t most_ = 0;     ///< bytes that it may have
  std::endian count_order_{};  ///< in the input
  std::endian count_order_to_{};
  bool to_cdr_ = false;
  bool may_be_longer_ = false;  ///< the input, by anything
  std::uint8_t bytes_behind_ = 0;
  std::array<std::byte, most_bytes_behind> behind_;
  std::array<std::byte, most_bytes_behind> output_behind_;
  std::array<ByteView, 3> slices_;
  Shape front_;
};

}  // namespace trestle::messages::quick
