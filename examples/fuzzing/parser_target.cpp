// A libFuzzer target for a parser of your own, with Trestle's mutators: messages stay messages, so that the
// parser looks further than at the first length. docs/fuzzing.md
//
//   clang++ -std=c++20 -fsanitize=fuzzer,address parser_target.cpp your_parser.cpp $(pkg-config --cflags
//     --libs trestle-fuzz)
#include <cstddef>
#include <cstdint>

#include <trestle/fuzz/mutate/mutate.hpp>

/// Yours: whatever takes bytes from the network.
extern "C" void parse(const std::uint8_t* data, std::size_t size);

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  parse(data, size);
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  return trestle::fuzz::mutate_in_place(data, size, max_size, seed);
}
