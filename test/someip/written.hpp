#pragma once
#include <array>
#include <string>

#include "someip/wire/payload_writer.hpp"
#include "test/bytes.hpp"

namespace trestle::test {

/// What `write` makes under `rules`, in hexadecimal; "!error" if it fails.
template <typename Write>
std::string written(const someip::PayloadRules& rules, Write write) {
  std::array<std::byte, 512> room{};
  room.fill(std::byte{0xee});
  someip::PayloadWriter out{room, rules};
  write(out);
  const auto payload = out.finish();
  return payload ? to_hex(*payload) : std::string{"!"} + to_string(payload.error());
}

}  // namespace trestle::test
