#include "bridge/conform/fuzz/behaviour.hpp"

#include <bit>
#include <functional>

#include "fuzz/mutate/random.hpp"
#include "sd/wire/message.hpp"
#include "someip/wire/header.hpp"

namespace trestle::conform {

std::uint64_t behaviour(const std::string& state, const Packet& packet) {
  std::uint64_t hash = std::hash<std::string>{}(state) ^ static_cast<std::uint64_t>(packet.transport);
  const auto mix = [&hash](std::uint64_t more) { hash = fuzz::Random{hash ^ more}.next(); };
  const auto message = someip::decode(packet.bytes);
  if (!message) {
    mix(1);
    return hash;
  }
  mix(value(message->header.service));
  mix(value(message->header.method));
  mix(static_cast<std::uint64_t>(message->header.type) << 8U |
      static_cast<std::uint64_t>(message->header.return_code));
  if (const auto discovery = sd::decode(*message)) {
    for (std::size_t at = 0; at < discovery->entry_count(); ++at) {
      const sd::Entry entry = discovery->entry(at);
      mix(static_cast<std::uint64_t>(entry.kind()) << 16U | entry.option_count());
      mix(value(entry.service));
    }
  } else {
    mix(static_cast<std::uint64_t>(std::bit_width(message->payload.size())));
  }
  return hash;
}

}  // namespace trestle::conform
