// Property: however a TCP stream is cut into chunks, and whether its bytes are fed or received straight into
// the parser's buffer, the parser gives the messages, cookies and losses that a walk over the whole stream
// gives. Chunks and buffer are exactly as large as they say, so the address sanitizer sees every byte beyond.
//
// The first byte of the input tells how many bytes follow that say how the stream is cut; each of those is
// the size of a chunk, with the highest bit set if it is received straight into the buffer. They are used
// over and over. The rest is the stream, in which c0 c1 and c0 c2 stand for cookies: a fuzzer hardly finds
// one by itself.
#include <algorithm>
#include <cstdlib>
#include <vector>

#include "someip/core/magic_cookie.hpp"
#include "someip/core/stream_parser.hpp"

using namespace trestle;
using namespace trestle::someip;

namespace {

constexpr std::size_t buffer_bytes = 64;

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

struct Found {
  std::vector<std::vector<std::byte>> messages;  // header and payload
  StreamCounters counters;
};

bool is_cookie(ByteView bytes) {
  return std::ranges::equal(bytes, magic_cookie(StreamEnd::client)) ||
         std::ranges::equal(bytes, magic_cookie(StreamEnd::server));
}

Found walk(ByteView stream) {
  Found found;
  std::size_t at = 0;
  while (stream.size() - at >= header_bytes) {
    std::size_t length = 0;
    for (std::size_t i = 4; i < 8; ++i) {
      length = length * 256 + std::to_integer<std::size_t>(stream[at + i]);
    }
    if (length >= 8 && length + 8 <= buffer_bytes) {
      if (stream.size() - at < length + 8) {
        break;
      }
      const ByteView message = stream.subspan(at, length + 8);
      if (is_cookie(message)) {
        ++found.counters.cookies;
      } else {
        ++found.counters.messages;
        found.messages.emplace_back(message.begin(), message.end());
      }
      at += length + 8;
      continue;
    }
    ++(length < 8 ? found.counters.bad_length : found.counters.too_large);
    while (stream.size() - at >= header_bytes && !is_cookie(stream.subspan(at, header_bytes))) {
      ++at;
      ++found.counters.skipped_bytes;
    }
    if (stream.size() - at < header_bytes) {
      break;
    }
    at += header_bytes;
    ++found.counters.cookies;
    ++found.counters.resynchronised;
  }
  return found;
}

class Cut {
 public:
  void take(ByteView chunk, bool direct) {
    if (direct) {
      const ByteSpan place = parser_.missing();
      std::copy_n(chunk.begin(), std::min(place.size(), chunk.size()), place.begin());
      chunk = chunk.subspan(parser_.filled(chunk.size()));
      drain();
    }
    const std::vector<std::byte> exact{chunk.begin(), chunk.end()};
    parser_.feed(exact);
    drain();
  }
  void check(const Found& expected) {
    require(found_ == expected.messages);
    require(parser_.counters() == expected.counters);
  }

 private:
  void drain() {
    while (const auto message = parser_.next()) {
      std::vector<std::byte> bytes(message->size());
      require(encode(message->header, message->payload, bytes).has_value());
      found_.push_back(bytes);
    }
    require(!parser_.next());
    require(!parser_.lost() || parser_.missing().empty());
  }

  std::vector<std::byte> buffer_ = std::vector<std::byte>(buffer_bytes);
  StreamParser parser_{buffer_};
  std::vector<std::vector<std::byte>> found_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) {
    return 0;
  }
  const std::size_t cuts = std::min<std::size_t>(data[0], size - 1);
  const std::span<const std::uint8_t> chunk_sizes{data + 1, cuts};
  std::vector<std::byte> stream;
  for (std::size_t i = 1 + cuts; i < size; ++i) {
    if (data[i] == 0xc0 && i + 1 < size && data[i + 1] <= 0xc2 && data[i + 1] >= 0xc1) {
      const auto cookie = magic_cookie(data[i + 1] == 0xc1 ? StreamEnd::client : StreamEnd::server);
      stream.insert(stream.end(), cookie.begin(), cookie.end());
      ++i;
    } else {
      stream.push_back(std::byte{data[i]});
    }
  }
  Cut cut;
  std::size_t at = 0;
  for (std::size_t i = 0; at < stream.size(); ++i) {
    const std::uint8_t how = cuts == 0 ? 0x7f : chunk_sizes[i % cuts];
    const std::size_t bytes =
        std::min<std::size_t>(std::max<std::size_t>(how & 0x7fU, 1), stream.size() - at);
    cut.take(ByteView{stream}.subspan(at, bytes), (how & 0x80U) != 0);
    at += bytes;
  }
  cut.check(walk(stream));
  return 0;
}
