#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "test/bench/floor.hpp"

/// As much of service discovery as a stack needs that tells nothing of itself, in bytes that are made by
/// hand.
namespace trestle::floor {

inline constexpr std::uint16_t perf_service =
    0x7e57;  ///< of `trestle perf server`, and of vsomeip's beside it
inline constexpr std::size_t someip_header_bytes = 16;

/// Big endian.
void put(std::vector<std::byte>& bytes, std::uint64_t number, unsigned count);
[[nodiscard]] std::uint64_t number_at(std::span<const std::byte> bytes, std::size_t at, unsigned count);

/// Where the service is offered.
struct RemoteService {
  sockaddr_in at{};
  std::uint16_t instance = 0;
  std::uint8_t major = 0;
};

/// A SOME/IP message to it with this payload.
[[nodiscard]] std::vector<std::byte> someip_message(const RemoteService& service, std::uint16_t method,
                                                    std::uint8_t type, std::span<const std::byte> payload);

/// A client's side of it, on port 30490 of its own address. It begins with session 1, as after a start.
class Discovery {
 public:
  /// @param server  whose offers count.
  Discovery(const sockaddr_in& own, const sockaddr_in& server);

  /// Ends the program when it is not offered within some seconds.
  [[nodiscard]] RemoteService find();
  /// By UDP, without any option but the endpoint of `receiver`; likewise when it is not acknowledged.
  void subscribe(const RemoteService& service, std::uint16_t eventgroup, const sockaddr_in& receiver);
  /// TTL 0, for the last subscription.
  void unsubscribe();

 private:
  struct Entry {
    std::uint8_t type = 0;
    std::uint16_t instance = 0;
    std::uint8_t major = 0;
    std::uint32_t ttl_s = 0;
    std::uint32_t more = 0;  ///< minor version, or eventgroup
    std::optional<sockaddr_in> endpoint{};
  };

  void send(const Entry& entry, const sockaddr_in& to);
  /// Of our service, from the server; nothing when none comes for a while.
  std::optional<Entry> receive(std::uint8_t type);

  Socket socket_{SOCK_DGRAM};
  sockaddr_in server_;
  std::uint16_t session_ = 0;
  std::optional<Entry> subscribed_;
};

}  // namespace trestle::floor
