#pragma once
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bridge/record/mcap.hpp"
#include "dds_adapter/participant.hpp"
#include "someip/wire/endpoint.hpp"
#include "someip/wire/header.hpp"

namespace trestle::carry {

/// A topic of a recording.
struct RecordedTopic {
  std::string name{};
  std::string type{};
  dds::Qos qos{};  ///< what a writer offers in place of all that were recorded
  std::string hash{};
  friend bool operator==(const RecordedTopic&, const RecordedTopic&) = default;
};

/// A SOME/IP message of a recording, valid until the next one is read.
struct RecordedMessage {
  someip::Message message{};
  Transport transport = Transport::udp;
  Endpoint from{};
  Endpoint to{};
};

/// What comes next in a recording.
struct Replayed {
  record::LogTime time = 0;
  const RecordedTopic* topic = nullptr;  ///< of a sample ...
  ByteView sample{};                     ///< ... which is valid until the next one is read
  std::optional<RecordedMessage> someip{};
};

/// A recording, read from its front to its end, in the order of the file. Messages whose time is before that
/// of others in front of them are there, too.
class ReplaySource {
 public:
  ReplaySource() = default;
  ReplaySource(const ReplaySource&) = delete;
  ReplaySource& operator=(const ReplaySource&) = delete;
  virtual ~ReplaySource() = default;

  /// @return nothing at the end.
  /// @throws std::runtime_error  the recording is damaged; what() names file, offset and field.
  [[nodiscard]] virtual std::optional<Replayed> next() = 0;
  /// Begins again.
  virtual void rewind() = 0;
  /// All that there are, by name and type.
  [[nodiscard]] virtual std::vector<const RecordedTopic*> topics() const { return {}; }
  /// What was not read as it should be, for people: where a file breaks off. After the end.
  [[nodiscard]] virtual std::string remark() const { return {}; }
  /// Messages that have no form in which they could be replayed.
  [[nodiscard]] virtual std::uint64_t unknown() const { return 0; }
};

/// @param path     an MCAP file, the folder of a bag, or a capture (pcap or pcapng).
/// @param sd_port  of service discovery, for captures.
/// @throws std::runtime_error  it is none, or cannot be read.
[[nodiscard]] std::unique_ptr<ReplaySource> open_recording(const std::string& path, std::uint16_t sd_port);

}  // namespace trestle::carry
