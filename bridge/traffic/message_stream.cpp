#include "bridge/traffic/message_stream.hpp"

#include <fmt/format.h>

#include "bridge/traffic/someip_ports.hpp"
#include "someip/wire/bytes.hpp"

namespace trestle::traffic {
namespace {

std::uint32_t length_field(ByteView header) noexcept {
  return someip::load<std::uint32_t>(header.data() + 4);
}

/// While nothing confirms a possible header, this waits for so many bytes behind it.
constexpr std::size_t max_doubt_bytes = std::size_t{64} << 10U;

/// Stricter than looks_like_header(), because in the middle of a stream shifted headers look like headers
/// too.
bool may_begin_here(ByteView bytes) noexcept {
  if (!looks_like_header(bytes, max_stream_length) ||
      length_field(bytes) < someip::length_covered_header_bytes) {
    return false;
  }
  const auto type = someip::without_tp(someip::MessageType{std::to_integer<std::uint8_t>(bytes[14])});
  const bool answer = type == someip::MessageType::response || type == someip::MessageType::error;
  return answer || bytes[15] == std::byte{0};  // only answers have a return code  [feat_req_someip_683]
}

/// Whether the message at the front of `bytes` is followed by another one, or ends with the bytes received so
/// far.
bool is_confirmed(ByteView bytes) noexcept {
  const std::size_t size = std::size_t{someip::length_covered_header_bytes} + length_field(bytes);
  return size == bytes.size() || (size < bytes.size() && may_begin_here(bytes.subspan(size)));
}

}  // namespace

void MessageStream::add(const Place& place, ByteView bytes, MessageSink& sink) {
  unread_.insert(unread_.end(), bytes.begin(), bytes.end());
  std::size_t done = 0;
  while (done < unread_.size()) {
    const ByteView rest = ByteView{unread_}.subspan(done);
    if (!in_step_) {
      done += find_message(place, rest, offset_ + done, sink);
      if (!in_step_) {
        break;
      }
    } else if (const std::size_t size = read_message(place, rest, offset_ + done, sink); size > 0) {
      done += size;
    } else {
      break;
    }
  }
  unread_.erase(unread_.begin(), unread_.begin() + static_cast<std::ptrdiff_t>(done));
  offset_ += done;
}

/// @return how many bytes have been consumed; 0 when more are needed.
std::size_t MessageStream::read_message(const Place& place, ByteView bytes, std::size_t offset,
                                        MessageSink& sink) {
  const someip::Result<someip::Message> message = someip::decode(bytes);
  if (message) {
    sink.message(place, offset, *message);
    return message->size();
  }
  if (message.error() == someip::WireError::bad_length) {
    sink.undecodable(place, offset, bytes.first(someip::header_bytes), message.error());
  } else if (bytes.size() >= someip::header_bytes && length_field(bytes) > max_stream_length) {
    sink.undecodable(place, offset, bytes.first(someip::header_bytes),
                     {"bad_length", "feat_req_someip_77", offset + 4,
                      fmt::format("Length {} is more than {}, the most that is believed", length_field(bytes),
                                  max_stream_length)});
  } else {
    return 0;
  }
  // It is unknown where the next message begins: perhaps right after the Length field.
  in_step_ = false;
  searched_from_ = offset + someip::length_covered_header_bytes;
  return someip::length_covered_header_bytes;
}

/// Searches `bytes` for the beginning of a message; sets in_step_ if it finds one.
/// @return how many bytes to skip because no message begins there.
std::size_t MessageStream::find_message(const Place& place, ByteView bytes, std::size_t offset,
                                        MessageSink& sink) {
  std::optional<std::size_t> doubtful;
  std::size_t at = 0;
  for (; at + someip::header_bytes <= bytes.size(); ++at) {
    const ByteView rest = bytes.subspan(at);
    if (may_begin_here(rest)) {
      in_step_ = is_confirmed(rest);
      if (in_step_) {
        break;
      }
      doubtful = doubtful.value_or(at);
    }
  }
  if (!in_step_ && doubtful) {
    at = *doubtful;
    in_step_ = bytes.size() - at > max_doubt_bytes;
  }
  if (in_step_) {
    report_search(place, offset + at, sink);
  }
  return at;
}

void MessageStream::report_search(const Place& place, std::size_t until, MessageSink& sink) const {
  if (until > searched_from_) {
    sink.undecodable(
        place, searched_from_, {},
        {"out_of_step", "", searched_from_,
         fmt::format("passed over {} bytes in search of the next message", until - searched_from_)});
  }
}

void MessageStream::skip(const Place& place, std::uint64_t lost, MessageSink& sink) {
  const std::size_t gap_at = offset_ + unread_.size();
  sink.undecodable(place, offset_, unread_,
                   {"stream_gap", "", gap_at, fmt::format("the capture lacks the next {} bytes", lost)});
  unread_.clear();
  offset_ = gap_at + lost;
  in_step_ = false;
  searched_from_ = offset_;
}

void MessageStream::finish(const Place& place, MessageSink& sink) const {
  if (!in_step_) {
    report_search(place, offset_ + unread_.size(), sink);
  } else if (!unread_.empty()) {
    sink.undecodable(place, offset_, unread_, someip::WireError::truncated);
  }
}

}  // namespace trestle::traffic
