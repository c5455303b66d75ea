#include "bridge/record/mcap_reader.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "bridge/record/compression.hpp"
#include "someip/core/e2e/crc.hpp"

namespace trestle::record {
namespace {

tl::unexpected<McapFault> fault(std::uint64_t offset, std::string field, std::string text) {
  return tl::unexpected{McapFault{offset, std::move(field), std::move(text)}};
}

/// A file that can be read at any place.
class InputFile {
 public:
  explicit InputFile(const std::string& path) : fd_{::open(path.c_str(), O_RDONLY | O_CLOEXEC)} {
    struct stat what {};
    if (fd_ < 0 || ::fstat(fd_, &what) != 0) {
      const int error = errno;
      close();
      throw std::runtime_error{
          fmt::format("cannot read {}: {}", path, std::generic_category().message(error))};
    }
    if (!S_ISREG(what.st_mode)) {
      close();
      throw std::runtime_error{fmt::format("cannot read {}: it is no file", path)};
    }
    size_ = static_cast<std::uint64_t>(what.st_size);
  }
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;
  ~InputFile() { close(); }

  [[nodiscard]] std::uint64_t size() const noexcept { return size_; }
  /// @return whether so many bytes are there.
  [[nodiscard]] bool read(std::uint64_t offset, ByteSpan into) const {
    while (!into.empty()) {
      const ssize_t got = ::pread(fd_, into.data(), into.size(), static_cast<off_t>(offset));
      if (got < 0 && errno == EINTR) {
        continue;
      }
      if (got <= 0) {
        return false;
      }
      into = into.subspan(static_cast<std::size_t>(got));
      offset += static_cast<std::uint64_t>(got);
    }
    return true;
  }

 private:
  void close() const noexcept {
    if (fd_ >= 0) {
      ::close(fd_);
    }
  }

  int fd_ = -1;
  std::uint64_t size_ = 0;
};

/// Memory that grows, and whose pages are taken only when they are written to.
class Room {
 public:
  [[nodiscard]] ByteSpan of(std::size_t bytes) {
    if (bytes > size_) {
      size_ = bytes;
      memory_.reset(new std::byte[bytes]);
    }
    return {memory_.get(), bytes};
  }

 private:
  std::unique_ptr<std::byte[]> memory_;
  std::size_t size_ = 0;
};

/// Schemas and channels, as they are read.
class Definitions {
 public:
  [[nodiscard]] McapResult<void> add_schema(ByteView body, std::uint64_t offset) {
    FieldReader in{body};
    Schema schema;
    schema.id = in.number<std::uint16_t>("id");
    schema.name = in.text("name");
    schema.encoding = in.text("encoding");
    schema.data = in.text("data");
    if (in.missing() != nullptr) {
      return tl::unexpected{in.fault(Opcode::schema, offset)};
    }
    if (schema.id == 0) {
      return fault(offset + record_head_bytes, "schema.id", "0 is the id of none");
    }
    return add(schemas_, std::move(schema), body.size(), offset, "schema.id");
  }

  [[nodiscard]] McapResult<void> add_channel(ByteView body, std::uint64_t offset) {
    FieldReader in{body};
    Channel channel;
    channel.id = in.number<std::uint16_t>("id");
    channel.schema = in.number<std::uint16_t>("schema_id");
    channel.topic = in.text("topic");
    channel.encoding = in.text("message_encoding");
    channel.metadata = in.texts("metadata");
    if (in.missing() != nullptr) {
      return tl::unexpected{in.fault(Opcode::channel, offset)};
    }
    if (channel.schema != 0 && !schemas_.contains(channel.schema)) {
      return fault(offset + record_head_bytes + 2, "channel.schema_id",
                   fmt::format("there is no schema {} before it", channel.schema));
    }
    return add(channels_, std::move(channel), body.size(), offset, "channel.id");
  }

  [[nodiscard]] const std::map<std::uint16_t, Schema>& schemas() const noexcept { return schemas_; }
  [[nodiscard]] const std::map<std::uint16_t, Channel>& channels() const noexcept { return channels_; }

