#pragma once
#include <netinet/in.h>
#include <sys/uio.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "bridge/statistics/histogram.hpp"

/// What the system itself can do, measured by loops as bare as they can be: the floor under our figures.
/// Failures of system calls end the program.
namespace trestle::floor {

struct Options {
  sockaddr_in at{};        ///< a server's address
  std::size_t bytes = 80;  ///< of each datagram, or message; a SOME/IP header is 16
  std::size_t window = 0;  ///< messages under way at a time; 0: no limit
  double seconds = 1;
  bool segmentation = true;  ///< UDP_SEGMENT and UDP_GRO, else sendmmsg and recvmmsg
  std::uint32_t domain = 0;  ///< of DDS
  bool shared_memory = false;
  bool synchronous = false;  ///< the thread that writes a sample of DDS sends it, too
  bool busy = false;         ///< looks for what comes over and over, and does not wait for it
  bool batches = true;       ///< sendmmsg, else a call of sendto for each datagram
  sockaddr_in own{};  ///< a client's address with its own service discovery: the server is a SOME/IP stack
  std::uint64_t messages = 200;  ///< to wait for
  double reads = 0;              ///< MB/s at most; 0: as fast as it can
  bool vsomeip = false;          ///< the stack is not Trestle
  double rate = 0;               ///< messages a second
};

/// A descriptor that is closed at the end.
class Socket {
 public:
  explicit Socket(int type);
  ~Socket();
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  [[nodiscard]] int fd() const noexcept { return fd_; }
  void option(int level, int name, int value) const;
  void bind(const sockaddr_in& address) const;
  void connect(const sockaddr_in& address) const;
  /// As large as ours are.
  void large_buffers() const;
  void receive_timeout(int milliseconds) const;

 private:
  int fd_;
};

/// Asks a server that listens at its address, until it, which may still serve the one before, begins to send.
void ask(const Socket& socket, const void* request, std::size_t bytes);
/// Sends datagrams of `segment` bytes each, the last one of what is left, with one call.
void send_train(const Socket& socket, const sockaddr_in& to, std::span<iovec> parts, std::size_t segment);

/// Ends the program, saying what failed and why, if `result` is negative.
std::int64_t check(std::int64_t result, const char* what);
[[nodiscard]] std::int64_t now_ns();

/// What a client prints, as JSON: the names are those of `trestle perf --json`.
struct Figures {
  statistics::Histogram latency;
  std::uint64_t bytes = 0;
  std::uint64_t received = 0;
  std::uint64_t lost = 0;
  double seconds = 0;
  void print() const;
};

/// The last numbers of the warm-up are not counted.
inline constexpr std::int64_t warm_up_ns = 100'000'000;

// Servers run until they are killed.
void serve_udp(const Options& options);
void ping_udp(const Options& options);
void serve_tcp(const Options& options);
void ping_tcp(const Options& options);
void serve_flood(const Options& options);
void receive_flood(const Options& options);
void serve_tp(const Options& options);
void receive_tp(const Options& options);
void receive_silent(const Options& options);
void reflect_dds(const Options& options);
void ping_dds(const Options& options);
void publish_dds(const Options& options);

}  // namespace trestle::floor
