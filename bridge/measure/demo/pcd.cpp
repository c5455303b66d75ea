#include "bridge/measure/demo/pcd.hpp"

#include <fmt/format.h>

#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>

#include "someip/wire/bytes.hpp"

namespace trestle::measure::demo {

namespace {

struct Failure {
  std::string text;
};

/// A column of the file: one field, padding included.
struct Column {
  std::string name;
  std::uint32_t size = 0;
  char type = 0;
  std::uint32_t count = 1;
};

/// One reading of one file. Private functions throw Failure, which does not leave parse().
class Pcd {
 public:
  Pcd(std::string_view text, const std::string& name) : rest_{text}, all_{text}, name_{name} {}

  tl::expected<Cloud, std::string> parse() {
    try {
      header();
      return body();
    } catch (const Failure& failure) {
      return tl::unexpected{failure.text};
    }
  }

 private:
  using Words = std::vector<std::string_view>;

  [[noreturn]] void fail_line(const std::string& what) const {
    throw Failure{fmt::format("{}:{}: {}", name_, line_, what)};
  }
  [[noreturn]] void fail_at(std::string_view place, const std::string& what) const {
    throw Failure{fmt::format("{}: byte {}: {}", name_, place.data() - all_.data(), what)};
  }

  /// The words of the next line that is neither empty nor a comment; none at the end of the file.
  Words next_line() {
    while (!rest_.empty()) {
      ++line_;
      const std::size_t end = rest_.find('\n');
      std::string_view line = rest_.substr(0, end);
      rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
      constexpr const char* blank = " \t\r";
      Words words;
      for (std::size_t from = line.find_first_not_of(blank);
           from != std::string_view::npos && line[from] != '#';) {
        const std::size_t to = std::min(line.find_first_of(blank, from), line.size());
        words.push_back(line.substr(from, to - from));
        from = line.find_first_not_of(blank, to);
      }
      if (!words.empty()) {
        return words;
      }
    }
    return {};
  }

  template <typename Number>
  Number number(std::string_view word) const {
    Number result{};
    const char* const last = word.data() + word.size();
    const auto [end, error] = std::from_chars(word.data(), last, result);
    if (error != std::errc{} || end != last) {
      fail_line(fmt::format("'{}' is not a number that fits here", word));
    }
    return result;
  }

  void header() {
    constexpr std::size_t max_fields = 64;
    while (true) {
      const Words words = next_line();
      if (words.empty()) {
        fail_line("the file ends before its DATA line");
      }
      const std::string_view key = words[0];
      if (key == "FIELDS") {
        if (words.size() < 2 || words.size() > max_fields + 1) {
          fail_line(fmt::format("FIELDS needs 1 to {} names", max_fields));
        }
        columns_.clear();
        for (std::size_t i = 1; i < words.size(); ++i) {
          columns_.push_back({.name = std::string{words[i]}});
        }
      } else if (key == "SIZE" || key == "TYPE" || key == "COUNT") {
        if (words.size() != columns_.size() + 1) {
          fail_line(fmt::format("{} has {} values for {} FIELDS", key, words.size() - 1, columns_.size()));
        }
        for (std::size_t i = 0; i < columns_.size(); ++i) {
          set(key, words[i + 1], columns_[i]);
        }
      } else if (key == "WIDTH" || key == "HEIGHT" || key == "POINTS") {
        if (words.size() != 2) {
          fail_line(fmt::format("{} needs one value", key));
        }
        (key == "WIDTH" ? width_ : key == "HEIGHT" ? height_ : points_) = number<std::uint32_t>(words[1]);
      } else if (key == "DATA") {
        if (words.size() != 2 ||
            (words[1] != "ascii" && words[1] != "binary" && words[1] != "binary_compressed")) {
          fail_line("DATA must be ascii, binary or binary_compressed");
        }
        data_ = words[1];
        check_header();
        return;
      } else if (key != "VERSION" && key != "VIEWPOINT") {
        fail_line(fmt::format("unknown key '{}' in the header", key.substr(0, 40)));
      }
    }
  }

  void set(std::string_view key, std::string_view word, Column& column) const {
    constexpr std::uint32_t max_count = 4096;
    if (key == "SIZE") {
      column.size = number<std::uint32_t>(word);
    } else if (key == "COUNT") {
      column.count = number<std::uint32_t>(word);
      if (column.count < 1 || column.count > max_count) {
        fail_line(fmt::format("COUNT {} is out of range: 1 to {}", word, max_count));
      }
    } else if (word == "F" || word == "U" || word == "I") {
      column.type = word[0];
    } else {
      fail_line(fmt::format("unknown TYPE '{}': expected F, U or I", word));
    }
  }

