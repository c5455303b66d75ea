#pragma once
#include <functional>
#include <optional>

#include "bridge/decode/message_json.hpp"
#include "bridge/decode/tp_assembly.hpp"

namespace trestle::bridge {

/// Where bytes come from.
struct Place {
  Json fields;  ///< what each object about these bytes begins with
  Flow flow;
  TimePoint time{};         ///< of the recording; only differences matter
  std::size_t missing = 0;  ///< bytes behind these that the recorder cut off
};

/// Turns SOME/IP messages into JSON objects, one for each message and one for each place where bytes are no
/// message.
class MessageDecoder {
 public:
  struct Hooks {
    std::function<void(const Json&)> print;
    /// Called for each endpoint that an SD message announces; may be empty.
    std::function<void(Transport, const Endpoint&)> announced;
  };

  /// @param reassemble  also print messages that came in TP segments, when their last one came.
  MessageDecoder(bool reassemble, Hooks hooks);

  /// Prints every message of a datagram.  [feat_req_someip_702] [feat_req_someip_319]
  /// @return whether all of it was well formed.
  bool datagram(const Place& place, ByteView bytes);
  /// Prints one message that was found at `offset`.
  bool message(const Place& place, std::size_t offset, const someip::Message& message);
  /// Prints that there is no message at `offset`, where `bytes` are.
  void undecodable(const Place& place, std::size_t offset, ByteView bytes, const Violation& violation);
  /// Prints that bytes could not even be got at. `object` says where from.
  void unreadable(Json object, const Violation& violation);
  /// As undecodable(), for the bytes that someip::decode() refused.
  void undecodable(const Place& place, std::size_t offset, ByteView bytes, someip::WireError error);

  [[nodiscard]] std::uint64_t messages() const noexcept { return messages_; }
  /// Objects with an "error".
  [[nodiscard]] std::uint64_t malformed() const noexcept { return malformed_; }
  /// Messages of which some TP segments are missing.
  [[nodiscard]] std::uint64_t incomplete() const noexcept;

 private:
  bool print_message(const Place& place, std::size_t offset, const someip::Message& message,
                     bool reassembled);

  Hooks hooks_;
  std::optional<TpAssembly> assembly_;
  std::uint64_t messages_ = 0;
  std::uint64_t malformed_ = 0;
};

}  // namespace trestle::bridge
