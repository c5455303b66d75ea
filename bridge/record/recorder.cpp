#include "bridge/record/recorder.hpp"

#include <fmt/format.h>

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "bridge/documents/replace_file.hpp"
#include "bridge/record/bag_metadata.hpp"
#include "bridge/record/mcap_fields.hpp"
#include "bridge/record/pcapng_writer.hpp"

namespace trestle::record {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// What a message takes beside its bytes, so that empty ones do not fill the memory.
constexpr std::size_t bytes_of_entry = 128;
/// How long after a file could not be made it is tried again.
constexpr std::chrono::seconds try_again{1};

/// A frame that waits.
struct OwnFrame {
  pcaps::Frame frame{};
  std::vector<std::byte> bytes{};
};

struct Waiting {
  Entry entry{};  ///< without data
  std::variant<dds::Sample, std::vector<std::byte>, OwnFrame> payload{};

  [[nodiscard]] ByteView data() const {
    if (const auto* const sample = std::get_if<dds::Sample>(&payload)) {
      return sample->cdr();
    }
    if (const auto* const frame = std::get_if<OwnFrame>(&payload)) {
      return frame->bytes;
    }
    return std::get<std::vector<std::byte>>(payload);
  }
  [[nodiscard]] bool is_frame() const { return std::holds_alternative<OwnFrame>(payload); }
};

}  // namespace

struct Recorder::State {
  explicit State(RecorderSettings given) : settings{std::move(given)} {
    is_bag = settings.to.extension() != ".mcap";
    // Not the folders above it: one that has vanished may be a disk that is not there now.
    if (is_bag && !fs::create_directory(settings.to)) {
      throw std::system_error{std::make_error_code(std::errc::file_exists),
                              "cannot make " + settings.to.string()};
    }
    open_file();
    thread = std::thread{[this] { work(); }};
  }

  // Callers.

  /// @return whether it was taken.
  bool put(Waiting waiting) {
    const std::size_t bytes = waiting.data().size() + bytes_of_entry;
    std::unique_lock lock{mutex};
    if (settings.waits) {
      has_room.wait(
          lock, [&] { return is_over || queued_bytes == 0 || queued_bytes + bytes <= settings.queue_bytes; });
    }
    if (is_over || (queued_bytes > 0 && queued_bytes + bytes > settings.queue_bytes)) {
      ++(waiting.is_frame() ? counters.frames_queue_full : counters.queue_full);
      lock.unlock();  // a sample goes back to DDS, which may hold locks of its own in a callback
      return false;
    }
    queued_bytes += bytes;
    queue.push_back(std::move(waiting));
    lock.unlock();
    has_work.notify_one();
    return true;
  }

  // The thread.

  void work() {
    std::unique_lock lock{mutex};
    for (;;) {
      const auto ready = [&] { return is_over || !queue.empty(); };
      if (flush_at) {
        has_work.wait_until(lock, *flush_at, ready);
      } else {
        has_work.wait(lock, ready);
      }
      if (queue.empty() && is_over) {
        break;
      }
      if (queue.empty()) {
        lock.unlock();
        flush();
        lock.lock();
        continue;
      }
      Waiting one = std::move(queue.front());
      queue.pop_front();
      lock.unlock();
      const std::size_t bytes = one.data().size() + bytes_of_entry;
      write(one);
      one = {};  // what is on loan goes back before its room is given to others, and without the lock
      if (flush_at && Clock::now() >= *flush_at) {
        flush();
      }
      lock.lock();
      queued_bytes -= bytes;
      has_room.notify_one();
    }
    lock.unlock();
    close_file();
    if (frames) {
      note(frames->flush());
    }
    count();
  }

  void write(const Waiting& one) {
    if (!flush_at) {
      flush_at = Clock::now() + settings.flush_after;
    }
    if (one.is_frame()) {
      write_frame(std::get<OwnFrame>(one.payload));
      return;
    }
    Entry entry = one.entry;
    entry.data = one.data();
    if (file && is_full(entry)) {
      close_file();
    }
    if (!file && !try_open()) {
      const std::lock_guard lock{mutex};
      ++counters.write_failed;
      return;
    }
    add_definitions();
    if (file_start == 0) {
      file_start = entry.log_time;
    }
    note(file->write(entry));
    count();
  }

  [[nodiscard]] bool is_full(const Entry& entry) const {
    if (file->written().messages + file->pending() == 0) {
      return false;
    }
    const auto age = static_cast<std::uint64_t>(settings.max_file_duration.count());
    return (settings.max_file_bytes > 0 && file->bytes() + entry.data.size() > settings.max_file_bytes) ||
           (age > 0 && entry.log_time >= file_start + age);
  }

