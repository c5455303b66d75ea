// bridge/traffic: SOME/IP in captured traffic: which frames carry it, where its messages are, and what
// service discovery tells. It prints nothing and knows no types. decode, watch, find, generate and the replay
// of conform are built on it.
//
//   capture_reader.hpp   from frames to messages
//   someip_ports.hpp     which ports carry SOME/IP
//   message_stream.hpp, tp_assembly.hpp  messages in TCP streams and in segments
//   message_sink.hpp, violation.hpp      who takes the messages, and what is wrong with bytes that are none
//   network_view.hpp     services and subscriptions that were seen
#pragma once
#include <map>
#include <vector>

#include "bridge/traffic/message_stream.hpp"
#include "bridge/traffic/someip_ports.hpp"
#include "pcaps/traffic.hpp"

namespace trestle::traffic {

/// Finds the SOME/IP messages of traffic and hands them to a sink. Feed it through pcaps::Traffic, then call
/// finish(). TP segments are messages to it.
class CaptureReader : public pcaps::TrafficSink {
 public:
  /// @param ports  carry SOME/IP whatever it looks like, besides that of SD.
  CaptureReader(const std::vector<std::uint16_t>& ports, MessageSink& sink) : ports_{ports}, sink_{sink} {}

  /// From now on all that `endpoint` sends or gets is SOME/IP: discovery announced it.
  void learn(Transport transport, const Endpoint& endpoint) { ports_.learn(transport, endpoint); }

  void on_datagram(const pcaps::Origin& origin, ByteView payload, std::size_t missing) override;
  void on_stream(const pcaps::Origin& origin, const pcaps::StreamBytes& bytes) override;
  void on_stream_closed(const pcaps::Origin& origin) override;
  void on_broken_frame(const pcaps::Origin& origin, const pcaps::FrameError& error) override;
  /// The capture is over: messages that it breaks off are told of.
  void finish();

  /// Datagrams that were not taken for SOME/IP.
  [[nodiscard]] std::uint64_t foreign_datagrams() const noexcept { return foreign_datagrams_; }
  /// Directions of TCP connections that were not taken for SOME/IP.
  [[nodiscard]] std::uint64_t foreign_streams() const noexcept { return foreign_streams_; }

 private:
  /// One direction of a TCP connection.
  struct Stream {
    std::optional<MessageStream> messages;  ///< nothing until it is taken for SOME/IP
    bool foreign = false;
    std::vector<std::byte> front;  ///< while neither: the first bytes, too few to tell
    std::uint64_t front_offset = 0;
    pcaps::Origin last;  ///< what brought the last bytes
  };

  void begin(Stream& stream, const pcaps::StreamBytes& bytes);
  void close(Stream& stream);

  SomeipPorts ports_;
  MessageSink& sink_;
  std::map<Flow, Stream> streams_;
  std::size_t waiting_bytes_ = 0;
  std::uint64_t foreign_datagrams_ = 0;
  std::uint64_t foreign_streams_ = 0;
};

}  // namespace trestle::traffic
