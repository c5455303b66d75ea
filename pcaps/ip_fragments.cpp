#include "pcaps/ip_fragments.hpp"

#include <algorithm>

namespace trestle::pcaps {

FrameResult<std::optional<IpPacket>> IpFragments::add(const IpPacket& packet, Timestamp now) {
  const IpPacket::Fragment fragment = *packet.fragment;
  // In IPv4 the protocol is part of a packet's identity; in IPv6 only the first fragment is sure to give it.
  const Key key{packet.from, packet.to, packet.from.v6 ? std::uint8_t{0} : packet.protocol, fragment.id};
  const std::size_t size = packet.payload.size();
  const std::size_t end = fragment.offset + size;
  const auto found = partials_.find(key);
  const bool contradicts =
      found != partials_.end() && found->second.total_bytes &&
      (fragment.more ? end > *found->second.total_bytes : end != *found->second.total_bytes);
  const bool impossible =
      end > block_bytes * max_blocks - 1 || size == 0 || (fragment.more && size % block_bytes != 0);
  if (packet.missing != 0 || impossible || contradicts) {
    if (found != partials_.end()) {
      partials_.erase(found);
    }
    ++dropped_;
    if (packet.missing != 0) {
      return std::nullopt;  // the recorder cut the frame: not an error of the sender
    }
    return tl::unexpected{FrameError{FrameFault::fragment, packet.offset}};
  }
  if (found == partials_.end()) {
    make_room(now);
  }
  Partial& partial = partials_[key];
  if (partial.bytes.empty()) {
    partial.since = now;
  }
  if (partial.bytes.size() < end) {
    partial.bytes.resize(end);
  }
  if (!fragment.more) {
    partial.total_bytes = end;
  }
  for (std::size_t at = 0; at < size; at += block_bytes) {
    const std::size_t block = (fragment.offset + at) / block_bytes;
    if (!partial.present[block]) {
      partial.present.set(block);
      std::ranges::copy(packet.payload.subspan(at, std::min(block_bytes, size - at)),
                        partial.bytes.begin() + static_cast<std::ptrdiff_t>(fragment.offset + at));
    }
  }
  if (!partial.total_bytes ||
      partial.present.count() < (*partial.total_bytes + block_bytes - 1) / block_bytes) {
    return std::nullopt;
  }
  const std::size_t total = *partial.total_bytes;
  whole_ = std::move(partial.bytes);
  partials_.erase(key);
  if (whole_.size() != total) {  // an earlier fragment lies beyond the end that is known now
    ++dropped_;
    return tl::unexpected{FrameError{FrameFault::fragment, packet.offset}};
  }
  IpPacket result = packet;
  result.fragment.reset();
  result.payload = whole_;
  return result;
}

void IpFragments::make_room(Timestamp now) {
  dropped_ +=
      std::erase_if(partials_, [&](const auto& entry) { return now - entry.second.since > limits_.max_age; });
  if (partials_.size() >= limits_.max_packets) {
    partials_.erase(
        std::ranges::min_element(partials_, {}, [](const auto& entry) { return entry.second.since; }));
    ++dropped_;
  }
}

}  // namespace trestle::pcaps
