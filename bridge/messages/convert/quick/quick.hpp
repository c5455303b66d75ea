// bridge/messages/convert/quick: quick ways to convert what is usual.
//
//   quick.hpp            start here: which ways there are, and which of them fits a program
//   loop.hpp             few numbers, short texts and small arrays, in one loop
//   loop_to_cdr.hpp      single steps of the loop from SOME/IP to CDR
//   loop_to_someip.hpp   single steps of the loop from CDR to SOME/IP
//   shape.hpp            an element or front that equals the one before, but for numbers
//   message_shape.hpp    the same for a whole message around one large array of bytes
//   few_bytes.hpp        copies few bytes
#pragma once
#include <array>
#include <memory>

#include "bridge/messages/convert/program/program.hpp"
#include "bridge/messages/convert/quick/loop_to_cdr.hpp"
#include "bridge/messages/convert/quick/loop_to_someip.hpp"
#include "bridge/messages/convert/quick/message_shape.hpp"
#include "bridge/messages/convert/quick/shape.hpp"

/// Quick ways to do what the operations of a program say. Without them a converter executes one operation
/// after another, and makes the same bytes; docs/conversion.md says what each way gains. All of them check
/// the bytes first, and leave anything unusual or wrong to the operations, which then report the fault.
///
/// 1. run(), a loop. Few numbers, few booleans, short texts and arrays of numbers go through a loop that has
///    all its variables in registers. A message begins with it, and returns to it behind each operation of
///    another kind. Elements of an array that consist of nothing else go through it all at once.
///    When: wherever strings are UTF-8 without padding; see choose().
/// 2. Shape. An element of an array that equals the one before, except for its numbers, is not converted but
///    compared, and the result of that one is copied, with the new numbers filled in: above all markers. So
///    is the front of a message that equals the message before. When: elements and fronts of three operations
///    and more that the loop does not do almost alone.
/// 3. MessageShape. The same for a whole message around one large array of bytes, whose front is not even
///    copied: clouds, images and maps. It is little code on few lines of memory, because in a running bridge
///    both come from memory.
///    When: messages with such an array, behind which there are only single bytes.
namespace trestle::messages::quick {

/// Chooses what fits a program. Before that, and for tests also instead of it, all is done by operations.
void choose(Program& program);

/// What is remembered of the messages before, for one thread. Each comes with the first message that needs
/// it.
class Memory {
 public:
  static constexpr std::size_t slots = 4;  ///< of shapes; the first one is that of the message's front

  [[nodiscard]] Shape& shape(bool to_cdr, std::size_t slot) {
    return slot == 0 ? there(messages_[to_cdr ? 1 : 0]).front()
                     : there(shapes_[slot - 1 + (to_cdr ? slots : 0)]);
  }

  /// As those of MessageShape.
  [[nodiscard]] bool convert(const Shape::Conversion& conversion, ByteView input, Gathered& result) noexcept {
    MessageShape* const message = messages_[conversion.to_cdr ? 1 : 0].get();
    return message != nullptr && message->convert(conversion, input, result);
  }
  void learn(const Program& program, const Shape::Conversion& conversion, ByteView input,
             const Gathered& made) {
    there(messages_[conversion.to_cdr ? 1 : 0]).learn(program, conversion, input, made);
  }
  void fetch() const noexcept {
    for (const auto& message : messages_) {
      if (message != nullptr) {
        message->fetch();
      }
    }
  }

 private:
  template <typename Remembered>
  static Remembered& there(std::unique_ptr<Remembered>& place) {
    if (place == nullptr) {
      place.reset(new Remembered);  // not make_unique: that would touch all of it
    }
    return *place;
  }

  std::array<std::unique_ptr<MessageShape>, 2> messages_;  ///< of each direction
  std::array<std::unique_ptr<Shape>, 2 * slots> shapes_;
};

}  // namespace trestle::messages::quick
