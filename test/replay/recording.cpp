#include "test/replay/recording.hpp"

#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <utility>

#include "pcaps/capture_file.hpp"
#include "pcaps/traffic.hpp"

namespace trestle::test {

namespace {

using Direction = std::pair<Endpoint, Endpoint>;

class Recorder : public pcaps::TrafficSink {
 public:
  explicit Recorder(Recording& recording) : recording_{recording} {}

  void on_datagram(const pcaps::Origin& origin, ByteView payload, std::size_t missing) override {
    if (missing == 0) {
      recording_.datagrams.push_back({now, origin.from, origin.to, {payload.begin(), payload.end()}});
    }
  }
  void on_stream(const pcaps::Origin& origin, const pcaps::StreamBytes& stream) override {
    std::unique_ptr<Stream>& found = streams_[{origin.from, origin.to}];
    if (!found) {
      found = std::make_unique<Stream>();
    }
    found->parser.feed(stream.bytes);
    std::vector<std::byte>& all = recording_.streams[{origin.from, origin.to}];
    all.insert(all.end(), stream.bytes.begin(), stream.bytes.end());
    while (const auto message = found->parser.next()) {
      std::vector<std::byte> bytes(message->size());
      if (someip::encode(message->header, message->payload, bytes)) {
        recording_.stream_messages.push_back({now, origin.from, origin.to, std::move(bytes)});
      }
    }
  }
  void on_stream_closed(const pcaps::Origin& origin) override { streams_.erase({origin.from, origin.to}); }
  void on_broken_frame(const pcaps::Origin& /*origin*/, const pcaps::FrameError& /*error*/) override {}

  void look_for_connection(const pcaps::Frame& frame) {
    const auto packet = find_ip(frame);
    if (!packet || !*packet || (*packet)->protocol != 6 || (*packet)->fragment) {
      return;
    }
    const auto segment = parse_tcp(**packet);
    if (!segment) {
      return;
    }
    const Endpoint from{(*packet)->from, segment->from_port};
    const Endpoint to{(*packet)->to, segment->to_port};
    // The first SYN is the client's; the one that answers it, or repeats it, comes with the pair known.
    if (segment->syn && !open_.contains({from, to}) && !open_.contains({to, from})) {
      open_.insert({from, to});
      recording_.connections.push_back({now, from, to, true});
    } else if (segment->fin || segment->rst) {
      for (const Direction& ends : {Direction{from, to}, Direction{to, from}}) {
        if (open_.erase(ends) != 0) {
          recording_.connections.push_back({now, ends.first, ends.second, false});
        }
      }
    }
  }

  Duration now{};

 private:
  struct Stream {
    std::vector<std::byte> buffer = std::vector<std::byte>(std::size_t{1} << 21U);
    someip::StreamParser parser{buffer};
  };

  Recording& recording_;
  std::map<Direction, std::unique_ptr<Stream>> streams_;
  std::set<Direction> open_;
};

}  // namespace

Recording read_recording(const std::string& path) {
  pcaps::CaptureFile file{path};
  Recording recording;
  Recorder recorder{recording};
  pcaps::Traffic traffic{recorder};
  std::optional<pcaps::Timestamp> first;
  while (const auto frame = file.next()) {
    first = first.value_or(frame->time);
    recorder.now = std::chrono::duration_cast<Duration>(frame->time - *first);
    recorder.look_for_connection(*frame);
    traffic.on_frame(*frame);
  }
  if (!file.error().empty()) {
    throw std::runtime_error{file.error()};
  }
  traffic.finish();
  return recording;
}

}  // namespace trestle::test
