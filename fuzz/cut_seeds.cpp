// cut_seeds SEEDS CAPTURES...: cuts the inputs that fuzz targets begin with from recorded traffic, which it
// looks for in the folders CAPTURES. There is a folder of files for each target: SEEDS/header, SEEDS/tp,
// SEEDS/stream, SEEDS/sd_message, SEEDS/sd_machine, SEEDS/e2e, SEEDS/decode, SEEDS/pcap_frames.
#include <algorithm>
#include <array>
#include <cstdio>
#include <map>

#include "fuzz/sd_conversation.hpp"
#include "fuzz/seeds.hpp"
#include "pcaps/capture_file.hpp"
#include "pcaps/traffic.hpp"
#include "sd/wire/message.hpp"
#include "someip/wire/tp.hpp"

using namespace trestle;
using namespace trestle::fuzz;
namespace fs = std::filesystem;

namespace {

using Direction = std::pair<Endpoint, Endpoint>;  // from, to

/// Messages of one kind differ only in what a fuzzer changes at once itself: sessions and contents.
std::string kind_of(ByteView message) {
  std::string kind = as_text(message.first(std::min<std::size_t>(message.size(), 8)));
  if (message.size() >= someip::header_bytes) {
    kind += as_text(message.subspan(12, 4));
  }
  const auto decoded = someip::decode(message);
  if (decoded && sd::is_sd(decoded->header)) {
    kind += as_text(decoded->payload);
  }
  return kind;
}

/// Collects TCP directions as stream.cpp reads them, cut as they were recorded.
class StreamCutter {
 public:
  explicit StreamCutter(const fs::path& folder) : seeds_{folder, "stream"} {}

  void add(const Direction& direction, ByteView bytes) {
    Recorded& recorded = open_[direction];
    const std::size_t room = max_stream_bytes - recorded.bytes.size();
    const ByteView taken = bytes.first(std::min(bytes.size(), room));
    // Every other chunk is received straight into the parser's buffer.
    if (!taken.empty() && recorded.cuts.size() < max_cuts) {
      const auto size = std::min<std::size_t>(taken.size(), 0x7f);
      recorded.cuts.put(static_cast<std::uint8_t>(size | (recorded.cuts.size() % 2 != 0 ? 0x80U : 0U)));
    }
    recorded.bytes.put(taken);
  }
  void close(const Direction& direction) {
    if (const auto found = open_.find(direction); found != open_.end()) {
      write(found->second);
      open_.erase(found);
    }
  }
  void end_capture() {
    for (const auto& [direction, recorded] : open_) {
      write(recorded);
    }
    open_.clear();
  }
  [[nodiscard]] std::size_t seeds() const { return seeds_.size(); }

 private:
  static constexpr std::size_t max_cuts = 255;
  static constexpr std::size_t max_stream_bytes = 2048;
  struct Recorded {
    Input cuts;
    Input bytes;
  };

  void write(const Recorded& recorded) {
    Input input;
    input.put(static_cast<std::uint8_t>(recorded.cuts.size()));
    input.put(recorded.cuts.bytes());
    input.put(recorded.bytes.bytes());
    seeds_.add(as_text(recorded.cuts.bytes()) + kind_of(recorded.bytes.bytes()), input.bytes());
  }

  Seeds seeds_;
  std::map<Direction, Recorded> open_;
};

/// Messages that tell by their length field that E2E profile 4 or 7 protects them, with the configuration
/// that they pass, as e2e.cpp reads it. Of the other profiles a recording does not show enough.
class E2eCutter {
 public:
  explicit E2eCutter(const fs::path& folder) : seeds_{folder, "e2e"} {}

  void add(ByteView bytes, const someip::Message& message) {
    const ByteView data = bytes.first(message.size()).subspan(front_bytes);
    const ByteView payload = message.payload;
    if (payload.size() >= 12 && someip::load<std::uint16_t>(payload.data()) == data.size()) {
      add(2, someip::load<std::uint32_t>(payload.data() + 4), 4096 * 8, data);
    } else if (payload.size() >= 20 && someip::load<std::uint32_t>(payload.data() + 8) == data.size()) {
      add(6, someip::load<std::uint32_t>(payload.data() + 16), 0xfffffff8, data);
    }
  }
  [[nodiscard]] std::size_t seeds() const { return seeds_.size(); }

 private:
  static constexpr std::size_t front_bytes = 8;  // E2E covers a message from the Request ID on

  /// @param profile  place in e2e::Config
  void add(std::uint8_t profile, std::uint32_t data_id, std::uint32_t max_data_bits, ByteView data) {
    Input input;
    input.put(profile);
    input.put(data_id);
    input.put(std::uint16_t{64});  // offset: behind the rest of the SOME/IP header
    input.put(std::uint16_t{0});   // least size
    input.put(max_data_bits);
    input.put(std::uint32_t{1});  // largest step of the counter
    constexpr std::array<std::uint8_t, 11> windows{2, 3, 3, 3, 2, 1, 2, 1, 2, 1, 0};
    input.put(std::as_bytes(std::span{windows}));
    input.put(std::uint16_t{0});   // method: request, ok
    input.put(std::uint32_t{0});   // source
    input.put(std::uint32_t{0});   // counter
    input.put(std::uint8_t{8});    // the half header that comes before the payload is checked apart
    input.put(std::uint32_t{77});  // the bit that is flipped
    input.put(data);
    seeds_.add(input.bytes());
  }

