#pragma once
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "bridge/record/mcap_writer.hpp"
#include "dds_adapter/participant.hpp"
#include "pcaps/frame.hpp"
#include "someip/wire/counters.hpp"

namespace trestle::record {

/// How a recording is kept.
struct RecorderSettings {
  /// A file if it ends in ".mcap"; else a folder, which becomes a bag of rosbag2. Neither is there yet.
  std::filesystem::path to;
  std::filesystem::path pcapng{};  ///< a file for frames; empty: none
  McapSettings mcap{};
  std::uint64_t max_file_bytes = 0;                   ///< then another file begins; 0: never
  std::chrono::nanoseconds max_file_duration{0};      ///< likewise
  std::size_t queue_bytes = std::size_t{256} << 20U;  ///< that wait for the disk at most
  bool waits = false;                           ///< for room in the queue; else what comes then is dropped
  std::chrono::milliseconds flush_after{1000};  ///< a chunk that is not full is written after this time
};

/// What is known of a channel when it begins.
struct ChannelInfo {
  std::string topic{};
  std::string type{};             ///< the name of the schema
  std::string schema_encoding{};  ///< empty: only the name is known
  std::string schema{};
  std::string encoding{};  ///< of messages: "cdr", "someip"
  Texts metadata{};
};

/// What a recording has, and what it lacks, by reason.
struct RecorderCounters {
  std::uint64_t messages = 0;  ///< written
  std::uint64_t bytes = 0;     ///< of their files, and of what is about to be written
  std::uint64_t frames = 0;    ///< written
  std::uint64_t files = 0;
  std::uint64_t queue_full = 0;         ///< messages that came while as many waited as may: a slow disk
  std::uint64_t write_failed = 0;       ///< messages that could not be written: a full disk
  std::uint64_t too_many_channels = 0;  ///< messages of channels beyond 65535
  std::uint64_t frames_queue_full = 0;
  std::uint64_t frames_write_failed = 0;
  template <typename Visit>
  constexpr void for_each_counter(Visit visit) const {
    using enum someip::CounterKind;
    visit("messages", messages, traffic);
    visit("bytes", bytes, traffic);
    visit("frames", frames, traffic);
    visit("files", files, traffic);
    visit("queue_full", queue_full, loss);
    visit("write_failed", write_failed, loss);
    visit("too_many_channels", too_many_channels, loss);
    visit("frames_queue_full", frames_queue_full, loss);
    visit("frames_write_failed", frames_write_failed, loss);
  }

  [[nodiscard]] bool lost_any() const noexcept {
    bool any = false;
    for_each_counter([&](const char* /*name*/, std::uint64_t count, someip::CounterKind kind) {
      any = any || (kind == someip::CounterKind::loss && count > 0);
    });
    return any;
  }
};

/// Writes a recording from a thread of its own, so that nobody who brings messages waits for a disk. All
/// functions may be called from any thread, also from callbacks of DDS.
class Recorder {
 public:
  using Payload = std::variant<dds::Sample, std::vector<std::byte>>;

  /// @throws std::system_error  the first file cannot be made.
  explicit Recorder(RecorderSettings settings);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  /// As finish().
  ~Recorder();

  /// @return nothing: there is no number left for one more.
  [[nodiscard]] std::optional<std::uint16_t> add_channel(const ChannelInfo& info);
  /// Adds a message. What cannot be kept is dropped and counted.
  void add(std::uint16_t channel, LogTime log_time, LogTime publish_time, std::uint32_t sequence,
           Payload payload);
  /// A message of a channel that add_channel() had no number for.
  void drop_without_channel();
  /// What the sources have lost so far, by reason: for the metadata of each file.
  void note_losses(Texts by_reason);
  /// Whether there is a file for frames.
  [[nodiscard]] bool keeps_frames() const noexcept;
  void add(const pcaps::Frame& frame);

  /// Writes all that waits and closes the files. Nothing is taken any more.
  void finish();
  [[nodiscard]] RecorderCounters counters() const;
  /// Why the last one could not be written; empty: all could.
  [[nodiscard]] std::string error() const;
  /// Files of messages so far.
  [[nodiscard]] std::vector<std::string> files() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace trestle::record
