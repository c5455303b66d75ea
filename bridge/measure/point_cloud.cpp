#include "bridge/measure/point_cloud.hpp"

#include <bit>
#include <limits>

#include "someip/wire/bytes.hpp"

namespace trestle::measure {

namespace {

constexpr std::size_t header_size = 4;  // alignment counts from behind it
constexpr std::int64_t second_ns = 1'000'000'000;
// More than any lidar has; a hostile message can't make us store more.
constexpr std::uint32_t max_fields = 256;

/// Appends little-endian CDR.
class CdrWriter {
 public:
  void u8(std::uint8_t number) { bytes_.push_back(static_cast<std::byte>(number)); }
  void u32(std::uint32_t number) {
    while ((bytes_.size() - header_size) % sizeof(number) != 0) {
      u8(0);
    }
    bytes_.resize(bytes_.size() + sizeof(number));
    someip::store(bytes_.data() + bytes_.size() - sizeof(number), number, std::endian::little);
  }
  void string(std::string_view text) {
    u32(static_cast<std::uint32_t>(text.size() + 1));
    for (const char letter : text) {
      u8(static_cast<std::uint8_t>(letter));
    }
    u8(0);
  }
  [[nodiscard]] std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
};

/// Reads CDR behind its encapsulation header.
class CdrReader {
 public:
  CdrReader(ByteView body, std::endian order) : in_{body, order} {}
  std::uint8_t u8() { return in_.u8(); }
  std::uint32_t u32() {
    while (in_.position() % sizeof(std::uint32_t) != 0 && !in_.failed()) {
      in_.skip(1);
    }
    return in_.u32();
  }
  std::string_view string() {
    const ByteView bytes = in_.take(u32());
    if (bytes.empty() || bytes.back() != std::byte{0}) {
      bad_string_ = true;
      return {};
    }
    const void* text = bytes.data();
    return {static_cast<const char*>(text), bytes.size() - 1};
  }
  ByteView take(std::size_t size) { return in_.take(size); }
  [[nodiscard]] bool failed() const { return in_.failed() || bad_string_; }
  [[nodiscard]] std::size_t left() const { return in_.rest().size(); }

 private:
  someip::ByteReader in_;
  bool bad_string_ = false;
};

tl::unexpected<std::string> wrong(const char* what) {
  return tl::unexpected{std::string{what}};
}

}  // namespace

EncodedCloud encode(const Cloud& cloud, std::int64_t stamp_ns, std::string_view frame_id) {
  return encode(cloud, cloud.data, stamp_ns, frame_id);
}

EncodedCloud encode(const Cloud& cloud, ByteView data, std::int64_t stamp_ns, std::string_view frame_id) {
  CdrWriter out;
  // Before 1970 the seconds are negative and the nanoseconds still count upwards.
  const std::int64_t nanoseconds = (stamp_ns % second_ns + second_ns) % second_ns;
  out.u32(static_cast<std::uint32_t>((stamp_ns - nanoseconds) / second_ns));
  out.u32(static_cast<std::uint32_t>(nanoseconds));
  out.string(frame_id);
  out.u32(cloud.height);
  out.u32(cloud.width);
  out.u32(static_cast<std::uint32_t>(cloud.fields.size()));
  for (const PointField& field : cloud.fields) {
    out.string(field.name);
    out.u32(field.offset);
    out.u8(static_cast<std::uint8_t>(field.type));
    out.u32(field.count);
  }
  out.u8(0);  // is_bigendian
  out.u32(cloud.point_bytes);
  out.u32(cloud.point_bytes * cloud.width);
  out.u32(static_cast<std::uint32_t>(data.size()));
  return {out.take(), data, static_cast<std::byte>(cloud.dense)};
}

tl::expected<CloudView, std::string> decode(ByteView cdr) {
  if (cdr.size() < header_size || cdr[0] != std::byte{0} || cdr[1] > std::byte{1}) {
    return wrong("not plain CDR");
  }
  CdrReader in{cdr.subspan(header_size), cdr[1] == std::byte{1} ? std::endian::little : std::endian::big};
  CloudView view;
  const std::int64_t seconds = std::bit_cast<std::int32_t>(in.u32());
  const std::uint32_t nanoseconds = in.u32();
  if (nanoseconds >= second_ns) {
    return wrong("header.stamp has a second or more of nanoseconds");
  }
  view.stamp_ns = seconds * second_ns + nanoseconds;
  view.frame_id = in.string();
  view.height = in.u32();
  view.width = in.u32();
  const std::uint32_t fields = in.u32();
  if (in.failed() || fields > max_fields) {
    return wrong("truncated or damaged before the field list");
  }
  for (std::uint32_t i = 0; i < fields; ++i) {
    PointField field;
    field.name = in.string();
    field.offset = in.u32();
    field.type = FieldType{in.u8()};
    field.count = in.u32();
    view.fields.push_back(std::move(field));
  }
  const std::uint8_t big_endian = in.u8();
  view.point_bytes = in.u32();
  view.row_bytes = in.u32();
  view.data = in.take(in.u32());
  const std::uint8_t dense = in.u8();
  if (in.failed()) {
    return wrong("truncated or damaged behind the field list");
  }
  if (big_endian > 1 || dense > 1) {
    return wrong("is_bigendian or is_dense is neither true nor false");
  }
  view.big_endian = big_endian != 0;
  view.dense = dense != 0;
  constexpr std::size_t max_padding = 3;
  if (in.left() > max_padding) {
    return wrong("more bytes than the message has");
  }
  if (std::uint64_t{view.point_bytes} * view.width != view.row_bytes ||
      std::uint64_t{view.row_bytes} * view.height != view.data.size()) {
    return wrong("height, width, point_step, row_step and data do not agree");
  }
  return view;
}

}  // namespace trestle::measure
