#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "someip/wire/types.hpp"

namespace trestle::record {

/// How chunks are compressed.
enum class Compression : std::uint8_t { none, lz4, zstd };

/// As it stands above.
[[nodiscard]] const char* to_string(Compression compression) noexcept;
/// As it stands in a file: "" is none.
[[nodiscard]] std::string_view in_file(Compression compression) noexcept;
/// Nothing: a name that we don't know.
[[nodiscard]] std::optional<Compression> compression_in_file(std::string_view name) noexcept;

/// Compresses, with memory that is kept from one chunk to the next. As fast as each way can: a recorder must
/// keep up.
class Compressor {
 public:
  explicit Compressor(Compression compression);
  Compressor(Compressor&&) noexcept;
  Compressor& operator=(Compressor&&) noexcept;
  ~Compressor();

  /// Appends the compressed bytes to `out`: an LZ4 or Zstandard frame.
  /// @return false, with `out` as it was: they would be no shorter, or are not to be compressed.
  [[nodiscard]] bool add(ByteView bytes, std::vector<std::byte>& out);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The other way.
/// @param room  is filled to its last byte, or the bytes are no such chunk.
/// @return an empty text; or what is wrong.
[[nodiscard]] std::string decompress(Compression compression, ByteView bytes, ByteSpan room);

}  // namespace trestle::record