 private:
  template <typename T>
  McapResult<void> add(std::map<std::uint16_t, T>& all, T one, std::size_t bytes, std::uint64_t offset,
                       const char* field) {
    const std::uint16_t id = one.id;
    if (const auto known = all.find(id); known != all.end()) {
      if (known->second != one) {
        return fault(offset + record_head_bytes, field,
                     fmt::format("{} is there twice, with other contents", id));
      }
      return {};
    }
    bytes_ += bytes;
    if (bytes_ > max_definition_bytes) {
      return fault(
          offset, field,
          fmt::format("all schemas and channels together have more than {} bytes", max_definition_bytes));
    }
    all.emplace(id, std::move(one));
    return {};
  }

  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  std::uint64_t bytes_ = 0;
};

/// The front of a record, of which `bytes` follow.
struct Head {
  Opcode opcode{};
  std::uint64_t bytes = 0;
};

Head head_of(ByteView front) {
  return {static_cast<Opcode>(front[0]), someip::load<std::uint64_t>(front.data() + 1, std::endian::little)};
}

/// What is to be passed over.
bool is_read(Opcode opcode) {
  return opcode == Opcode::schema || opcode == Opcode::channel || opcode == Opcode::message ||
         opcode == Opcode::chunk;
}

}  // namespace

struct McapReader::State {
  explicit State(const std::string& path) : file{path} {
    std::array<std::byte, mcap_magic.size()> front{};
    if (!file.read(0, front) || !is_magic(front)) {
      throw std::runtime_error{fmt::format("{} is no MCAP file", path)};
    }
    is_closed = file.size() >= 2 * mcap_magic.size() && file.read(file.size() - front.size(), front) &&
                is_magic(front);
  }

  static bool is_magic(ByteView bytes) {
    return std::ranges::equal(bytes, std::as_bytes(std::span{mcap_magic}));
  }

  /// The next record of the file; nothing at the end of the data.
  McapResult<std::optional<Head>> next_head() {
    if (at == file.size()) {
      cut_off = at;  // without the record by which data end
      return std::nullopt;
    }
    std::array<std::byte, record_head_bytes> front{};
    if (!file.read(at, front)) {
      return breaks_off("record.length", 0);
    }
    const Head head = head_of(front);
    if (head.opcode == Opcode::data_end || head.opcode == Opcode::footer) {
      return std::nullopt;
    }
    if (head.bytes > file.size() - at - front.size()) {
      return breaks_off(std::string{to_string(head.opcode)} + ".length", head.bytes);
    }
    return head;
  }

  /// A record goes on behind the end of the file. Its writer was killed; in a file that was finished it is
  /// damage.
  McapResult<std::optional<Head>> breaks_off(std::string field, std::uint64_t bytes) {
    if (is_closed) {
      return fault(at + 1, std::move(field), fmt::format("{} is beyond the end of the file", bytes));
    }
    cut_off = at;
    return std::nullopt;
  }

  McapResult<ByteView> body(const Head& head, std::uint64_t limit) {
    if (head.bytes > limit) {
      return fault(at + 1, std::string{to_string(head.opcode)} + ".length",
                   fmt::format("{} bytes; at most {} are read", head.bytes, limit));
    }
    const ByteSpan bytes = record.of(static_cast<std::size_t>(head.bytes));
    if (!file.read(at + record_head_bytes, bytes)) {
      return fault(at + record_head_bytes, to_string(head.opcode), "it cannot be read");
    }
    return bytes;
  }

  /// Reads the record at `at`.
  /// @return a message, if it is one.
  McapResult<std::optional<Entry>> take(const Head& head) {
    const bool is_chunk = head.opcode == Opcode::chunk;
    const auto bytes = body(head, is_chunk ? max_chunk_bytes : max_record_bytes);
    if (!bytes) {
      return tl::unexpected{bytes.error()};
    }
    if (!is_chunk) {
      return take(head.opcode, *bytes, at);
    }
    if (auto opened = open_chunk(*bytes); !opened) {
      return tl::unexpected{opened.error()};
    }
    return std::nullopt;
  }

  /// @param offset  of the record in the file, or of its chunk.
  McapResult<std::optional<Entry>> take(Opcode opcode, ByteView body, std::uint64_t offset) {
    if (opcode == Opcode::message) {
      return message(body, offset);
    }
    McapResult<void> added{};
    if (opcode == Opcode::schema) {
      added = definitions.add_schema(body, offset);
    } else if (opcode == Opcode::channel) {
      added = definitions.add_channel(body, offset);
    }
    if (!added) {
      return tl::unexpected{added.error()};
    }
    return std::nullopt;
  }

  McapResult<std::optional<Entry>> message(ByteView body, std::uint64_t offset) const {
    FieldReader in{body};
    Entry entry;
    entry.channel = in.number<std::uint16_t>("channel_id");
    entry.sequence = in.number<std::uint32_t>("sequence");
    entry.log_time = in.number<std::uint64_t>("log_time");
    entry.publish_time = in.number<std::uint64_t>("publish_time");
    if (in.missing() != nullptr) {
      return tl::unexpected{in.fault(Opcode::message, offset)};
    }
    if (!definitions.channels().contains(entry.channel)) {
      return fault(offset, "message.channel_id",
                   fmt::format("there is no channel {} before it", entry.channel));
    }
    entry.data = in.rest();
    return entry;
  }

