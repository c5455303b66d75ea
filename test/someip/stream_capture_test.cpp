// The TCP streams that vsomeip 3.7.4 recorded of itself; the counts are those of pcaps/vsomeip/README.md,
// which tshark made.
#include <gmock/gmock.h>

#include <map>
#include <utility>

#include "pcaps/capture_file.hpp"
#include "pcaps/traffic.hpp"
#include "someip/core/stream_parser.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/source_dir.hpp"

namespace trestle::someip {
namespace {
using test::covers;

using Streams = std::map<std::pair<Endpoint, Endpoint>, std::vector<std::vector<std::byte>>>;

/// The chunks of each direction, as their segments came.
class Collector : public pcaps::TrafficSink {
 public:
  void on_datagram(const pcaps::Origin&, ByteView, std::size_t) override {}
  void on_stream(const pcaps::Origin& origin, const pcaps::StreamBytes& stream) override {
    EXPECT_EQ(stream.lost_before, 0U);
    streams[{origin.from, origin.to}].emplace_back(stream.bytes.begin(), stream.bytes.end());
  }
  void on_stream_closed(const pcaps::Origin&) override {}
  void on_broken_frame(const pcaps::Origin&, const pcaps::FrameError&) override { ADD_FAILURE(); }

  Streams streams;
};

Streams streams_of(const std::string& name) {
  pcaps::CaptureFile file{test::source_dir() + "/pcaps/vsomeip/" + name};
  Collector collector;
  pcaps::Traffic traffic{collector};
  while (const auto frame = file.next()) {
    traffic.on_frame(*frame);
  }
  traffic.finish();
  return std::move(collector.streams);
}

struct Seen {
  std::map<int, int> types;
  std::uint64_t cookies = 0;
  std::uint64_t lost = 0;
  std::uint64_t unfinished = 0;
  std::vector<std::string> messages;
};

void parse(const std::vector<std::vector<std::byte>>& chunks, std::size_t buffer_bytes, Seen& seen) {
  std::vector<std::byte> buffer(buffer_bytes);
  StreamParser parser{buffer};
  for (const auto& chunk : chunks) {
    parser.feed(chunk);
    while (const auto message = parser.next()) {
      ++seen.types[static_cast<int>(message->header.type)];
      seen.messages.push_back(test::to_hex(message->payload));
    }
  }
  seen.cookies += parser.counters().cookies;
  seen.lost += parser.lost() ? 1 : 0;
  seen.unfinished += parser.in_message() ? 1 : 0;
}

Seen seen_in(const Streams& streams, std::size_t buffer_bytes = 1U << 20U) {
  Seen seen;
  for (const auto& [ends, chunks] : streams) {
    parse(chunks, buffer_bytes, seen);
  }
  return seen;
}

using Types = std::map<int, int>;

TEST(StreamCaptures, HoldTheMessagesThatWiresharkSees) {
  covers({"feat_req_someip_585", "feat_req_someip_702"});
  const auto check = [](const char* name, const Types& types, std::uint64_t cookies) {
    const Seen seen = seen_in(streams_of(name));
    EXPECT_EQ(seen.types, types) << name;
    EXPECT_EQ(seen.cookies, cookies) << name;
    EXPECT_EQ(seen.lost, 0U) << name;
    EXPECT_EQ(seen.unfinished, 0U) << name;
  };
  check("rr_tcp.pcap", {{0x00, 16}, {0x80, 16}}, 0);
  check("rr_tcp_magic_cookies.pcap", {{0x00, 6}, {0x80, 6}}, 2);
  check("sd_subscribe_tcp_events.pcap", {{0x02, 7}}, 0);
}

TEST(StreamCaptures, GiveTheSameMessagesInPiecesOfAnySize) {
  covers({"feat_req_someip_664"});
  const Streams streams = streams_of("rr_tcp.pcap");
  const Seen whole = seen_in(streams);
  for (const std::size_t step : {1U, 2U, 7U, 16U, 17U, 1000U, 65536U}) {
    Seen seen;
    for (const auto& [ends, chunks] : streams) {
      std::vector<std::byte> all;
      for (const auto& chunk : chunks) {
        all.insert(all.end(), chunk.begin(), chunk.end());
      }
      std::vector<std::vector<std::byte>> pieces;
      for (std::size_t at = 0; at < all.size(); at += step) {
        const ByteView piece = ByteView{all}.subspan(at, std::min(step, all.size() - at));
        pieces.emplace_back(piece.begin(), piece.end());
      }
      parse(pieces, 1U << 20U, seen);
    }
    EXPECT_EQ(seen.messages, whole.messages) << "pieces of " << step;
  }
}

}  // namespace
}  // namespace trestle::someip
