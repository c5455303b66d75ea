#include "someip/net/datagram_batch.hpp"

namespace trestle::someip {

ByteSpan DatagramBatch::add(const Endpoint& to, std::size_t bytes, std::size_t messages) {
  if (!room_) {
    room_.reset(new std::byte[room_bytes]);  // not zeroed: only bytes that were written are sent
    entries_.reserve(max_datagrams);
    trains_.reserve(max_datagrams);
  }
  entries_.push_back({to, used_, bytes, messages});
  const ByteSpan place{room_.get() + used_, bytes};
  used_ += bytes;
  return place;
}

void DatagramBatch::clear() noexcept {
  entries_.clear();
  used_ = 0;
}

std::span<const Train> DatagramBatch::trains(std::size_t first) {
  trains_.clear();
  for (const Entry& entry : std::span{entries_}.subspan(first)) {
    if (!trains_.empty()) {
      Train& last = trains_.back();
      // A shorter datagram has ended the train.
      const bool open = last.bytes.size() % last.datagram_bytes == 0;
      if (open && last.peer == entry.to && entry.bytes <= last.datagram_bytes) {
        last.bytes = {last.bytes.data(), last.bytes.size() + entry.bytes};
        continue;
      }
    }
    trains_.push_back({entry.to, bytes_of(entry), entry.bytes});
  }
  return trains_;
}

}  // namespace trestle::someip
