#include "bridge/decode/capture_decoder.hpp"

#include <fmt/format.h>

#include "someip/net/address_text.hpp"
#include "someip/wire/bytes.hpp"

namespace trestle::bridge {
namespace {

constexpr std::uint32_t max_datagram_length = 0xffff;
/// In torn messages of all TCP streams together; the stream that goes beyond is given up.
constexpr std::size_t max_waiting_bytes = std::size_t{256} << 20U;

/// "2026-11-21T01:39:25.522395000Z"
std::string timestamp(pcaps::Timestamp time) {
  const auto day = std::chrono::floor<std::chrono::days>(time);
  const std::chrono::year_month_day date{day};
  const std::chrono::hh_mm_ss clock{time - day};
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{:09}Z", static_cast<int>(date.year()),
                     static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
                     clock.hours().count(), clock.minutes().count(), clock.seconds().count(),
                     clock.subseconds().count());
}

Json origin_fields(const pcaps::Origin& origin) {
  Json fields;
  fields["frame"] = origin.frame;
  fields["time"] = timestamp(origin.time);
  return fields;
}

Place place_of(const pcaps::Origin& origin, const char* transport, std::size_t missing = 0) {
  Json fields = origin_fields(origin);
  fields["src"] = someip::to_string(origin.from);
  fields["dst"] = someip::to_string(origin.to);
  fields["transport"] = transport;
  return {std::move(fields), {origin.from, origin.to}, TimePoint{origin.time.time_since_epoch()}, missing};
}

bool has_sd_id(ByteView bytes) noexcept {
  return bytes.size() >= 4 && someip::load<std::uint32_t>(bytes.data()) == 0xffff'8100;
}

}  // namespace

CaptureDecoder::CaptureDecoder(const Options& options, std::function<void(const Json&)> print)
    : ports_{options.ports},
      messages_{options.reassemble, {std::move(print), [this](Transport transport, const Endpoint& endpoint) {
                                       ports_.learn(transport, endpoint);
                                     }}} {}

void CaptureDecoder::on_datagram(const pcaps::Origin& origin, ByteView payload, std::size_t missing) {
  const bool known = ports_.known(Transport::udp, origin.from, origin.to);
  const bool looks = SomeipPorts::may_guess(origin.from, origin.to) &&
                     (has_sd_id(payload) || looks_like_header(payload, max_datagram_length));
  if (!known && !looks) {
    ++foreign_datagrams_;
    return;
  }
  const bool well_formed = messages_.datagram(place_of(origin, "udp", missing), payload);
  if (!known && well_formed) {
    ports_.learn(Transport::udp, origin.from);
    ports_.learn(Transport::udp, origin.to);
  }
}

void CaptureDecoder::on_stream(const pcaps::Origin& origin, const pcaps::StreamBytes& bytes) {
  Stream& stream = streams_[{origin.from, origin.to}];
  stream.last = origin;
  if (!stream.messages) {
    begin(stream, bytes);
    return;
  }
  const Place place = place_of(origin, "tcp");
  waiting_bytes_ -= stream.messages->unread();
  if (bytes.lost_before > 0) {
    stream.messages->skip(place, bytes.lost_before, messages_);
  }
  stream.messages->add(place, bytes.bytes, messages_);
  waiting_bytes_ += stream.messages->unread();
  if (waiting_bytes_ > max_waiting_bytes) {
    close(stream);
    stream.foreign = true;
  }
}

/// Takes bytes of a stream that was not taken for SOME/IP so far.
void CaptureDecoder::begin(Stream& stream, const pcaps::StreamBytes& bytes) {
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
      return;  // too few to tell
    }
    if (!SomeipPorts::may_guess(from, to) || !looks_like_header(stream.front, max_stream_length)) {
      stream.foreign = true;
      stream.front.clear();
      return;
    }
  }
  stream.foreign = false;
  stream.messages.emplace(bytes.from_start && stream.front_offset == 0, stream.front_offset);
  stream.messages->add(place_of(stream.last, "tcp"), stream.front, messages_);
  waiting_bytes_ += stream.messages->unread();
  stream.front.clear();
}

void CaptureDecoder::on_stream_closed(const pcaps::Origin& origin) {
  const auto found = streams_.find({origin.from, origin.to});
  if (found != streams_.end()) {
    close(found->second);
    streams_.erase(found);
  }
}

void CaptureDecoder::on_broken_frame(const pcaps::Origin& origin, const pcaps::FrameError& error) {
  messages_.unreadable(origin_fields(origin),
                       {to_string(error.fault), "", error.offset, "the frame is damaged below SOME/IP"});
}

void CaptureDecoder::finish() {
  for (auto& [flow, stream] : streams_) {
    close(stream);
  }
  streams_.clear();
}

void CaptureDecoder::close(Stream& stream) {
  if (stream.messages) {
    stream.messages->finish(place_of(stream.last, "tcp"), messages_);
    waiting_bytes_ -= stream.messages->unread();
    stream.messages.reset();
  } else {
    ++foreign_streams_;
  }
}

}  // namespace trestle::bridge
