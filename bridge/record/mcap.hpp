// bridge/record: recordings as files: MCAP as rosbag2 and Foxglove have it, and pcapng.
//
//   recorder.hpp      takes messages from anywhere and writes them, in files of some size
//   mcap.hpp          the format's records as plain values; mcap_fields.hpp: how their fields are read and
//                     written
//   mcap_writer.hpp   writes a file, a chunk at a time
//   mcap_reader.hpp   reads one, also what a writer left that was killed
//   compression.hpp   of chunks: LZ4, Zstandard
//   ros2msg.hpp       a message type as the text of a schema
//   offered_qos.hpp   quality of service as rosbag2 notes it
//   bag_metadata.hpp  metadata.yaml, by which rosbag2 takes a folder for a bag
//
// Knows neither the network nor where messages come from. https://mcap.dev/spec has the format.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

#include "someip/wire/types.hpp"

namespace trestle::record {

/// What a file begins and ends with: the letters, the version and both kinds of line end.
inline constexpr std::array<std::uint8_t, 8> mcap_magic{0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};

/// What kind a record is: the byte before its length.
enum class Opcode : std::uint8_t {
  header = 1,
  footer = 2,
  schema = 3,
  channel = 4,
  message = 5,
  chunk = 6,
  message_index = 7,
  chunk_index = 8,
  attachment = 9,
  attachment_index = 10,
  statistics = 11,
  metadata = 12,
  metadata_index = 13,
  summary_offset = 14,
  data_end = 15,
};

/// Before each record: its kind, and how many bytes follow.
inline constexpr std::size_t record_head_bytes = 9;

/// Of the footer, behind that.
inline constexpr std::uint64_t footer_bytes = 20;

/// The kind's name as it stands above; "record" for one that the format does not have.
[[nodiscard]] const char* to_string(Opcode opcode) noexcept;

/// Nanoseconds since 1970.
using LogTime = std::uint64_t;

/// Texts by their names.
using Texts = std::map<std::string, std::string, std::less<>>;

/// What messages are made of.
struct Schema {
  std::uint16_t id = 0;    ///< from 1; 0: a channel has none
  std::string name{};      ///< "sensor_msgs/msg/PointCloud2"
  std::string encoding{};  ///< "ros2msg"; empty: only the name is known
  std::string data{};
  friend bool operator==(const Schema&, const Schema&) = default;
};

/// Messages of one topic, of one kind.
struct Channel {
  std::uint16_t id = 0;
  std::uint16_t schema = 0;
  std::string topic{};
  std::string encoding{};  ///< of messages: "cdr", "someip"
  Texts metadata{};
  friend bool operator==(const Channel&, const Channel&) = default;
};

/// A message of a channel.
struct Entry {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;  ///< 0: not known
  LogTime log_time = 0;        ///< when it came
  LogTime publish_time = 0;    ///< when it was sent, or log_time
  ByteView data{};             ///< of what is read, valid until more is read
};

/// What a file holds.
struct Statistics {
  std::uint64_t messages = 0;
  std::uint32_t chunks = 0;
  std::uint32_t metadata = 0;
  LogTime start = 0;  ///< of the messages; 0 without any
  LogTime end = 0;
  std::map<std::uint16_t, std::uint64_t> by_channel{};

  void add(const Entry& message) {
    start = messages == 0 ? message.log_time : std::min(start, message.log_time);
    end = std::max(end, message.log_time);
    ++messages;
    ++by_channel[message.channel];
  }
};

}  // namespace trestle::record
