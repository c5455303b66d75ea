#include "bridge/traffic/capture_reader.hpp"

#include "someip/wire/bytes.hpp"

namespace trestle::traffic {
namespace {

constexpr std::uint32_t max_datagram_length = 0xffff;
/// Bytes of incomplete messages of all TCP streams together; a stream that exceeds this is given up.
constexpr std::size_t max_waiting_bytes = std::size_t{256} << 20U;

Place place_of(const pcaps::Origin& origin, Transport transport, std::size_t missing = 0) {
  return {.frame = origin.frame,
          .time = origin.time,
          .flow = {origin.from, origin.to},
          .transport = transport,
          .missing = missing};
}

bool has_sd_id(ByteView bytes) noexcept {
  return bytes.size() >= 4 && someip::load<std::uint32_t>(bytes.data()) == 0xffff'8100;
}

}  // namespace

void CaptureReader::on_datagram(const pcaps::Origin& origin, ByteView payload, std::size_t missing) {
  const bool known = ports_.known(Transport::udp, origin.from, origin.to);
  const bool looks = SomeipPorts::may_guess(origin.from, origin.to) &&
                     (has_sd_id(payload) || looks_like_header(payload, max_datagram_length));
  if (!known && !looks) {
    ++foreign_datagrams_;
    return;
  }
  const bool well_formed = sink_.datagram(place_of(origin, Transport::udp, missing), payload);
  if (!known && well_formed) {
    ports_.learn(Transport::udp, origin.from);
    ports_.learn(Transport::udp, origin.to);
  }
}

void CaptureReader::on_stream(const pcaps::Origin& origin, const pcaps::StreamBytes& bytes) {
  Stream& stream = streams_[{origin.from, origin.to}];
  stream.last = origin;
  if (!stream.messages) {
    begin(stream, bytes);
    return;
  }
  const Place place = place_of(origin, Transport::tcp);
  waiting_bytes_ -= stream.messages->unread();
  if (bytes.lost_before > 0) {
    stream.messages->skip(place, bytes.lost_before, sink_);
  }
  stream.messages->add(place, bytes.bytes, sink_);
  waiting_bytes_ += stream.messages->unread();
  if (waiting_bytes_ > max_waiting_bytes) {
    close(stream);
    stream.foreign = true;
  }
}

/// Takes bytes of a stream that has not been recognised as SOME/IP so far.
void CaptureReader::begin(Stream& stream, const pcaps::StreamBytes& bytes) {
  const Endpoint& from = stream.last.from;
  const Endpoint& to = stream.last.to;
  const bool known = ports_.known(Transport::tcp, from, to);
  if (stream.foreign && !known) {
    return;
  }
  if (bytes.lost_before > 0) {
    stream.front.clear();
  }
  if (stream.front.empty()) {
    stream.front_offset = bytes.offset;
  }
  stream.front.insert(stream.front.end(), bytes.bytes.begin(), bytes.bytes.end());
  if (!known) {
    if (stream.front.size() < someip::header_bytes) {
      return;  // too few bytes to decide
    }
    if (!SomeipPorts::may_guess(from, to) || !looks_like_header(stream.front, max_stream_length)) {
      stream.foreign = true;
      stream.front.clear();
      return;
    }
  }
  stream.foreign = false;
  stream.messages.emplace(bytes.from_start && stream.front_offset == 0, stream.front_offset);
  stream.messages->add(place_of(stream.last, Transport::tcp), stream.front, sink_);
  waiting_bytes_ += stream.messages->unread();
  stream.front.clear();
}

void CaptureReader::on_stream_closed(const pcaps::Origin& origin) {
  const auto found = streams_.find({origin.from, origin.to});
  if (found != streams_.end()) {
    close(found->second);
    streams_.erase(found);
  }
}

void CaptureReader::on_broken_frame(const pcaps::Origin& origin, const pcaps::FrameError& error) {
  sink_.broken_frame({.frame = origin.frame, .time = origin.time},
                     {to_string(error.fault), "", error.offset, "the frame is damaged below SOME/IP"});
}

void CaptureReader::finish() {
  for (auto& [flow, stream] : streams_) {
    close(stream);
  }
  streams_.clear();
}

void CaptureReader::close(Stream& stream) {
  if (stream.messages) {
    stream.messages->finish(place_of(stream.last, Transport::tcp), sink_);
    waiting_bytes_ -= stream.messages->unread();
    stream.messages.reset();
  } else {
    ++foreign_streams_;
  }
}

}  // namespace trestle::traffic