  Seeds seeds_;
};

class Cutter : public pcaps::TrafficSink {
 public:
  explicit Cutter(const fs::path& folder)
      : header_{folder, "header"},
        tp_{folder, "tp"},
        sd_{folder, "sd_message"},
        decode_{folder, "decode"},
        conversation_{folder},
        streams_{folder},
        e2e_{folder} {}

  void on_datagram(const pcaps::Origin& origin, ByteView payload, std::size_t) override {
    header_.add(kind_of(payload), payload);
    decode_.add(kind_of(payload), payload);
    someip::MessageCursor cursor{payload};
    for (std::size_t at = 0; const auto message = cursor.next(); at += message->size()) {
      if (sd::is_sd(message->header)) {
        sd_.add(message->payload);
        conversation_.add(origin, *message);
      } else {
        add_segment(*message);
        e2e_.add(payload.subspan(at), *message);
      }
    }
  }
  void on_stream(const pcaps::Origin& origin, const pcaps::StreamBytes& stream) override {
    header_.add(kind_of(stream.bytes), stream.bytes);
    decode_.add(kind_of(stream.bytes), stream.bytes);
    streams_.add({origin.from, origin.to}, stream.bytes);
  }
  void on_stream_closed(const pcaps::Origin& origin) override { streams_.close({origin.from, origin.to}); }
  void on_broken_frame(const pcaps::Origin&, const pcaps::FrameError&) override {}

  void end_capture() {
    conversation_.end_capture();
    streams_.end_capture();
    segments_.clear();
  }
  [[nodiscard]] std::size_t seeds() const {
    return header_.size() + tp_.size() + sd_.size() + decode_.size() + conversation_.seeds() +
           streams_.seeds() + e2e_.seeds();
  }

 private:
  /// The TP target's records (see tp.cpp) keep the shape of a recorded message, in segments of 32 bytes.
  void add_segment(const someip::Message& message) {
    const auto segment = someip::decode_tp(message);
    if (!segment) {
      return;
    }
    constexpr std::size_t record_bytes = 8;
    constexpr std::size_t unit_of_segment = 2;  // 32 bytes
    const std::size_t offset = unit_of_segment * (segments_.size() / record_bytes);
    segments_.put(static_cast<std::uint8_t>((value(message.header.session) & 3U) << 4U));
    segments_.put(static_cast<std::uint8_t>(segment->header.more ? 1 : 0));
    segments_.put(static_cast<std::uint16_t>(offset));
    segments_.put(static_cast<std::uint16_t>(segment->header.more ? 32 : segment->slice.size() % 32));
    segments_.put(std::uint8_t{1});
    segments_.put(std::uint8_t{7});
    if (!segment->header.more) {
      tp_.add(segments_.bytes());
      segments_.clear();
    }
  }

  Seeds header_;
  Seeds tp_;
  Seeds sd_;
  Seeds decode_;
  SdConversation conversation_;
  StreamCutter streams_;
  E2eCutter e2e_;
  Input segments_;
};

/// Collects frames as pcap_frames.cpp reads them.
class FrameCutter {
 public:
  explicit FrameCutter(const fs::path& folder) : seeds_{folder, "pcap_frames"} {}

  void add(const pcaps::Frame& frame) {
    constexpr std::size_t record_bytes = 4;
    if (frames_.size() + record_bytes + frame.bytes.size() > max_seed_bytes) {
      flush();
    }
    frames_.put(static_cast<std::uint8_t>(frame.link));
    frames_.put(std::uint8_t{0});
    frames_.put(static_cast<std::uint16_t>(frame.bytes.size()));
    frames_.put(frame.bytes);
  }
  /// Ends a seed; of a capture the first few do.
  void flush() {
    if (frames_.size() != 0 && cut_ < seeds_of_a_capture) {
      seeds_.add(std::to_string(seeds_.size()), frames_.bytes());
      ++cut_;
    }
    frames_.clear();
  }
  void end_capture() {
    flush();
    cut_ = 0;
  }
  [[nodiscard]] std::size_t seeds() const { return seeds_.size(); }

 private:
  static constexpr std::size_t seeds_of_a_capture = 8;
  Seeds seeds_;
  Input frames_;
  std::size_t cut_ = 0;
};

std::set<fs::path> captures_in(const std::vector<fs::path>& folders) {
  std::set<fs::path> captures;
  for (const fs::path& folder : folders) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator{folder}) {
      const fs::path extension = entry.path().extension();
      if (extension == ".pcap" || extension == ".pcapng") {
        captures.insert(entry.path());
      }
    }
  }
  return captures;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: cut_seeds SEEDS CAPTURES...\n");
    return 2;
  }
  try {
    const std::set<fs::path> captures = captures_in({argv + 2, argv + argc});
    Cutter cutter{argv[1]};
    FrameCutter frames{argv[1]};
    for (const fs::path& path : captures) {
      pcaps::CaptureFile file{path.string()};
      pcaps::Traffic traffic{cutter};
      while (const auto frame = file.next()) {
        traffic.on_frame(*frame);
        frames.add(*frame);
      }
      traffic.finish();
      cutter.end_capture();
      frames.end_capture();
    }
    std::printf("    cut %zu seeds from %zu captures\n", cutter.seeds() + frames.seeds(), captures.size());
    return captures.empty() ? 1 : 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cut_seeds: %s\n", error.what());
    return 1;
  }
}
