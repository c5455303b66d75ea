#pragma once
#include <array>
#include <memory>

#include "bridge/messages/convert/program/program.hpp"
#include "bridge/messages/convert/quick/loop_to_cdr.hpp"
#include "bridge/messages/convert/quick/loop_to_someip.hpp"
#include "bridge/messages/convert/quick/message_shape.hpp"
#include "bridge/messages/convert/quick/shape.hpp"

/// Quick ways to do what the operations of a program say. A converter does any message without them, by one
/// operation after another, and makes the same of it; what each way gains is in docs/conversion.md. All of
/// them look at the bytes first, and leave what does not fit, or is not good, to the operations, which then
/// say what is wrong.
///
/// 1. run(), a loop. Few numbers, few booleans, short texts and arrays of numbers go through a loop that
/// keeps
///    all it needs in registers. A message begins with it, and comes back to it behind each operation that is
///    none of these. Elements of an array that have nothing else go through it all at once.
///    When: wherever UTF-8 without padding is the rule; see choose().
/// 2. Shape. An element of an array that is the same as the one before, but for its numbers, is not converted
///    but compared, and what became of that one is copied, with the new numbers put in: markers, above all.
///    When: elements of three operations and more that are not all done by the loop.
/// 3. MessageShape. The same of a whole message around one large array of bytes, the front of which is not
/// even
///    copied: clouds, images and maps. It is little code on few lines of memory, as in a running bridge both
///    come from memory.
///    When: messages that have such an array, of which nothing but single bytes stands behind it.
namespace trestle::messages::quick {

/// Chooses what fits a program. Before that, and for tests also instead of it, all is done by operations.
void choose(Program& program);

/// What is remembered of the messages before, for one thread; Shapes come with the first one that needs them.
class Memory {
 public:
  static constexpr std::size_t slots =
      4;  ///< of each direction; the first one is that of the message's front

  [[nodiscard]] Shape& shape(bool to_cdr, std::size_t slot) {
    std::unique_ptr<Shape>& found = shapes_[(to_cdr ? slots : 0) + slot];
    if (found == nullptr) {
      found.reset(new Shape);  // not make_unique: that would touch all of it
    }
    return *found;
  }
  [[nodiscard]] MessageShape& message() noexcept { return message_; }
  [[nodiscard]] const MessageShape& message() const noexcept { return message_; }

 private:
  std::array<std::unique_ptr<Shape>, 2 * slots> shapes_;
  MessageShape message_;
};

}  // namespace trestle::messages::quick
