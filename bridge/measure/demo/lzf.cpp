#include "bridge/measure/demo/lzf.hpp"

#include <cstring>

#include "someip/wire/bytes.hpp"

namespace trestle::measure::demo {

bool expand_lzf(ByteView from, ByteSpan to) noexcept {
  someip::ByteReader in{from};
  std::size_t at = 0;
  while (!in.rest().empty()) {
    const std::size_t control = in.u8();
    constexpr std::size_t longest_literal = 32;
    if (control < longest_literal) {  // control + 1 literal bytes follow
      const ByteView literal = in.take(control + 1);
      if (in.failed() || literal.size() > to.size() - at) {
        return false;
      }
      std::memcpy(to.data() + at, literal.data(), literal.size());
      at += literal.size();
      continue;
    }
    // A repetition: 3 bits of length, where 7 means that one more byte follows, and 13 bits of distance.
    std::size_t length = control >> 5U;
    if (length == 7) {
      length += in.u8();
    }
    length += 2;
    const std::size_t distance = ((control & 31U) << 8U) + in.u8() + 1;
    if (in.failed() || distance > at || length > to.size() - at) {
      return false;
    }
    for (; length > 0; --length, ++at) {  // source and target may overlap
      to[at] = to[at - distance];
    }
  }
  return at == to.size();
}

}  // namespace trestle::measure::demo
