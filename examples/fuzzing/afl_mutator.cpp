// Trestle's mutators as a library for AFL++:
//   AFL_CUSTOM_MUTATOR_LIBRARY=./libafl_mutator.so afl-fuzz -i seeds -o findings -- ./your_program @@
#include <cstddef>
#include <cstdint>
#include <vector>

#include <trestle/fuzz/mutate/mutate.hpp>

namespace {

/// What AFL++ keeps for us between calls.
struct Mutator {
  trestle::fuzz::Random random;
  trestle::fuzz::Bytes message{};
};

}  // namespace

extern "C" void* afl_custom_init(void* /*afl*/, unsigned seed) {
  return new Mutator{trestle::fuzz::Random{seed}};
}

extern "C" std::size_t afl_custom_fuzz(void* data, const std::uint8_t* input, std::size_t size,
                                       std::uint8_t** output, const std::uint8_t* other,
                                       std::size_t other_size, std::size_t max_size) {
  auto& [random, message] = *static_cast<Mutator*>(data);
  const auto* begin = reinterpret_cast<const std::byte*>(input);
  message.assign(begin, begin + size);
  if (other != nullptr && random.chance(20)) {
    message = trestle::fuzz::cross_over(message, {reinterpret_cast<const std::byte*>(other), other_size},
                                        max_size, random);
  } else {
    trestle::fuzz::mutate(message, max_size, random);
  }
  *output = reinterpret_cast<std::uint8_t*>(message.data());
  return message.size();
}

extern "C" void afl_custom_deinit(void* data) {
  delete static_cast<Mutator*>(data);
}
