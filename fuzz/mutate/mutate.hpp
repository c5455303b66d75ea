// fuzz/mutate: makes and changes SOME/IP messages for fuzzers. It knows the layout of a message and nothing
// of our stack, so that it serves parsers and devices of others, too.
//
//   mutate.hpp    changes a message by one thing: for libFuzzer, AFL++ and `trestle fuzz`
//   generate.hpp  makes whole messages: requests, events, service discovery, segments
//   typed.hpp     makes and changes payloads whose types are known
//   value_tree.hpp  a payload taken apart into its values
//   random.hpp    numbers that a seed decides
//
// docs/fuzzing.md shows how to link it with a parser, a stack or the code of an ECU.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fuzz/mutate/random.hpp"

namespace trestle::fuzz {

/// A message, or what is left of one.
using Bytes = std::vector<std::byte>;

/// Changes one thing in `message`: a header field, a length, an entry or an option of service discovery, the
/// header of a segment, bytes of the payload, or where the message ends. Any bytes will do, also none. In
/// most cases the lengths are right afterwards, so that a parser looks further than at the first of them.
/// @param max_size  `message` is not longer than this afterwards, in bytes.
void mutate(Bytes& message, std::size_t max_size, Random& random);

/// Joins the beginning of one message and the end of another. Of two messages of service discovery: entries
/// and options of both.
/// @return the new message, at most `max_size` bytes.
[[nodiscard]] Bytes cross_over(std::span<const std::byte> one, std::span<const std::byte> other,
                               std::size_t max_size, Random& random);

/// Sets the Length field of a SOME/IP message to what is there, and likewise the lengths of the entries and
/// options arrays in a message of service discovery. Less than 16 bytes stay as they are.
void repair_lengths(Bytes& message);

/// As mutate(), in the place that libFuzzer and AFL++ give:
/// `size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size, unsigned seed)`.
/// @param data      `max_size` bytes, of which the first `size` are the message.
/// @return the new size.
std::size_t mutate_in_place(std::uint8_t* data, std::size_t size, std::size_t max_size, std::uint64_t seed);

}  // namespace trestle::fuzz
