#include "someip/core/stream_parser.hpp"

#include <algorithm>
#include <cassert>
#include <cstring>

#include "someip/core/magic_cookie.hpp"
#include "someip/wire/bytes.hpp"

namespace trestle::someip {
namespace {

constexpr auto client_cookie = magic_cookie(StreamEnd::client);
constexpr auto server_cookie = magic_cookie(StreamEnd::server);

bool is_cookie(const std::byte* bytes) noexcept {
  return std::memcmp(bytes, client_cookie.data(), client_cookie.size()) == 0 ||
         std::memcmp(bytes, server_cookie.data(), server_cookie.size()) == 0;
}

// Where the first cookie begins; nothing if there is none.
std::optional<std::size_t> cookie_in(ByteView bytes) noexcept {
  for (std::size_t at = 0; at + header_bytes <= bytes.size(); ++at) {
    const ByteView starts = bytes.subspan(at, bytes.size() - at - header_bytes + 1);
    const void* const found = std::memchr(starts.data(), 0xff, starts.size());
    if (found == nullptr) {
      return std::nullopt;
    }
    at = static_cast<std::size_t>(static_cast<const std::byte*>(found) - bytes.data());
    if (is_cookie(bytes.data() + at)) {
      return at;
    }
  }
  return std::nullopt;
}

}  // namespace

StreamParser::StreamParser(ByteSpan buffer, std::size_t max_bytes) noexcept
    : buffer_{buffer}, max_bytes_{max_bytes} {
  assert(buffer.size() >= header_bytes);
}

void StreamParser::feed(ByteView chunk) noexcept {
  assert(chunk_.empty() && "next() must have returned nothing before");
  chunk_ = chunk;
}

std::optional<Message> StreamParser::next() noexcept {
  for (;;) {
    if (lost_) {
      find_cookie();
      if (lost_) {
        return std::nullopt;
      }
    }
    std::optional<Message> message;
    if (held_ == 0 && chunk_.size() >= header_bytes) {
      if (!framed(chunk_)) {
        continue;
      }
      if (chunk_.size() < needed_) {
        static_cast<void>(hold(needed_));
        return std::nullopt;
      }
      message = whole(chunk_.first(needed_));
      chunk_ = chunk_.subspan(needed_);
    } else {
      if (needed_ == 0) {
        if (!hold(header_bytes)) {
          return std::nullopt;
        }
        if (!framed(buffer_)) {
          continue;
        }
      }
      if (!hold(needed_)) {
        return std::nullopt;
      }
      message = whole(buffer_.first(needed_));
      held_ = 0;
    }
    needed_ = 0;
    if (message) {
      return message;
    }
  }
}

// The message that fills `bytes`; nothing if it is a cookie.
std::optional<Message> StreamParser::whole(ByteView bytes) noexcept {
  if (bytes.size() == header_bytes && is_cookie(bytes.data())) {
    ++counters_.cookies;
    return std::nullopt;
  }
  ++counters_.messages;
  const Result<Message> message = decode(bytes);
  assert(message);
  return *message;
}

// Notes the size of the message that begins with this header. If that size is impossible, framing is lost.
bool StreamParser::framed(ByteView header) noexcept {
  const auto length = load<std::uint32_t>(header.data() + length_field_at);
  if (length < length_covered_header_bytes) {
    ++counters_.bad_length;
    lost_ = true;
  } else if (length - length_covered_header_bytes > max_bytes_ - header_bytes) {
    ++counters_.too_large;
    lost_ = true;
  } else {
    needed_ = header_bytes + (length - length_covered_header_bytes);
  }
  return !lost_;
}

// Moves bytes from the chunk to the buffer until it holds `until` bytes. False if there were not enough.
bool StreamParser::hold(std::size_t until) noexcept {
  const std::size_t moved = std::min({until - held_, chunk_.size(), buffer_.size() - held_});
  if (moved != 0) {
    std::memcpy(buffer_.data() + held_, chunk_.data(), moved);
    held_ += moved;
    chunk_ = chunk_.subspan(moved);
  }
  return held_ == until;
}

// Skips to the end of the next cookie. Bytes that could be the beginning of a cookie stay in the buffer.
void StreamParser::find_cookie() noexcept {
  constexpr std::size_t most_of_cookie = header_bytes - 1;
  if (held_ != 0) {  // a cookie may lie across the seam: it begins in the buffer and ends in the chunk
    std::array<std::byte, header_bytes + most_of_cookie> seam;
    const std::size_t ahead = std::min(most_of_cookie, chunk_.size());
    std::copy_n(buffer_.begin(), held_, seam.begin());
    std::copy_n(chunk_.begin(), ahead, seam.begin() + static_cast<std::ptrdiff_t>(held_));
    const auto at = cookie_in(ByteView{seam}.first(held_ + ahead));
    if (at) {
      counters_.skipped_bytes += *at;
      chunk_ = chunk_.subspan(*at + header_bytes - held_);
    } else if (ahead < most_of_cookie) {  // the chunk ends within reach of a cookie that began in the buffer
      const std::size_t all = held_ + ahead;
      const std::size_t keep = std::min(most_of_cookie, all);
      counters_.skipped_bytes += all - keep;
      std::copy_n(seam.begin() + static_cast<std::ptrdiff_t>(all - keep), keep, buffer_.begin());
      held_ = keep;
      chunk_ = {};
      return;
    } else {
      counters_.skipped_bytes += held_;
    }
    held_ = 0;
    if (at) {
      lost_ = false;
    }
  }
  if (lost_) {
    const auto at = cookie_in(chunk_);
    const std::size_t keep = std::min(most_of_cookie, chunk_.size());
    const std::size_t skipped = at.value_or(chunk_.size() - keep);
    counters_.skipped_bytes += skipped;
    if (!at) {
      chunk_ = chunk_.subspan(skipped);
      static_cast<void>(hold(keep));
      return;
    }
    chunk_ = chunk_.subspan(skipped + header_bytes);
    lost_ = false;
  }
  ++counters_.cookies;
  ++counters_.resynchronised;
}

ByteSpan StreamParser::missing() const noexcept {
  return lost_ || needed_ == 0 ? ByteSpan{} : buffer_.first(std::min(needed_, buffer_.size())).subspan(held_);
}

std::size_t StreamParser::filled(std::size_t bytes) noexcept {
  const std::size_t direct = std::min(bytes, missing().size());
  held_ += direct;
  return direct;
}

}  // namespace trestle::someip
