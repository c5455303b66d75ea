#pragma once
#include <algorithm>

#include "bridge/messages/convert/program/program.hpp"
#include "bridge/messages/convert/program/wire_forms.hpp"
#include "bridge/messages/convert/quick/conversion_scratch.hpp"

namespace trestle::messages {

/// How far the conversion of a message has come.
struct Progress {
  std::size_t op = 0;  ///< the next one
  std::size_t at = 0;  ///< in the input
};

/// Runs the operations from `i` on, up to `end`, and tells `shape` what they do.
/// @param i  on return, the first operation that is no part of the shape and has not run.
/// @return false: one of them failed.
template <typename Converter>
__attribute__((noinline, cold)) bool record(Converter& converter, Shape& shape, std::size_t& i,
                                            std::size_t end) {
  ConversionScratch& out = converter.out();
  const ByteView input = converter.rest();
  const std::size_t copied = out.copied();
  const std::size_t position = out.position();
  shape.begin(converter.conversion(), i, converter.at(), copied);
  converter.recording(&shape);
  while (i < end && converter.program().ops[i].repeats) {
    const std::size_t next = std::max<std::size_t>(i + 1, converter.program().ops[i].end);
    if (!converter.block(i, next)) {
      return false;
    }
    i = next;
    const bool is_referenced = out.position() - position != out.copied() - copied;
    if (converter.recording() == nullptr || is_referenced ||
        !shape.keep(i, converter.at(), out.copied() - copied)) {
      break;
    }
  }
  converter.recording(nullptr);
  shape.finish(input.data(), out.place(copied));
  return true;
}

/// Runs the operations of a message, or of an element of an array. If what they did for the one before is
/// remembered, and fits the front of this one, it is taken instead.
/// @param slot  of the shape, in the scratch.
template <typename Converter>
bool convert_stretch(Converter& converter, std::size_t slot, std::size_t begin, std::size_t end) {
  std::size_t i = begin;
  if (converter.recording() == nullptr) {
    ConversionScratch& out = converter.out();
    Shape& shape = out.shape(slot);
    const ByteView rest = converter.rest();
    if (shape.is(converter.conversion(), rest)) {
      shape.write(rest.data(), out.room(shape.writes()));
      converter.skip(shape.reads());
      i = shape.end();
    } else if (shape.is_due() && !record(converter, shape, i, end)) {
      return false;
    }
  }
  return i == end || converter.block(i, end);
}

/// Begins a message that has little else than arrays of numbers, and mostly ends it. All that others need for
/// it would take as long again.
/// @param quick  (times, at): a quick loop with arrays over all operations.
/// @return how far it came, in the scratch, too.
template <typename Quick>
Progress begin_quickly(const Program& program, ByteView input, ConversionScratch& out, const Quick& quick) {
  // Elements of another array in front would end it at once.
  const bool is_to_no_avail = program.ops[0].kind == Op::Kind::sequence && input.size() >= 4 &&
                              load_u32(input.data(), std::endian::native) != 0;
  if (program.numbers_at == Program::no_op || is_to_no_avail) {
    return {};
  }
  const std::size_t before = out.copied();
  std::uint64_t once = 1;
  std::size_t at = 0;
  const std::size_t op = quick(once, at);
  if (op < program.numbers_at && program.has_shape) {
    // It is little, and may be known from the message before.
    out.give_back(out.copied() - before);
    return {};
  }
  return {op, at};
}

/// Converts elements, if they are nothing but quick operations, and as long as they are.
/// @param op     which they are the body of.
/// @param begin  of the body.
/// @param most   elements.
/// @param done   on return, so many more.
/// @return false: an element failed, which is none of them.
template <typename Converter>
bool convert_quick(Converter& converter, const Op& op, std::size_t begin, std::uint64_t most,
                   std::uint64_t& done) {
  if (!op.is_quick || most == 0 || converter.recording() != nullptr) {
    return true;
  }
  std::uint64_t left = most;
  const std::size_t next = converter.quick(begin, op.end, left);
  const bool is_within = left != 0 && next != begin;
  const bool good = !is_within || converter.block(next, op.end);
  done += most - left + (is_within && good ? 1 : 0);
  return good;
}

/// Converts `count` elements, whose shape is in the slot of their operation if they have one.
/// @param done  on return, so many more.
/// @return false: the element after those failed.
template <typename Converter>
bool convert_elements(Converter& converter, const Op& op, std::size_t begin, std::uint64_t count,
                      std::uint64_t& done) {
  for (;; ++done) {
    if (!convert_quick(converter, op, begin, count - done, done)) {
      return false;
    }
    if (done == count) {
      return true;
    }
    if (!(op.slot != 0 ? convert_stretch(converter, op.slot, begin, op.end)
                       : converter.block(begin, op.end))) {
      return false;
    }
  }
}

}  // namespace trestle::messages