  /// Fills the cloud's shape.
  void check_header() {
    if (columns_.empty()) {
      fail_line("no FIELDS line before DATA");
    }
    std::size_t offset = 0;
    for (const Column& column : columns_) {
      const FieldType type = type_of(column);
      if (column.name != "_") {
        cloud_.fields.push_back({column.name, static_cast<std::uint32_t>(offset), type, column.count});
      }
      offset += std::size_t{column.size} * column.count;
    }
    if (cloud_.fields.empty()) {
      fail_line("all FIELDS are padding");
    }
    cloud_.point_bytes = static_cast<std::uint32_t>(offset);
    cloud_.width = width_;
    cloud_.height = height_;
    const std::uint64_t points = std::uint64_t{width_} * height_;
    if (points_ != points) {
      fail_line(fmt::format("POINTS {} is not WIDTH {} times HEIGHT {}", points_, width_, height_));
    }
    if (points * offset > max_pcd_bytes) {
      fail_line(fmt::format("{} points of {} bytes are more than {} bytes", points, offset, max_pcd_bytes));
    }
  }

  [[nodiscard]] FieldType type_of(const Column& column) const {
    struct Known {
      char type;
      std::uint32_t size;
      FieldType field;
    };
    for (const Known& known :
         {Known{'I', 1, FieldType::int8}, Known{'U', 1, FieldType::uint8}, Known{'I', 2, FieldType::int16},
          Known{'U', 2, FieldType::uint16}, Known{'I', 4, FieldType::int32}, Known{'U', 4, FieldType::uint32},
          Known{'F', 4, FieldType::float32}, Known{'F', 8, FieldType::float64}}) {
      if (known.type == column.type && known.size == column.size) {
        return known.field;
      }
    }
    fail_line(fmt::format("field '{}' of TYPE {} and SIZE {} has no counterpart in PointCloud2", column.name,
                          column.type == 0 ? '?' : column.type, column.size));
  }

  Cloud body() {
    if (data_ == "ascii") {
      ascii();
    } else if (data_ == "binary") {
      const ByteView bytes = binary(data_bytes());
      cloud_.data.assign(bytes.begin(), bytes.end());
    } else {
      compressed();
    }
    cloud_.dense = !has_nan();
    return std::move(cloud_);
  }

  [[nodiscard]] std::size_t data_bytes() const { return std::size_t{points_} * cloud_.point_bytes; }

  /// The next `size` bytes.
  ByteView binary(std::size_t size) {
    if (rest_.size() < size) {
      fail_at(rest_, fmt::format("{} bytes are left where {} are needed", rest_.size(), size));
    }
    const void* bytes = rest_.data();
    rest_.remove_prefix(size);
    return {static_cast<const std::byte*>(bytes), size};
  }

  /// Compressed data is stored column by column: all x, then all y, and so on.
  void compressed() {
    someip::ByteReader sizes{binary(8), std::endian::little};
    const std::size_t packed = sizes.u32();
    const std::size_t unpacked = sizes.u32();
    if (unpacked != data_bytes()) {
      fail_at(rest_,
              fmt::format("{} bytes uncompressed where the header promises {}", unpacked, data_bytes()));
    }
    const std::string_view place = rest_;
    const ByteView compressed_bytes = binary(packed);
    std::vector<std::byte> stored(unpacked);
    if (!expand_lzf(compressed_bytes, stored)) {
      fail_at(place, "damaged compressed data");
    }
    cloud_.data.resize(unpacked);
    const std::byte* from = stored.data();
    std::size_t offset = 0;
    for (const Column& column : columns_) {
      const std::size_t size = std::size_t{column.size} * column.count;
      for (std::size_t point = 0; point < points_; ++point, from += size) {
        std::memcpy(cloud_.data.data() + point * cloud_.point_bytes + offset, from, size);
      }
      offset += size;
    }
  }

  void ascii() {
    std::size_t values = 0;
    for (const Column& column : columns_) {
      values += column.count;
    }
    for (std::uint32_t point = 0; point < points_; ++point) {
      const Words words = next_line();
      if (words.empty()) {
        fail_line(fmt::format("the file ends after {} of {} points", point, points_));
      }
      if (words.size() != values) {
        fail_line(fmt::format("{} values where a point has {}", words.size(), values));
      }
      cloud_.data.resize(cloud_.data.size() + cloud_.point_bytes);
      std::byte* at = cloud_.data.data() + cloud_.data.size() - cloud_.point_bytes;
      std::size_t word = 0;
      for (const Column& column : columns_) {
        for (std::uint32_t i = 0; i < column.count; ++i, at += column.size) {
          store(words[word++], type_of(column), at);
        }
      }
    }
  }

