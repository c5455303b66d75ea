#include "someip/net/reassembly.hpp"

namespace trestle::someip {
namespace {

// Bursts of loss and reordering leave a few gaps; beyond that a message will hardly become whole.
constexpr std::size_t gaps_per_message = 64;

}  // namespace

Reassembly::Reassembly(std::size_t max_messages, const TpReassemblyLimits& limits)
    : gaps_(max_messages * gaps_per_message) {
  for (std::size_t i = 0; i < max_messages; ++i) {
    buffers_.emplace_back(new std::byte[limits.max_message_bytes]);  // not zeroed: no page is touched early
    slots_.emplace_back(ByteSpan{buffers_.back().get(), limits.max_message_bytes},
                        std::span{gaps_}.subspan(i * gaps_per_message, gaps_per_message));
  }
  machine_.emplace(slots_, limits);
}

}  // namespace trestle::someip