  void write_frame(const OwnFrame& own) {
    pcaps::Frame frame = own.frame;
    frame.bytes = own.bytes;
    if (!frames) {
      const auto now = Clock::now();
      if (now < frames_again) {
        const std::lock_guard lock{mutex};
        ++counters.frames_write_failed;
        return;
      }
      try {
        frames.emplace(settings.pcapng.string(), frame.link);
      } catch (const std::system_error& error) {
        frames_again = now + try_again;
        const std::lock_guard lock{mutex};
        ++counters.frames_write_failed;
        last_error = error.what();
        return;
      }
    }
    note(frames->write(frame));
    count();
  }

  void flush() {
    flush_at.reset();
    if (file) {
      note(file->flush());
    }
    if (frames) {
      note(frames->flush());
    }
    count();
  }

  void note(const std::error_code& error) {
    if (error) {
      note(error.message());
    }
  }
  void note(std::string why) {
    const std::lock_guard lock{mutex};
    last_error = std::move(why);
  }

  /// Takes over what the writers count.
  void count() {
    const std::lock_guard lock{mutex};
    counters.messages = past_messages + (file ? file->written().messages : 0);
    counters.bytes = past_bytes + (file ? file->bytes() : 0);
    counters.write_failed += file ? file->lost() - counted_lost : 0;
    counted_lost = file ? file->lost() : 0;
    if (frames) {
      counters.frames = frames->frames();
      counters.frames_write_failed += frames->lost() - counted_lost_frames;
      counted_lost_frames = frames->lost();
    }
  }

  // Files.

  [[nodiscard]] fs::path path_of(std::size_t number) const {
    if (is_bag) {
      const fs::path name = fs::absolute(settings.to).lexically_normal();
      const std::string stem = (name.has_filename() ? name : name.parent_path()).filename().string();
      return settings.to / fmt::format("{}_{}.mcap", stem, number);
    }
    return number == 0
               ? settings.to
               : settings.to.parent_path() / fmt::format("{}_{}.mcap", settings.to.stem().string(), number);
  }

  void open_file() {
    file = std::make_unique<McapWriter>(path_of(made_files).string(), settings.mcap);
    ++made_files;
    defined_schemas = 0;
    defined_channels = 0;
    counted_lost = 0;
    file_start = 0;
    {
      const std::lock_guard lock{mutex};
      counters.files = made_files;
      paths.push_back(file->path());
    }
  }

  bool try_open() {
    const auto now = Clock::now();
    if (now < open_again) {
      return false;
    }
    try {
      open_file();
      return true;
    } catch (const std::system_error& error) {
      open_again = now + try_again;
      note(error.code());
      return false;
    }
  }

  /// What others have lost, and the recorder itself, stands in each file.
  void close_file() {
    if (!file) {
      return;
    }
    note(file->flush());
    count();
    Texts texts;
    {
      const std::lock_guard lock{mutex};
      texts = lost_elsewhere;
      texts.emplace("messages", std::to_string(counters.messages));
      counters.for_each_counter([&](const char* name, std::uint64_t count, someip::CounterKind kind) {
        if (kind == someip::CounterKind::loss) {
          texts.emplace(fmt::format("dropped_{}", name), std::to_string(count));
        }
      });
      if (!last_error.empty()) {
        texts.emplace("error", last_error);
      }
    }
    note(file->add_metadata("trestle", texts));
    // By which rosbag2 knows that quality of service is written in numbers, as before Jazzy.
    note(file->add_metadata("rosbag2", {{"serialized_metadata", ""}}));
    note(file->finish());
    count();
    note_in_bag();
    past_messages += file->written().messages;
    past_bytes += file->bytes();
    file.reset();
    counted_lost = 0;
    write_metadata();
  }

  void note_in_bag() {
    const Statistics& written = file->written();
    BagFile noted{
        .name = fs::path{file->path()}.filename().string(), .start = written.start, .end = written.end};
    const std::lock_guard lock{mutex};
    for (const auto& [id, messages] : written.by_channel) {
      if (channels[id - std::size_t{1}].encoding == "cdr") {
        noted.messages += messages;
      }
      by_channel[id] += messages;
    }
    bag_files.push_back(std::move(noted));
  }

  /// Tells the file of what was added since.
  void add_definitions() {
    const std::lock_guard lock{mutex};
    for (; defined_schemas < schemas.size(); ++defined_schemas) {
      file->add(schemas[defined_schemas]);
    }
    for (; defined_channels < channels.size(); ++defined_channels) {
      file->add(channels[defined_channels]);
    }
  }