  McapResult<void> open_chunk(ByteView body) {
    FieldReader in{body};
    in.number<std::uint64_t>("message_start_time");
    in.number<std::uint64_t>("message_end_time");
    const std::uint64_t place_of_size = at + record_head_bytes + in.at();
    const auto size = in.number<std::uint64_t>("uncompressed_size");
    const std::uint64_t place_of_sum = at + record_head_bytes + in.at();
    const auto sum = in.number<std::uint32_t>("uncompressed_crc");
    const std::uint64_t place_of_name = at + record_head_bytes + in.at();
    const std::string name = in.text("compression");
    const ByteView compressed = in.bytes("records", in.number<std::uint64_t>("records"));
    if (in.missing() != nullptr) {
      return tl::unexpected{in.fault(Opcode::chunk, at)};
    }
    const auto compression = compression_in_file(name);
    if (!compression) {
      return fault(place_of_name, "chunk.compression",
                   fmt::format("'{}' is not known; lz4 and zstd are", name));
    }
    if (size > max_chunk_bytes) {
      return fault(place_of_size, "chunk.uncompressed_size",
                   fmt::format("{} bytes; at most {} are read", size, max_chunk_bytes));
    }
    const ByteSpan room = chunk_room.of(static_cast<std::size_t>(size));
    if (const std::string wrong = decompress(*compression, compressed, room); !wrong.empty()) {
      return fault(place_of_size, "chunk.records",
                   fmt::format("they should decompress to {} bytes: {}", size, wrong));
    }
    if (const std::uint32_t is = someip::e2e::crc32(room); sum != 0 && sum != is) {
      return fault(place_of_sum, "chunk.uncompressed_crc",
                   fmt::format("{:#010x}, and the records have {:#010x}", sum, is));
    }
    chunk = room;
    chunk_bytes = room.size();
    chunk_offset = at;
    return {};
  }

  /// The next message of the chunk that is open; nothing behind its last one.
  McapResult<std::optional<Entry>> next_of_chunk() {
    while (!chunk.empty()) {
      const std::size_t in_chunk = chunk_bytes - chunk.size();
      if (chunk.size() < record_head_bytes || head_of(chunk).bytes > chunk.size() - record_head_bytes) {
        return fault(chunk_offset, "chunk.records",
                     fmt::format("the record at byte {} of them ends behind them", in_chunk));
      }
      const Head head = head_of(chunk);
      const ByteView body = chunk.subspan(record_head_bytes, static_cast<std::size_t>(head.bytes));
      chunk = chunk.subspan(record_head_bytes + body.size());
      auto message = take(head.opcode, body, chunk_offset);
      if (!message || *message) {
        return message;
      }
    }
    return std::nullopt;
  }

  McapResult<std::optional<Entry>> next() {
    for (;;) {
      auto message = next_of_chunk();
      if (!message || *message) {
        return message;
      }
      const auto head = next_head();
      if (!head) {
        return tl::unexpected{head.error()};
      }
      if (!*head) {
        return std::nullopt;
      }
      if (is_read((*head)->opcode)) {
        message = take(**head);
        if (!message) {
          return message;
        }
      }
      at += record_head_bytes + (*head)->bytes;
      if (*message) {
        return message;
      }
    }
  }

  void rewind() {
    at = mcap_magic.size();
    chunk = {};
    definitions = {};
    failed.reset();
    cut_off.reset();
  }

  /// @return nothing: the file has none.
  McapResult<std::optional<Overview>> summary();

