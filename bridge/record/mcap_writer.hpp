#pragma once
#include <string>
#include <system_error>
#include <vector>

#include "bridge/record/compression.hpp"
#include "bridge/record/growing_file.hpp"
#include "bridge/record/mcap.hpp"

namespace trestle::record {

struct McapSettings {
  Compression compression = Compression::lz4;
  std::size_t chunk_bytes = std::size_t{4}
                            << 20U;  ///< from which on a chunk is written; at least one message
  std::string profile = "ros2";
  std::string library = "trestle";  ///< who wrote it
};

/// Writes an MCAP file. What is on the disk is always a file that ends behind a whole chunk: what a chunk had
/// before is written at once, and what could be written only in part is taken back. So a program that is
/// killed, and a full disk, cost what no chunk was written of. Without finish() it has no summary. Not
/// thread-safe.
class McapWriter {
 public:
  /// Makes the file, which must not be there yet.
  /// @throws std::system_error
  McapWriter(const std::string& path, McapSettings settings);

  /// Adds what messages refer to; it goes to the file with the first message that does.
  /// @param schema, channel  with ids that no other one of this file has.
  void add(Schema schema);
  void add(Channel channel);

  /// Adds a message of a channel that was added. Where that fills a chunk, it is written.
  /// @return why a chunk could not be written; lost() has grown by its messages.
  std::error_code write(const Entry& message);
  /// Writes the chunk that has begun, if there is one; likewise.
  std::error_code flush();
  /// Adds a record of names and values, which readers of messages pass over.
  std::error_code add_metadata(const std::string& name, const Texts& texts);
  /// Writes what is left and the summary. To be called once, and nothing after it.
  std::error_code finish();

  /// What is in the file, without the chunk that has begun.
  [[nodiscard]] const Statistics& written() const noexcept { return statistics_; }
  /// Messages of chunks that could not be written.
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }
  /// Of the file and the chunk that has begun, before its compression.
  [[nodiscard]] std::uint64_t bytes() const noexcept { return file_.size() + chunk_.size(); }
  /// Of the chunk that has begun.
  [[nodiscard]] std::uint64_t pending() const noexcept { return pending_.messages; }
  [[nodiscard]] const std::string& path() const noexcept { return file_.path(); }

 private:
  struct Index {
    std::uint64_t time = 0;
    std::uint64_t offset = 0;
  };
  struct Known {
    Channel channel{};
    bool is_written = false;
    bool is_pending = false;     ///< stands in the chunk that has begun
    std::vector<Index> index{};  ///< of that chunk
  };
  struct KnownSchema {
    Schema schema{};
    bool is_written = false;
    bool is_pending = false;
  };
  struct ChunkIndex {
    LogTime start = 0;
    LogTime end = 0;
    std::uint64_t offset = 0;
    std::uint64_t bytes = 0;
    std::map<std::uint16_t, std::uint64_t> indexes{};  ///< where those of its channels are
    std::uint64_t index_bytes = 0;
    Compression compression{};
    std::uint64_t compressed = 0;
    std::uint64_t uncompressed = 0;
  };

  void begin_channel(Known& known);
  void end_chunk(bool is_written);
  [[nodiscard]] ChunkIndex put_chunk();
  void put_summary(std::vector<std::byte>& out) const;

  GrowingFile file_;
  McapSettings settings_;
  Compressor compressor_;
  std::map<std::uint16_t, KnownSchema> schemas_;
  std::map<std::uint16_t, Known> channels_;
  std::vector<std::byte> chunk_;  ///< that has begun
  std::vector<std::byte> out_;    ///< a chunk and its indexes, as they go to the file
  Statistics pending_;            ///< of the chunk
  Statistics statistics_;
  std::vector<ChunkIndex> chunks_;
  struct MetadataIndex {
    std::uint64_t offset = 0;
    std::uint64_t bytes = 0;
    std::string name{};
  };
  std::vector<MetadataIndex> metadata_;
  std::uint64_t lost_ = 0;
};

}  // namespace trestle::record
