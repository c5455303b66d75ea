#include "bridge/traffic/tp_assembly.hpp"

namespace trestle::traffic {
namespace {

constexpr std::size_t max_message_bytes = std::size_t{64} << 20U;
constexpr std::size_t max_messages = 16;  // messages being reassembled at a time
constexpr std::size_t max_flows = 65536;
constexpr Duration max_age = std::chrono::seconds{10};

}  // namespace

TpAssembly::TpAssembly() {
  constexpr std::size_t map_words = someip::tp_map_words(max_message_bytes);
  for (std::size_t i = 0; i < max_messages; ++i) {
    // Not cleared, so memory that no message reaches is never touched and costs nothing.
    buffers_.push_back(std::make_unique_for_overwrite<std::byte[]>(max_message_bytes));
    maps_.push_back(std::make_unique_for_overwrite<std::uint32_t[]>(map_words));
    slots_.emplace_back(ByteSpan{buffers_.back().get(), max_message_bytes},
                        std::span{maps_.back().get(), map_words});
  }
  reassembler_.emplace(slots_, someip::TpReassemblyLimits{.max_message_bytes = max_message_bytes,
                                                          .max_per_sender = max_messages,
                                                          .max_age = max_age});
}

someip::Result<std::optional<someip::Reassembled>, someip::TpDrop> TpAssembly::add(
    const Flow& flow, const someip::Message& segment, TimePoint now) {
  if (flows_.size() == max_flows) {
    flows_.clear();  // incomplete messages are lost; in real traffic no number is used twice within max_age
  }
  // The reassembler sees each flow as a sender, with a made-up address that contains the flow's number.
  const std::uint32_t number =
      flows_.try_emplace(flow, static_cast<std::uint32_t>(flows_.size())).first->second;
  Endpoint sender;
  sender.address =
      IpAddress::v4(static_cast<std::uint8_t>(number >> 24U), static_cast<std::uint8_t>(number >> 16U),
                    static_cast<std::uint8_t>(number >> 8U), static_cast<std::uint8_t>(number));
  return reassembler_->on_segment(sender, segment, now);
}

std::uint64_t TpAssembly::incomplete() const noexcept {
  const someip::TpCounters& counters = reassembler_->counters();
  return reassembler_->size() + counters[someip::TpDrop::replaced] + counters[someip::TpDrop::aged_out] +
         counters[someip::TpDrop::gave_way];
}

}  // namespace trestle::traffic