  InputFile file;
  bool is_closed = false;  ///< it ends as a file does that was finished
  std::uint64_t at = mcap_magic.size();
  Definitions definitions;
  Room record;
  Room chunk_room;
  ByteView chunk{};  ///< what is left to read of it
  std::size_t chunk_bytes = 0;
  std::uint64_t chunk_offset = 0;
  std::optional<std::uint64_t> cut_off;
  std::optional<McapFault> failed;
};

McapResult<std::optional<Overview>> McapReader::State::summary() {
  constexpr std::uint64_t tail = record_head_bytes + footer_bytes + mcap_magic.size();
  if (!is_closed || file.size() < tail + mcap_magic.size()) {
    return std::nullopt;
  }
  const std::uint64_t footer = file.size() - tail;
  std::array<std::byte, record_head_bytes + footer_bytes> front{};
  if (!file.read(footer, front) || head_of(front).opcode != Opcode::footer ||
      head_of(front).bytes != footer_bytes) {
    return fault(footer, "footer", "it is not where it should be, before the end of the file");
  }
  FieldReader in{ByteView{front}.subspan(record_head_bytes)};
  const auto start = in.number<std::uint64_t>("summary_start");
  in.number<std::uint64_t>("summary_offset_start");
  const auto sum = in.number<std::uint32_t>("summary_crc");
  if (start == 0) {
    return std::nullopt;
  }
  if (start < mcap_magic.size() || start > footer || footer - start > max_definition_bytes) {
    return fault(footer + record_head_bytes, "footer.summary_start", fmt::format("{} cannot be", start));
  }
  std::vector<std::byte> bytes(static_cast<std::size_t>(footer + front.size() - start));
  if (!file.read(start, bytes)) {
    return fault(start, "summary", "it cannot be read");
  }
  const std::uint32_t is = someip::e2e::crc32(ByteView{bytes}.first(bytes.size() - sizeof sum));
  if (sum != 0 && sum != is) {
    return fault(footer + front.size() - sizeof sum, "footer.summary_crc",
                 fmt::format("{:#010x}, and the summary has {:#010x}", sum, is));
  }
  Overview overview{.has_summary = true};
  Definitions found;
  bool counts = false;
  for (std::uint64_t place = start; place < footer;) {
    const ByteView rest = ByteView{bytes}.subspan(static_cast<std::size_t>(place - start));
    const Head head = rest.size() < record_head_bytes ? Head{} : head_of(rest);
    if (rest.size() < record_head_bytes || head.bytes > footer - place - record_head_bytes) {
      return fault(place + 1, std::string{to_string(head.opcode)} + ".length", "it ends behind the summary");
    }
    const ByteView body = rest.subspan(record_head_bytes, static_cast<std::size_t>(head.bytes));
    McapResult<void> added{};
    if (head.opcode == Opcode::schema) {
      added = found.add_schema(body, place);
    } else if (head.opcode == Opcode::channel) {
      added = found.add_channel(body, place);
      if (!added && added.error().field == "channel.schema_id") {
        return std::nullopt;  // a writer may leave out the schemas
      }
    } else if (head.opcode == Opcode::statistics) {
      FieldReader fields{body};
      Statistics& all = overview.statistics;
      all.messages = fields.number<std::uint64_t>("message_count");
      fields.number<std::uint16_t>("schema_count");
      fields.number<std::uint32_t>("channel_count");
      fields.number<std::uint32_t>("attachment_count");
      all.metadata = fields.number<std::uint32_t>("metadata_count");
      all.chunks = fields.number<std::uint32_t>("chunk_count");
      all.start = fields.number<std::uint64_t>("message_start_time");
      all.end = fields.number<std::uint64_t>("message_end_time");
      FieldReader by_channel{
          fields.bytes("channel_message_counts", fields.number<std::uint32_t>("channel_message_counts"))};
      while (!by_channel.rest().empty() && by_channel.missing() == nullptr) {
        const auto id = by_channel.number<std::uint16_t>("channel_message_counts");
        all.by_channel[id] = by_channel.number<std::uint64_t>("channel_message_counts");
      }
      if (fields.missing() != nullptr || by_channel.missing() != nullptr) {
        return tl::unexpected{
            (fields.missing() != nullptr ? fields : by_channel).fault(Opcode::statistics, place)};
      }
      counts = true;
    }
    if (!added) {
      return tl::unexpected{added.error()};
    }
    place += record_head_bytes + head.bytes;
  }
  if (!counts || (overview.statistics.messages > 0 && found.channels().empty())) {
    return std::nullopt;  // a writer may leave out what it likes
  }
  overview.schemas = found.schemas();
  overview.channels = found.channels();
  return overview;
}

McapReader::McapReader(const std::string& path) : state_{std::make_unique<State>(path)}, path_{path} {}
McapReader::McapReader(McapReader&&) noexcept = default;
McapReader& McapReader::operator=(McapReader&&) noexcept = default;
McapReader::~McapReader() = default;

McapResult<std::optional<Entry>> McapReader::next() {
  if (state_->failed) {
    return tl::unexpected{*state_->failed};
  }
  auto message = state_->next();
  if (!message) {
    state_->failed = message.error();
  }
  return message;
}

void McapReader::rewind() {
  state_->rewind();
}

const std::map<std::uint16_t, Schema>& McapReader::schemas() const noexcept {
  return state_->definitions.schemas();
}

const std::map<std::uint16_t, Channel>& McapReader::channels() const noexcept {
  return state_->definitions.channels();
}

std::optional<std::uint64_t> McapReader::cut_off() const noexcept {
  return state_->cut_off;
}

McapResult<Overview> McapReader::overview() const {
  auto summary = state_->summary();
  if (!summary) {
    return tl::unexpected{summary.error()};
  }
  if (*summary) {
    return std::move(**summary);
  }
  McapReader whole{path_};
  Overview overview;
  for (;;) {
    const auto message = whole.next();
    if (!message) {
      return tl::unexpected{message.error()};
    }
    if (!*message) {
      break;
    }
    overview.statistics.add(**message);
  }
  overview.schemas = whole.schemas();
  overview.channels = whole.channels();
  return overview;
}

}  // namespace trestle::record
