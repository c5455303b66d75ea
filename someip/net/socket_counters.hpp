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
  template <typename Visit>
  constexpr void for_each_counter(Visit visit) const {
    using enum CounterKind;
    visit("datagrams_sent", datagrams, traffic);
    visit("messages_sent", messages, traffic);
    visit("system_calls", system_calls, traffic);
    visit("offload_refused", offload_refused, traffic);
    visit("queue_full", queue_full, loss);
    visit("slow_subscriber", overtaken, loss);
    visit("refused_by_system", refused, loss);
    visit("abandoned", abandoned, loss);
  }
};

/// What went over TCP connections.
struct TcpStreamCounters {
  StreamCounters received;
  std::uint64_t messages_sent = 0;  ///< handed to the system, whole
  std::uint64_t queue_full = 0;     ///< messages dropped because too much was waiting
  std::uint64_t overtaken = 0;      ///< messages dropped as the receiver takes them too slowly, WaitRule
  std::uint64_t timed_out = 0;      ///< messages that were not whole in time
  std::uint64_t handshakes_failed =
      0;                        ///< connections that ended as the peer did not prove who it is, by TLS
  std::uint64_t held_back = 0;  ///< times that reading stopped as the peer does not read its answers
  /// Connections that ended as there was no memory for what came or was to be sent: the system had none, or
  /// others needed that of a message which had held the most for the longest time.
  std::uint64_t no_memory = 0;
  template <typename Visit>
  constexpr void for_each_counter(Visit visit) const {
    using enum CounterKind;
    received.for_each_counter(visit);
    visit("messages_sent", messages_sent, traffic);
    visit("held_back", held_back, traffic);
    visit("no_memory", no_memory, loss);
    visit("timed_out", timed_out, loss);
    visit("handshakes_failed", handshakes_failed, loss);
    visit("queue_full", queue_full, loss);
    visit("slow_subscriber", overtaken, loss);
  }
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
  std::uint64_t unread = 0;    ///< of these, the ones whose clients had not read what was sent to them
  std::uint64_t idle = 0;      ///< connections that were closed as no message went over them for too long
  /// Connections that were closed because something came that is no SOME/IP, or too large.
  std::uint64_t bad_framing = 0;
  template <typename Visit>
  constexpr void for_each_counter(Visit visit) const {
    using enum CounterKind;
    streams.for_each_counter(visit);
    visit("open", open, now);
    visit("accepted", accepted, traffic);
    visit("closed_as_idle", idle, traffic);
    visit("refused", refused, loss);
    visit("not_accepted", not_accepted, loss);
    visit("gave_way", gave_way, loss);
    visit("gave_way_unread", unread, loss);
    visit("bad_framing", bad_framing, loss);
  }
};

/// Of a TCP connection to a server, which is connected to again whenever it is lost.
struct TcpClientCounters {
  TcpStreamCounters streams;          ///< of all connections
  std::uint64_t connections = 0;      ///< that stood
  std::uint64_t failed_attempts = 0;  ///< to connect
  /// Messages dropped because there was no connection, or because it was lost before they were sent.
  std::uint64_t not_connected = 0;
  template <typename Visit>
  constexpr void for_each_counter(Visit visit) const {
    using enum CounterKind;
    streams.for_each_counter(visit);
    visit("connected", connections, traffic);
    visit("failed_attempts", failed_attempts, traffic);
    visit("not_connected", not_connected, loss);
  }
  TcpClientCounters& operator+=(const TcpClientCounters& other) noexcept;
};

}  // namespace trestle::someip
