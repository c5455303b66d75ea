#pragma once
#include "pcaps/ip_fragments.hpp"
#include "pcaps/network.hpp"
#include "pcaps/tcp_streams.hpp"

namespace trestle::pcaps {

/// Where and when something was recorded. For what several frames carry together, it is the frame that
/// completed it, as in Wireshark.
struct Origin {
  std::uint64_t frame = 0;
  Timestamp time;
  Endpoint from;
  Endpoint to;
};

/// Takes what Traffic finds. All views are valid during the call only.
class TrafficSink {
 public:
  TrafficSink() = default;
  TrafficSink(const TrafficSink&) = delete;
  TrafficSink& operator=(const TrafficSink&) = delete;
  virtual ~TrafficSink() = default;

  /// A UDP datagram; `missing` bytes behind `payload` were cut off by the recorder.
  virtual void on_datagram(const Origin& origin, ByteView payload, std::size_t missing) = 0;
  /// The next bytes of a TCP direction.
  virtual void on_stream(const Origin& origin, const StreamBytes& stream) = 0;
  /// The direction's connection is over or forgotten; what comes next between these endpoints is a new one.
  virtual void on_stream_closed(const Origin& origin) = 0;
  /// A frame that is IP but damaged. `origin` lacks the endpoints.
  virtual void on_broken_frame(const Origin& origin, const FrameError& error) = 0;
};

/// From recorded frames to UDP datagrams and TCP byte streams. Anything may come in; memory is bounded by the
/// limits.
class Traffic {
 public:
  struct Limits {
    IpFragments::Limits fragments{};
    TcpStreams::Limits streams{};
  };
  struct Counters {
    std::uint64_t frames = 0;
    std::uint64_t datagrams = 0;
    std::uint64_t segments = 0;  ///< of TCP
    std::uint64_t fragments = 0;
    std::uint64_t other = 0;   ///< neither UDP nor TCP over IP
    std::uint64_t broken = 0;  ///< reported by on_broken_frame()
  };

  explicit Traffic(TrafficSink& sink) : Traffic{sink, Limits{}} {}
  Traffic(TrafficSink& sink, const Limits& limits)
      : sink_{sink}, fragments_{limits.fragments}, streams_{limits.streams} {}

  void on_frame(const Frame& frame);
  /// The capture is over: delivers what was waiting for frames that never came.
  void finish();

  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  [[nodiscard]] const IpFragments& fragments() const noexcept { return fragments_; }
  [[nodiscard]] const TcpStreams& streams() const noexcept { return streams_; }

 private:
  void on_packet(const IpPacket& packet);
  void on_udp(const IpPacket& packet);
  void on_tcp(const IpPacket& packet);
  void on_error(const FrameError& error);

  TrafficSink& sink_;
  IpFragments fragments_;
  TcpStreams streams_;
  Counters counters_;
  Origin origin_;  ///< of the frame at hand
};

}  // namespace trestle::pcaps
