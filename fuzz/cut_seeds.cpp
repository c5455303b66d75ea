// cut_seeds CAPTURES SEEDS: cuts the inputs that fuzz targets begin with from recorded traffic, a folder of
// files for each target: SEEDS/header, SEEDS/tp, SEEDS/sd_message, SEEDS/decode, SEEDS/pcap_frames.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <set>

#include "pcaps/capture_file.hpp"
#include "pcaps/traffic.hpp"
#include "sd/wire/message.hpp"
#include "someip/wire/bytes.hpp"
#include "someip/wire/tp.hpp"

using namespace trestle;
namespace fs = std::filesystem;

namespace {

constexpr std::size_t max_seed_bytes = 4096;
constexpr std::size_t max_seeds = 400;  // of a target

/// The seeds of one target, in its folder.
class Seeds {
 public:
  Seeds(const fs::path& folder, const char* target) : folder_{folder / target} {
    fs::create_directories(folder_);
  }

  /// Writes a seed unless one of the same kind is there.
  void add(const std::string& kind, ByteView bytes) {
    if (bytes.size() > max_seed_bytes || kinds_.size() >= max_seeds || !kinds_.insert(kind).second) {
      return;
    }
    std::ofstream file{folder_ / std::to_string(kinds_.size()), std::ios::binary};
    for (const std::byte byte : bytes) {
      file.put(static_cast<char>(byte));
    }
  }
  [[nodiscard]] std::size_t size() const { return kinds_.size(); }

 private:
  fs::path folder_;
  std::set<std::string> kinds_;
};

/// Messages of one kind differ only in what a fuzzer changes at once itself: sessions and contents.
std::string kind_of(ByteView message) {
  std::string kind;
  const auto add = [&](ByteView bytes) {
    for (const std::byte byte : bytes) {
      kind += static_cast<char>(byte);
    }
  };
  add(message.first(std::min<std::size_t>(message.size(), 8)));
  if (message.size() >= someip::header_bytes) {
    add(message.subspan(12, 4));
  }
  const auto decoded = someip::decode(message);
  if (decoded && sd::is_sd(decoded->header)) {
    add(decoded->payload);
  }
  return kind;
}

class Cutter : public pcaps::TrafficSink {
 public:
  explicit Cutter(const fs::path& folder)
      : header_{folder, "header"}, tp_{folder, "tp"}, sd_{folder, "sd_message"}, decode_{folder, "decode"} {}

  void on_datagram(const pcaps::Origin&, ByteView payload, std::size_t) override {
    header_.add(kind_of(payload), payload);
    decode_.add(kind_of(payload), payload);
    for (someip::MessageCursor cursor{payload}; const auto message = cursor.next();) {
      if (sd::is_sd(message->header)) {
        sd_.add(std::string{reinterpret_cast<const char*>(message->payload.data()), message->payload.size()},
                message->payload);
      }
      add_segment(*message);
    }
  }
  void on_stream(const pcaps::Origin&, const pcaps::StreamBytes& stream) override {
    header_.add(kind_of(stream.bytes), stream.bytes);
    decode_.add(kind_of(stream.bytes), stream.bytes);
  }
  void on_stream_closed(const pcaps::Origin&) override {}
  void on_broken_frame(const pcaps::Origin&, const pcaps::FrameError&) override {}

  [[nodiscard]] std::size_t seeds() const {
    return header_.size() + tp_.size() + sd_.size() + decode_.size();
  }

 private:
  /// The TP target's records (see tp.cpp) keep the shape of a recorded message, in segments of 32 bytes.
  void add_segment(const someip::Message& message) {
    const auto segment = someip::decode_tp(message);
    if (!segment) {
      return;
    }
    constexpr std::size_t record_bytes = 8;
    constexpr std::uint8_t unit_of_segment = 2;  // 32 bytes
    std::array<std::byte, record_bytes> record{};
    someip::ByteWriter out{record};
    out.u8(static_cast<std::uint8_t>((value(message.header.session) & 3U) << 4U));
    out.u8(segment->header.more ? 1 : 0);
    out.u16(static_cast<std::uint16_t>(unit_of_segment * (conversation_.size() / record_bytes)));
    out.u16(segment->header.more ? 32 : static_cast<std::uint16_t>(segment->slice.size() % 32));
    out.u8(1);
    out.u8(7);
    conversation_.insert(conversation_.end(), record.begin(), record.end());
    if (!segment->header.more) {
      tp_.add({reinterpret_cast<const char*>(conversation_.data()), conversation_.size()}, conversation_);
      conversation_.clear();
    }
  }

  Seeds header_;
  Seeds tp_;
  Seeds sd_;
  Seeds decode_;
  std::vector<std::byte> conversation_;
};

/// Collects frames as pcap_frames.cpp reads them.
class FrameCutter {
 public:
  explicit FrameCutter(const fs::path& folder) : seeds_{folder, "pcap_frames"} {}

  void add(const pcaps::Frame& frame) {
    std::array<std::byte, 4> record{};
    record[0] = static_cast<std::byte>(frame.link);
    someip::store(record.data() + 2, static_cast<std::uint16_t>(frame.bytes.size()));
    if (frames_.size() + record.size() + frame.bytes.size() > max_seed_bytes) {
      flush();
    }
    frames_.insert(frames_.end(), record.begin(), record.end());
    frames_.insert(frames_.end(), frame.bytes.begin(), frame.bytes.end());
  }
  /// Ends a seed; of a capture the first few do.
  void flush() {
    if (!frames_.empty() && cut_ < seeds_of_a_capture) {
      seeds_.add(std::to_string(seeds_.size()), frames_);
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
  std::vector<std::byte> frames_;
  std::size_t cut_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: cut_seeds CAPTURES SEEDS\n");
    return 2;
  }
  try {
    std::set<fs::path> captures;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator{argv[1]}) {
      if (entry.path().extension() == ".pcap" || entry.path().extension() == ".pcapng") {
        captures.insert(entry.path());
      }
    }
    Cutter cutter{argv[2]};
    FrameCutter frames{argv[2]};
    for (const fs::path& path : captures) {
      pcaps::CaptureFile file{path.string()};
      pcaps::Traffic traffic{cutter};
      while (const auto frame = file.next()) {
        traffic.on_frame(*frame);
        frames.add(*frame);
      }
      traffic.finish();
      frames.end_capture();
    }
    std::printf("    cut %zu seeds from %zu captures\n", cutter.seeds() + frames.seeds(), captures.size());
    return captures.empty() ? 1 : 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cut_seeds: %s\n", error.what());
    return 1;
  }
}
