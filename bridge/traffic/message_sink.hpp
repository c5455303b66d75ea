#pragma once
#include <optional>

#include "bridge/traffic/tp_assembly.hpp"
#include "bridge/traffic/violation.hpp"
#include "pcaps/frame.hpp"
#include "someip/wire/header.hpp"

namespace trestle::traffic {

/// Where bytes come from.
struct Place {
  std::uint64_t line = 0;   ///< of text; 0: they are from a capture
  std::uint64_t frame = 0;  ///< of the capture, from 1
  pcaps::Timestamp time{};  ///< of the recording
  Flow flow{};
  std::optional<Transport> transport{};  ///< nothing: the frame could not be followed so far down
  std::size_t missing = 0;               ///< bytes that the recorder cut off behind these
};

/// Takes the messages of a capture or a text, and what there is in place of messages.
class MessageSink {
 public:
  MessageSink() = default;
  MessageSink(const MessageSink&) = delete;
  MessageSink& operator=(const MessageSink&) = delete;
  virtual ~MessageSink() = default;

  /// A message that was found at `offset`.
  /// @return whether it is well formed.
  virtual bool message(const Place& place, std::size_t offset, const someip::Message& message) = 0;
  /// There is no message at `offset`, where `bytes` are.
  virtual void undecodable(const Place& place, std::size_t offset, ByteView bytes,
                           const Violation& violation) = 0;
  /// A frame that is damaged below SOME/IP.
  virtual void broken_frame(const Place& place, const Violation& violation) = 0;

  /// Takes every message of a datagram.  [feat_req_someip_702] [feat_req_someip_319]
  /// @return whether all of it was well formed.
  bool datagram(const Place& place, ByteView bytes);
  /// As undecodable(), for the bytes that someip::decode() refused.
  void undecodable(const Place& place, std::size_t offset, ByteView bytes, someip::WireError error);
};

}  // namespace trestle::traffic
