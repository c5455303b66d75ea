#pragma once
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "someip/core/stream_parser.hpp"
#include "someip/wire/endpoint.hpp"
#include "someip/wire/header.hpp"

namespace trestle::test {

/// A UDP datagram of a capture, or a whole message of one of its TCP streams.
struct RecordedBytes {
  Duration time{};  ///< since the first frame
  Endpoint from;
  Endpoint to;
  std::vector<std::byte> bytes;
};

/// A TCP connection was opened or closed.
struct RecordedConnection {
  Duration time{};
  Endpoint client;
  Endpoint server;
  bool opened = false;
};

/// What a capture holds, in the order of time. Whatever is damaged in it is left out.
struct Recording {
  std::vector<RecordedBytes> datagrams;
  std::vector<RecordedBytes> stream_messages;  ///< Magic Cookies left out
  std::vector<RecordedConnection> connections;
  /// All bytes that went from one end to the other over TCP, Magic Cookies too.
  std::map<std::pair<Endpoint, Endpoint>, std::vector<std::byte>> streams;
};

/// Reads a capture; throws std::runtime_error when that cannot be done.
Recording read_recording(const std::string& path);

}  // namespace trestle::test