  /// After each file that is whole: readers of bags refuse one with a file that is not.
  void write_metadata() {
    if (!is_bag) {
      return;
    }
    std::map<std::pair<std::string, std::string>, BagTopic> topics;
    {
      const std::lock_guard lock{mutex};
      for (const Channel& channel : channels) {
        if (channel.encoding == "cdr") {
          const std::string& type = schemas[channel.schema - std::size_t{1}].name;
          const auto qos = channel.metadata.find("offered_qos_profiles");
          BagTopic& topic = topics[{channel.topic, type}];
          topic = {.name = channel.topic,
                   .type = type,
                   .qos = qos == channel.metadata.end() ? "" : qos->second,
                   .messages = topic.messages + by_channel[channel.id]};
        }
      }
    }
    std::vector<BagTopic> all;
    for (auto& [name, topic] : topics) {
      all.push_back(std::move(topic));
    }
    if (const auto written = documents::replace_file(
            settings.to / "metadata.yaml", bag_metadata(all, bag_files), documents::Outlives::the_program);
        !written) {
      note(written.error());
    }
  }

  const RecorderSettings settings;
  bool is_bag = false;

  mutable std::mutex mutex;
  std::condition_variable has_work;
  std::condition_variable has_room;
  std::deque<Waiting> queue;
  std::size_t queued_bytes = 0;  ///< of these, and of the one that is being written
  bool is_over = false;
  std::vector<Schema> schemas;    ///< with ids from 1
  std::vector<Channel> channels;  ///< likewise
  std::map<std::string, std::uint16_t, std::less<>> schema_ids;
  std::map<std::uint16_t, std::uint64_t> by_channel;  ///< messages of files that are closed
  RecorderCounters counters;
  std::string last_error;
  Texts lost_elsewhere;
  std::vector<std::string> paths;

  // Of the thread alone.
  std::unique_ptr<McapWriter> file;
  std::optional<PcapngWriter> frames;
  std::size_t made_files = 0;
  std::size_t defined_schemas = 0;
  std::size_t defined_channels = 0;
  std::uint64_t counted_lost = 0;
  std::uint64_t counted_lost_frames = 0;
  std::uint64_t past_messages = 0;
  std::uint64_t past_bytes = 0;
  LogTime file_start = 0;
  std::optional<Clock::time_point> flush_at;
  Clock::time_point open_again{};
  Clock::time_point frames_again{};
  std::vector<BagFile> bag_files;
  std::thread thread;
};

Recorder::Recorder(RecorderSettings settings) : state_{std::make_unique<State>(std::move(settings))} {}

Recorder::~Recorder() {
  finish();
}

std::optional<std::uint16_t> Recorder::add_channel(const ChannelInfo& info) {
  const std::lock_guard lock{state_->mutex};
  constexpr std::size_t most = 0xffff;
  const std::string schema = fmt::format("{}\n{}\n{}", info.type, info.schema_encoding, info.schema);
  auto known = state_->schema_ids.find(schema);
  if (state_->channels.size() == most ||
      (known == state_->schema_ids.end() && state_->schemas.size() == most)) {
    return std::nullopt;
  }
  if (known == state_->schema_ids.end()) {
    const auto id = static_cast<std::uint16_t>(state_->schemas.size() + 1);
    state_->schemas.push_back(
        {.id = id, .name = info.type, .encoding = info.schema_encoding, .data = info.schema});
    known = state_->schema_ids.emplace(schema, id).first;
  }
  const auto id = static_cast<std::uint16_t>(state_->channels.size() + 1);
  state_->channels.push_back({.id = id,
                              .schema = known->second,
                              .topic = info.topic,
                              .encoding = info.encoding,
                              .metadata = info.metadata});
  return id;
}

void Recorder::add(std::uint16_t channel, LogTime log_time, LogTime publish_time, std::uint32_t sequence,
                   Payload payload) {
  Waiting waiting{
      .entry = {
          .channel = channel, .sequence = sequence, .log_time = log_time, .publish_time = publish_time}};
  std::visit([&](auto& one) { waiting.payload = std::move(one); }, payload);
  state_->put(std::move(waiting));
}

void Recorder::note_losses(Texts by_reason) {
  const std::lock_guard lock{state_->mutex};
  state_->lost_elsewhere = std::move(by_reason);
}

void Recorder::drop_without_channel() {
  const std::lock_guard lock{state_->mutex};
  ++state_->counters.too_many_channels;
}

bool Recorder::keeps_frames() const noexcept {
  return !state_->settings.pcapng.empty();
}

void Recorder::add(const pcaps::Frame& frame) {
  if (keeps_frames()) {
    state_->put({.payload = OwnFrame{frame, {frame.bytes.begin(), frame.bytes.end()}}});
  }
}

void Recorder::finish() {
  {
    const std::lock_guard lock{state_->mutex};
    state_->is_over = true;
  }
  state_->has_work.notify_one();
  state_->has_room.notify_all();
  if (state_->thread.joinable()) {
    state_->thread.join();
  }
}

RecorderCounters Recorder::counters() const {
  const std::lock_guard lock{state_->mutex};
  return state_->counters;
}
std::string Recorder::error() const {
  const std::lock_guard lock{state_->mutex};
  return state_->last_error;
}

std::vector<std::string> Recorder::files() const {
  const std::lock_guard lock{state_->mutex};
  return state_->paths;
}

}  // namespace trestle::record
