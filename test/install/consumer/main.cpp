#include <array>
#include <cstdio>

#include "bridge/carry/config/load.hpp"
#include "someip/wire/header.hpp"

// One thing of the lowest and one of the highest layer.
int main() {
  std::array<std::byte, 16> room{};
  const auto bytes = trestle::someip::encode({.service = trestle::someip::ServiceId{0x1234}}, {}, room);
  const auto config = trestle::carry::load_config("missing.yaml");
  if (!bytes || config) {
    return 1;
  }
  std::printf("%zu bytes; %s\n", bytes->size(), to_string(config.error().front()).c_str());
  return 0;
}
