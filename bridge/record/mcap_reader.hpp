#pragma once
#include <memory>
#include <optional>
#include <string>
#include <tl/expected.hpp>

#include "bridge/record/mcap.hpp"
#include "bridge/record/mcap_fields.hpp"

namespace trestle::record {

/// The longest record that is not a chunk, and not one that is passed over.
inline constexpr std::uint64_t max_record_bytes = std::uint64_t{256} << 20U;
/// The largest chunk, decompressed.
inline constexpr std::uint64_t max_chunk_bytes = std::uint64_t{512} << 20U;
/// Of all schemas and channels of a file together.
inline constexpr std::uint64_t max_definition_bytes = std::uint64_t{256} << 20U;

template <typename T>
using McapResult = tl::expected<T, McapFault>;

/// All about a file but its messages.
struct Overview {
  std::map<std::uint16_t, Schema> schemas{};
  std::map<std::uint16_t, Channel> channels{};
  Statistics statistics{};
  bool has_summary = false;  ///< else it was found by reading the whole file
};

/// Reads an MCAP file, from its front to its end, each chunk once. Of a file that its writer did not finish
/// it reads all whole chunks. Attachments, metadata and indexes are passed over.
class McapReader {
 public:
  /// @throws std::runtime_error  it cannot be opened, or is no MCAP file.
  explicit McapReader(const std::string& path);
  McapReader(McapReader&&) noexcept;
  McapReader& operator=(McapReader&&) noexcept;
  ~McapReader();

  /// The next message, in the order of the file, which is mostly that of log times; nothing at the end. Its
  /// data live until the next call.
  /// @return or what is wrong, again and again.
  [[nodiscard]] McapResult<std::optional<Entry>> next();
  /// Begins again at the front.
  void rewind();

  /// Those that stand before the messages read so far.
  [[nodiscard]] const std::map<std::uint16_t, Schema>& schemas() const noexcept;
  [[nodiscard]] const std::map<std::uint16_t, Channel>& channels() const noexcept;
  /// After the end: where a file breaks off that its writer did not finish; nothing: it is whole.
  [[nodiscard]] std::optional<std::uint64_t> cut_off() const noexcept;

  /// Reads the summary; where there is none, the whole file. What next() reads is not changed.
  [[nodiscard]] McapResult<Overview> overview() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
  std::string path_;
};

}  // namespace trestle::record
