#include "bridge/measure/point_cloud.hpp"

#include <bit>
#include <functional>
#include <limits>
#include <span>

#include "bridge/messages/values/cdr.hpp"

namespace trestle::measure {

namespace {

constexpr std::size_t header_size = 4;
constexpr std::int64_t second_ns = 1'000'000'000;
// More than any lidar has; a hostile message can't make us store more.
constexpr std::uint32_t max_fields = 256;

void put_string(messages::CdrWriter& out, std::string_view text) {
  out.number(static_cast<std::uint32_t>(text.size() + 1));
  out.bytes(std::as_bytes(std::span{text}));
  out.number(std::uint8_t{0});
}

std::string_view read_string(messages::CdrReader& in) {
  const ByteView bytes = in.take(in.number<std::uint32_t>());
  if (bytes.empty() || bytes.back() != std::byte{0}) {
    in.fail();
    return {};
  }
  const void* text = bytes.data();
  return {static_cast<const char*>(text), bytes.size() - 1};
}

tl::unexpected<std::string> wrong(const char* what) {
  return tl::unexpected{std::string{what}};
}

}  // namespace

EncodedCloud encode(const Cloud& cloud, std::int64_t stamp_ns, std::string_view frame_id) {
  return encode(cloud, cloud.data, stamp_ns, frame_id);
}

std::uint64_t checksum(const EncodedCloud& cloud) noexcept {
  const auto hash = [](ByteView bytes) {
    const void* const text = bytes.data();
    return std::hash<std::string_view>{}({static_cast<const char*>(text), bytes.size()});
  };
  constexpr std::uint64_t odd = 0x9e3779b185ebca87;  // so that it also shows which slice has which bytes
  return (hash(cloud.front) * odd + hash(cloud.data)) * odd + std::to_integer<std::uint64_t>(cloud.tail);
}

std::uint64_t checksum(const CloudView& cloud) {
  Cloud shape;
  shape.height = cloud.height;
  shape.width = cloud.width;
  shape.fields = cloud.fields;
  shape.point_bytes = cloud.point_bytes;
  shape.dense = cloud.dense;
  return checksum(encode(shape, cloud.data, cloud.stamp_ns, cloud.frame_id));
}

EncodedCloud encode(const Cloud& cloud, ByteView data, std::int64_t stamp_ns, std::string_view frame_id) {
  messages::CdrWriter out{std::numeric_limits<std::uint32_t>::max(), std::endian::little};
  // Before 1970 the seconds are negative and the nanoseconds still count upwards.
  const std::int64_t nanoseconds = (stamp_ns % second_ns + second_ns) % second_ns;
  out.number(static_cast<std::uint32_t>((stamp_ns - nanoseconds) / second_ns));
  out.number(static_cast<std::uint32_t>(nanoseconds));
  put_string(out, frame_id);
  out.number(cloud.height);
  out.number(cloud.width);
  out.number(static_cast<std::uint32_t>(cloud.fields.size()));
  for (const PointField& field : cloud.fields) {
    put_string(out, field.name);
    out.number(field.offset);
    out.number(static_cast<std::uint8_t>(field.type));
    out.number(field.count);
  }
  out.number(std::uint8_t{0});  // is_bigendian
  out.number(cloud.point_bytes);
  out.number(cloud.point_bytes * cloud.width);
  out.number(static_cast<std::uint32_t>(data.size()));
  return {out.take(), data, static_cast<std::byte>(cloud.dense)};
}

tl::expected<CloudView, std::string> decode(ByteView cdr) {
  if (cdr.size() < header_size || cdr[0] != std::byte{0} || cdr[1] > std::byte{1}) {
    return wrong("not plain CDR");
  }
  messages::CdrReader in{cdr.subspan(header_size),
                         cdr[1] == std::byte{1} ? std::endian::little : std::endian::big};
  CloudView view;
  const std::int64_t seconds = std::bit_cast<std::int32_t>(in.number<std::uint32_t>());
  const std::uint32_t nanoseconds = in.number<std::uint32_t>();
  if (nanoseconds >= second_ns) {
    return wrong("header.stamp has a second or more of nanoseconds");
  }
  view.stamp_ns = seconds * second_ns + nanoseconds;
  view.frame_id = read_string(in);
  view.height = in.number<std::uint32_t>();
  view.width = in.number<std::uint32_t>();
  const std::uint32_t fields = in.number<std::uint32_t>();
  if (in.failed() || fields > max_fields) {
    return wrong("truncated or damaged before the field list");
  }
  for (std::uint32_t i = 0; i < fields; ++i) {
    PointField field;
    field.name = read_string(in);
    field.offset = in.number<std::uint32_t>();
    field.type = FieldType{in.number<std::uint8_t>()};
    field.count = in.number<std::uint32_t>();
    view.fields.push_back(std::move(field));
  }
  const std::uint8_t big_endian = in.number<std::uint8_t>();
  view.point_bytes = in.number<std::uint32_t>();
  view.row_bytes = in.number<std::uint32_t>();
  view.data = in.take(in.number<std::uint32_t>());
  const std::uint8_t dense = in.number<std::uint8_t>();
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
