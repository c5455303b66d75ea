#pragma once
#include <map>
#include <optional>
#include <tuple>

#include "bridge/carry/record/someip_messages.hpp"
#include "bridge/describe/interfaces.hpp"
#include "bridge/record/recorder.hpp"

namespace trestle::carry {

/// What was recorded of frames, and what was not.
struct SomeipRecordCounters {
  std::uint64_t messages = 0;
  std::uint64_t malformed = 0;   ///< bytes that are no message, and frames that are damaged
  std::uint64_t incomplete = 0;  ///< messages of which segments are missing
};

/// Records the SOME/IP messages of frames. There is a channel for each service, method or event, sender and
/// receiver. Its topic is "/someip/0x1234/0x8001", or with names "/someip/Door/moved"; that of discovery is
/// "/someip/sd". Its metadata say what a message does not: `from`, `to`, `transport`, and the `instance` if
/// discovery told of it.
class SomeipRecorder {
 public:
  /// @param interfaces  null: there are no names. Outlives this, as the recorder does.
  SomeipRecorder(record::Recorder& recorder, const describe::Interfaces* interfaces, std::uint16_t sd_port);

  void on_frame(const pcaps::Frame& frame);
  /// No more frames come.
  void finish() { messages_.finish(); }
  [[nodiscard]] SomeipRecordCounters counters() const;

 private:
  using Key = std::tuple<Transport, Endpoint, Endpoint, someip::ServiceId, someip::MethodId>;

  void record(const traffic::Place& place, const someip::Message& message);
  [[nodiscard]] std::optional<std::uint16_t> channel(const Key& key, const someip::Header& header);
  [[nodiscard]] record::ChannelInfo info_of(const Key& key, const someip::Header& header) const;
  [[nodiscard]] std::string topic_of(const someip::Header& header) const;
  [[nodiscard]] bool is_tcp_server(const Endpoint& at) const;
  [[nodiscard]] bool carries_someip(const pcaps::Frame& frame, std::uint64_t found_before) const;

  record::Recorder& recorder_;
  const describe::Interfaces* interfaces_;
  SomeipMessages messages_;
  std::map<Key, std::optional<std::uint16_t>> channels_;  ///< nothing: there was no number left
  std::uint64_t recorded_ = 0;
};

}  // namespace trestle::carry
