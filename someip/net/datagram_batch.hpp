#pragma once
#include <memory>
#include <vector>

#include "someip/net/udp_socket.hpp"
#include "someip/wire/header.hpp"

namespace trestle::someip {

/// Small datagrams that are to leave together, in their order. Its memory is taken with the first and kept.
class DatagramBatch {
 public:
  static constexpr std::size_t max_datagrams = 64;  ///< as UdpSocket::send_trains() takes
  static constexpr std::size_t room_bytes = 65000;  ///< a train has to fit an IP packet

  struct Entry {
    Endpoint to;
    std::size_t begin = 0;
    std::size_t bytes = 0;
    std::size_t messages = 0;  ///< in the datagram
  };

  /// Whether a datagram of this size can be added.
  [[nodiscard]] bool has_room(std::size_t bytes) const noexcept {
    return entries_.size() < max_datagrams && bytes <= room_bytes - used_;
  }
  /// Adds a datagram and gives its place, to be filled at once. There is room.
  [[nodiscard]] ByteSpan add(const Endpoint& to, std::size_t bytes, std::size_t messages);
  void clear() noexcept;

  [[nodiscard]] bool empty() const noexcept { return entries_.empty(); }
  [[nodiscard]] std::span<const Entry> entries() const noexcept { return entries_; }
  [[nodiscard]] ByteView bytes_of(const Entry& entry) const noexcept {
    return {room_.get() + entry.begin, entry.bytes};
  }
  /// All from entry `first` on; neighbours that can be one train are. Valid until the next call of anything.
  [[nodiscard]] std::span<const Train> trains(std::size_t first);

 private:
  std::unique_ptr<std::byte[]> room_;
  std::size_t used_ = 0;
  std::vector<Entry> entries_;
  std::vector<Train> trains_;
};

}  // namespace trestle::someip