  void store(std::string_view word, FieldType type, std::byte* at) const {
    constexpr auto order = std::endian::little;
    switch (type) {
      case FieldType::int8:
        *at = static_cast<std::byte>(number<std::int8_t>(word));
        return;
      case FieldType::uint8:
        *at = static_cast<std::byte>(number<std::uint8_t>(word));
        return;
      case FieldType::int16:
        return someip::store(at, static_cast<std::uint16_t>(number<std::int16_t>(word)), order);
      case FieldType::uint16:
        return someip::store(at, number<std::uint16_t>(word), order);
      case FieldType::int32:
        return someip::store(at, static_cast<std::uint32_t>(number<std::int32_t>(word)), order);
      case FieldType::uint32:
        return someip::store(at, number<std::uint32_t>(word), order);
      case FieldType::float32:
        return someip::store(at, std::bit_cast<std::uint32_t>(number<float>(word)), order);
      case FieldType::float64:
        return someip::store(at, std::bit_cast<std::uint64_t>(number<double>(word)), order);
    }
  }

  [[nodiscard]] bool has_nan() const {
    constexpr auto order = std::endian::little;
    for (const PointField& field : cloud_.fields) {
      if (field.type != FieldType::float32 && field.type != FieldType::float64) {
        continue;
      }
      for (std::size_t point = 0; point < points_; ++point) {
        for (std::uint32_t i = 0; i < field.count; ++i) {
          const std::byte* at = cloud_.data.data() + point * cloud_.point_bytes + field.offset +
                                std::size_t{i} * size_of(field.type);
          if (field.type == FieldType::float32
                  ? std::isnan(std::bit_cast<float>(someip::load<std::uint32_t>(at, order)))
                  : std::isnan(std::bit_cast<double>(someip::load<std::uint64_t>(at, order)))) {
            return true;
          }
        }
      }
    }
    return false;
  }

  std::string_view rest_;
  const std::string_view all_;
  const std::string& name_;
  int line_ = 0;
  std::vector<Column> columns_;
  std::uint32_t width_ = 0;
  std::uint32_t height_ = 1;
  std::uint32_t points_ = 0;
  std::string_view data_;
  Cloud cloud_;
};

}  // namespace

bool expand_lzf(ByteView from, ByteSpan to) noexcept {
  someip::ByteReader in{from};
  std::size_t at = 0;
  while (!in.rest().empty()) {
    const std::size_t control = in.u8();
    constexpr std::size_t longest_literal = 32;
    if (control < longest_literal) {  // control + 1 literal bytes follow
      const ByteView literal = in.take(control + 1);
      if (in.failed() || literal.size() > to.size() - at) {
        return false;
      }
      std::memcpy(to.data() + at, literal.data(), literal.size());
      at += literal.size();
      continue;
    }
    // A repetition: 3 bits of length, where 7 means that one more byte follows, and 13 bits of distance.
    std::size_t length = control >> 5U;
    if (length == 7) {
      length += in.u8();
    }
    length += 2;
    const std::size_t distance = ((control & 31U) << 8U) + in.u8() + 1;
    if (in.failed() || distance > at || length > to.size() - at) {
      return false;
    }
    for (; length > 0; --length, ++at) {  // source and target may overlap
      to[at] = to[at - distance];
    }
  }
  return at == to.size();
}

tl::expected<Cloud, std::string> parse_pcd(std::string_view text, const std::string& name) {
  return Pcd{text, name}.parse();
}

tl::expected<Cloud, std::string> load_pcd(const std::string& file) {
  std::ifstream in{file, std::ios::binary};
  // ASCII takes several times the room of the values.
  constexpr std::size_t max_file_bytes = 8 * max_pcd_bytes;
  std::string text;
  if (in) {
    in.seekg(0, std::ios::end);
    const auto size = static_cast<std::streamoff>(in.tellg());
    if (size > static_cast<std::streamoff>(max_file_bytes)) {
      return tl::unexpected{fmt::format("{}: {} bytes are more than a cloud may have", file, size)};
    }
    in.seekg(0);
    text.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
    in.read(text.data(), static_cast<std::streamsize>(text.size()));
  }
  if (!in) {
    return tl::unexpected{fmt::format("{}: {}", file, std::strerror(errno))};
  }
  return parse_pcd(text, file);
}

}  // namespace trestle::measure::demo
