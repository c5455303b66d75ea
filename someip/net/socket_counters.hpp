#pragma once
#include <cstdint>

#include "someip/core/stream_parser.hpp"

namespace trestle::someip {

/// What was sent through a UDP socket.
struct SenderCounters {
  std::uint64_t messages = 0;         ///< sent, whole
  std::uint64_t datagrams = 0;        ///< sent
  std::uint64_t queue_full = 0;       ///< messages dropped because too much was waiting
  std::uint64_t overtaken = 0;        ///< messages dropped as the receiver takes them too slowly, WaitRule
  std::uint64_t refused = 0;          ///< messages lost because the system would not send them
  std::uint64_t abandoned = 0;        ///< messages dropped as the socket was closed
  std::uint64_t system_calls = 0;     ///< that sending needed
  std::uint64_t offload_refused = 0;  ///< times that the kernel would not segment, and all went one by one
};

/// What went over TCP connections.
struct TcpStreamCounters {
  StreamCounters received;
  std::uint64_t messages_sent = 0;  ///< handed to the system, whole
  std::uint64_t queue_full = 0;     ///< messages dropped because too much was waiting
  std::uint64_t overtaken = 0;      ///< messages dropped as the receiver takes them too slowly, WaitRule
  std::uint64_t timed_out = 0;      ///< messages that were not whole in time
  std::uint64_t held_back = 0;      ///< times that reading stopped as the peer does not read its answers
  /// Connections that ended as there was no memory for what came or was to be sent: the system had none, or
  /// others needed that of a message which had held the most for the longest time.
  std::uint64_t no_memory = 0;
  TcpStreamCounters& operator+=(const TcpStreamCounters& other) noexcept;
};

/// Of a TCP port that clients connect to.
struct TcpServerCounters {
  TcpStreamCounters streams;  ///< of all connections, also past ones
  std::uint64_t open = 0;     ///< connections that stand now
  std::uint64_t accepted = 0;
  std::uint64_t refused = 0;  ///< connections that were one too many, of all or of one address
  /// Attempts that the system refused, mostly as no file descriptor was free; tried again every 100 ms.
  std::uint64_t not_accepted = 0;
  std::uint64_t gave_way = 0;  ///< connections that were closed to make room for others
  std::uint64_t idle = 0;      ///< connections that were closed as no message went over them for too long
  /// Connections that were closed because something came that is no SOME/IP, or too large.
  std::uint64_t bad_framing = 0;
};

/// Of a TCP connection to a server, which is connected to again whenever it is lost.
struct TcpClientCounters {
  TcpStreamCounters streams;          ///< of all connections
  std::uint64_t connections = 0;      ///< that stood
  std::uint64_t failed_attempts = 0;  ///< to connect
  /// Messages dropped because there was no connection, or because it was lost before they were sent.
  std::uint64_t not_connected = 0;
  TcpClientCounters& operator+=(const TcpClientCounters& other) noexcept;
};

}  // namespace trestle::someip
