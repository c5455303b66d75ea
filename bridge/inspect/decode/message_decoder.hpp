// bridge/inspect/decode: `trestle decode`: SOME/IP messages of a capture as JSON.
//
//   capture_decoder.hpp  from a capture to JSON; bridge/traffic finds the messages
//   message_decoder.hpp  a message as JSON, with the rules that it breaks
//   message_json.hpp, sd_json.hpp, names_json.hpp, left_over.hpp  its parts
//   decode_command.hpp   the command
//
// docs/decode.md describes every field.
#pragma once
#include <functional>
#include <set>
#include <string>

#include "bridge/describe/interfaces.hpp"
#include "bridge/inspect/decode/message_json.hpp"
#include "bridge/traffic/message_sink.hpp"

namespace trestle::inspect {

/// Turns SOME/IP messages into JSON objects, one for each message and one for each place where bytes are no
/// message.
class MessageDecoder : public traffic::MessageSink {
 public:
  struct Hooks {
    std::function<void(const Json&)> print;
    /// Called for each endpoint that an SD message announces; may be empty.
    std::function<void(Transport, const Endpoint&)> announced;
  };

  /// @param reassemble  also print messages that came in TP segments, when their last one came.
  /// @param interfaces  by which messages have names and values; null: none. Must outlive this.
  MessageDecoder(bool reassemble, Hooks hooks, const describe::Interfaces* interfaces = nullptr);

  using traffic::MessageSink::undecodable;
  bool message(const traffic::Place& place, std::size_t offset, const someip::Message& message) override;
  void undecodable(const traffic::Place& place, std::size_t offset, ByteView bytes,
                   const traffic::Violation& violation) override;
  void broken_frame(const traffic::Place& place, const traffic::Violation& violation) override;
  /// Prints that a line of text is not even bytes.
  void unreadable(const traffic::Place& place, const traffic::Violation& violation);

  [[nodiscard]] std::uint64_t messages() const noexcept { return messages_; }
  /// Objects with an "error".
  [[nodiscard]] std::uint64_t malformed() const noexcept { return malformed_; }
  /// Messages with bytes behind their values, which their description does not have.
  [[nodiscard]] std::uint64_t with_left_over() const noexcept { return with_left_over_; }
  /// Messages of another interface version than that of the description.
  [[nodiscard]] std::uint64_t with_other_version() const noexcept { return with_other_version_; }
  /// Whether there was a message, or an entry of service discovery, of a service that the interfaces
  /// describe.
  [[nodiscard]] bool saw_described() const noexcept { return saw_described_; }
  /// The other services that there were: "0x1234".
  [[nodiscard]] const std::set<std::string>& undescribed() const noexcept { return undescribed_; }
  /// Messages of which some TP segments are missing.
  [[nodiscard]] std::uint64_t incomplete() const noexcept;

 private:
  bool print_message(const traffic::Place& place, std::size_t offset, const someip::Message& message,
                     bool reassembled);
  void print_violation(Json object, const traffic::Violation& violation);
  void note_services(const Json& object);

  [[nodiscard]] std::optional<traffic::Violation> add_described(Json& object, std::size_t offset,
                                                                const someip::Message& message,
                                                                bool is_segment);

  Hooks hooks_;
  const describe::Interfaces* interfaces_;
  std::optional<traffic::TpAssembly> assembly_;
  std::uint64_t messages_ = 0;
  std::uint64_t malformed_ = 0;
  std::uint64_t with_left_over_ = 0;
  std::uint64_t with_other_version_ = 0;
  bool saw_described_ = false;
  std::set<std::string> undescribed_;
};

}  // namespace trestle::inspect
