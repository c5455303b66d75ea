#pragma once
#include <concepts>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/record/mcap.hpp"
#include "someip/wire/bytes.hpp"

namespace trestle::record {

/// Writes the fields of records behind each other. All numbers are little endian.
class FieldWriter {
 public:
  explicit FieldWriter(std::vector<std::byte>& out) : out_{out} {}

  template <std::unsigned_integral T>
  void number(T value) {
    std::array<std::byte, sizeof(T)> bytes{};
    someip::store(bytes.data(), value, std::endian::little);
    bytes_of(bytes);
  }
  void bytes_of(ByteView bytes) { out_.insert(out_.end(), bytes.begin(), bytes.end()); }
  void text(std::string_view text);
  void texts(const Texts& texts);

  /// Begins a record, or something else with a length of type T before it. end() fills in the length.
  template <std::unsigned_integral T>
  [[nodiscard]] std::size_t begin() {
    number(T{0});
    return out_.size();
  }
  [[nodiscard]] std::size_t begin(Opcode opcode) {
    number(static_cast<std::uint8_t>(opcode));
    return begin<std::uint64_t>();
  }
  template <std::unsigned_integral T = std::uint64_t>
  void end(std::size_t begun) {
    someip::store(out_.data() + begun - sizeof(T), static_cast<T>(out_.size() - begun), std::endian::little);
  }

 private:
  std::vector<std::byte>& out_;
};

/// The records of schemas and channels, which stand in the data and again in the summary.
void put(FieldWriter& out, const Schema& schema);
void put(FieldWriter& out, const Channel& channel);

/// What is wrong with a file, and where.
struct McapFault {
  std::uint64_t offset = 0;  ///< in the file; of something within a chunk, that of the chunk
  std::string field{};       ///< "chunk.uncompressed_crc", "channel.topic"
  std::string text{};        ///< what is there, and what was expected
};

/// "at byte 1234, chunk.uncompressed_crc: ..."
[[nodiscard]] std::string to_string(const McapFault& fault);

/// Reads the fields of a record, and remembers which one was the first that is not there. After that all are
/// zero and empty.
class FieldReader {
 public:
  explicit FieldReader(ByteView bytes) : bytes_{bytes} {}

  template <std::unsigned_integral T>
  T number(const char* field) {
    const ByteView bytes = take(field, sizeof(T));
    return bytes.empty() ? T{0} : someip::load<T>(bytes.data(), std::endian::little);
  }
  ByteView bytes(const char* field, std::uint64_t size) { return take(field, size); }
  std::string text(const char* field);
  Texts texts(const char* field);
  /// What was not read yet.
  [[nodiscard]] ByteView rest() const noexcept { return bytes_.subspan(at_); }
  [[nodiscard]] std::size_t at() const noexcept { return at_; }

  /// Null: all fields were there.
  [[nodiscard]] const char* missing() const noexcept { return missing_; }
  /// Says what is missing.
  [[nodiscard]] McapFault fault(Opcode of, std::uint64_t record) const;

 private:
  ByteView take(const char* field, std::uint64_t size);

  ByteView bytes_;
  std::size_t at_ = 0;
  const char* missing_ = nullptr;
  std::uint64_t wanted_ = 0;
};

}  // namespace trestle::record
