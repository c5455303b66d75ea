// A receiver of large events of which the sender knows nothing: no stack of ours, no option of ours in its
// subscription, and the socket buffer that Linux gives to everybody. It asks `trestle perf server`, or
// vsomeip's server (vsomeip=1), for events without a pause, reads no more than `reads` MB/s, each segment
// taking its time as in a stack that works on it, and puts them together by their offsets.
#include <arpa/inet.h>
#include <sys/socket.h>

#include <array>
#include <bit>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "test/bench/floor_sd.hpp"

namespace trestle::floor {
namespace {

constexpr std::uint16_t start_method = 3;
constexpr std::uint16_t acknowledge_method = 4;  // of vsomeip's server
constexpr std::uint16_t event = 0x8001;
constexpr std::uint16_t eventgroup = 1;
constexpr std::uint8_t request = 0x00;
constexpr std::uint8_t request_no_return = 0x01;
constexpr std::uint8_t tp_flag = 0x20;
constexpr std::size_t tp_header_bytes = 4;
constexpr std::uint64_t vsomeip_window = 4;  ///< its queue has no limit; `trestle perf server` has 4 waiting
constexpr std::int64_t vsomeip_duration_ns = 60'000'000'000;
constexpr int silence_ms = 2000;

/// The default of `trestle perf client --events --window 0`.
std::vector<std::byte> plan_of_trestle(std::size_t bytes) {
  constexpr std::uint32_t default_separation_ns = 500'000;
  std::vector<std::byte> plan;
  put(plan, 0, 1);  // UDP
  put(plan, bytes, 4);
  put(plan, std::bit_cast<std::uint64_t>(0.0), 8);  // as many as there can be
  put(plan, 0, 4);                                  // no window
  put(plan, default_separation_ns, 4);
  put(plan, 0, 2);  // bursts: as the subscription tells, which tells nothing
  return plan;
}

/// As in vsomeip_perf.cpp, whose numbers go as they are.
std::vector<std::byte> plan_of_vsomeip(std::uint64_t bytes, std::int64_t duration_ns) {
  std::vector<std::byte> plan(3 * sizeof bytes);
  std::memcpy(plan.data(), &bytes, sizeof bytes);
  std::memcpy(plan.data() + sizeof bytes, &vsomeip_window, sizeof vsomeip_window);
  std::memcpy(plan.data() + 2 * sizeof bytes, &duration_ns, sizeof duration_ns);
  return plan;
}

class Receiver {
 public:
  explicit Receiver(const Options& options)
      : options_{options}, discovery_{options.own, options.at}, message_(options.bytes) {
    figures_.bytes = options.bytes;
    socket_.bind(options.own);
    socket_.receive_timeout(silence_ms);
  }

  void run() {
    service_ = discovery_.find();
    sockaddr_in receiver{};
    socklen_t size = sizeof receiver;
    check(getsockname(socket_.fd(), reinterpret_cast<sockaddr*>(&receiver), &size), "getsockname");
    discovery_.subscribe(service_, eventgroup, receiver);
    start(vsomeip_duration_ns);
    while (seen_ < options_.messages && receive()) {
    }
    discovery_.unsubscribe();
    if (options_.vsomeip) {
      start(1);
    }
    figures_.seconds = static_cast<double>(ended_ns_ - began_ns_) / 1e9;
    figures_.lost = seen_ - figures_.received;
    if (seen_ == 0) {
      std::fputs("trestle_floor: no event came\n", stderr);
      std::_Exit(1);
    }
    figures_.print();
  }

 private:
  void send(std::uint16_t method, std::uint8_t type, std::span<const std::byte> payload) {
    const auto bytes = someip_message(service_, method, type, payload);
    check(sendto(socket_.fd(), bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&service_.at),
                 sizeof service_.at),
          "sendto");
  }

  void start(std::int64_t duration_ns) {
    if (options_.vsomeip) {
      send(start_method, request_no_return, plan_of_vsomeip(options_.bytes, duration_ns));
    } else {
      send(start_method, request, plan_of_trestle(options_.bytes));
    }
  }

  /// @return false when no more comes.
  bool receive() {
    const auto got = recv(socket_.fd(), room_.data(), room_.size(), 0);
    if (got < 0) {
      return false;
    }
    const std::int64_t came = now_ns();
    const std::span<const std::byte> bytes{room_.data(), static_cast<std::size_t>(got)};
    constexpr std::size_t front = someip_header_bytes + tp_header_bytes;
    if (bytes.size() > front && number_at(bytes, 2, 2) == event && (number_at(bytes, 14, 1) & tp_flag) != 0) {
      on_segment(came, number_at(bytes, 10, 2),
                 number_at(bytes, someip_header_bytes, 4) & ~std::uint64_t{0xf}, bytes.subspan(front));
    }
    if (options_.reads > 0) {
      const auto takes_ns = static_cast<std::int64_t>(static_cast<double>(got) * 1e3 / options_.reads);
      while (now_ns() < came + takes_ns) {
      }
    }
    return true;
  }

  void on_segment(std::int64_t came, std::uint64_t session, std::size_t offset,
                  std::span<const std::byte> bytes) {
    if (session != session_) {
      if (session_ != 0) {
        end_message(session);
      }
      session_ = session;
      gathered_ = 0;
      first_segment_ns_ = came;
      if (began_ns_ == 0 && counts_) {
        began_ns_ = came;
      }
    }
    if (offset + bytes.size() > message_.size()) {
      return;
    }
    std::memcpy(message_.data() + offset, bytes.data(), bytes.size());
    gathered_ += bytes.size();
    last_segment_ns_ = came;
  }

  /// When the next one has begun, or some later one. The first one does not count, of which we may have
  /// missed the beginning.
  void end_message(std::uint64_t next) {
    constexpr std::uint64_t sessions = 0xffff;  // 0 is none
    const std::uint64_t missed = (next + sessions - session_) % sessions - 1;
    if (counts_) {
      ended_ns_ = last_segment_ns_;
      seen_ += 1 + missed;
      if (gathered_ == message_.size()) {
        ++figures_.received;
        figures_.latency.add(last_segment_ns_ - first_segment_ns_);
      }
    }
    counts_ = true;
    if (options_.vsomeip) {
      acknowledged_ += 1 + missed;
      std::array<std::byte, sizeof acknowledged_> bytes;
      std::memcpy(bytes.data(), &acknowledged_, sizeof acknowledged_);
      send(acknowledge_method, request_no_return, bytes);
    }
  }

  const Options& options_;
  Discovery discovery_;
  Socket socket_{SOCK_DGRAM};
  RemoteService service_;
  std::array<std::byte, 65536> room_{};
  std::vector<std::byte> message_;
  bool counts_ = false;
  std::uint64_t session_ = 0;
  std::size_t gathered_ = 0;
  std::int64_t first_segment_ns_ = 0;
  std::int64_t last_segment_ns_ = 0;
  std::uint64_t seen_ = 0;
  std::uint64_t acknowledged_ = 0;
  std::int64_t began_ns_ = 0;
  std::int64_t ended_ns_ = 0;
  Figures figures_;
};

}  // namespace

void receive_silent(const Options& options) {
  Receiver{options}.run();
}

}  // namespace trestle::floor
