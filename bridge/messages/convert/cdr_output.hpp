#pragma once
#include <algorithm>

#include "bridge/messages/convert/program/output.hpp"
#include "bridge/messages/convert/program/wire_forms.hpp"

/// Writing CDR in the host's byte order into an Output.
namespace trestle::messages {

/// Zeros up to a multiple of `width`, counted from the body's first byte.
inline void align_cdr(Output& out, std::size_t width) {
  const std::size_t size = (0 - (out.position() - encapsulation_bytes)) & (width - 1);
  std::byte* const to = out.room(size);
  for (std::size_t k = 0; k < size; ++k) {
    to[k] = std::byte{0};
  }
}

inline void write_cdr_u32(Output& out, std::uint32_t number) {
  align_cdr(out, 4);
  store_u32(out.room(4), number, std::endian::native);
}

}  // namespace trestle::messages
