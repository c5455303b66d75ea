#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "someip/wire/types.hpp"

namespace trestle::measure {

/// What a sensor_msgs/msg/PointField says; the datatypes have the numbers of that message.
enum class FieldType : std::uint8_t {
  int8 = 1,
  uint8 = 2,
  int16 = 3,
  uint16 = 4,
  int32 = 5,
  uint32 = 6,
  float32 = 7,
  float64 = 8,
};

/// Bytes of one value.
[[nodiscard]] constexpr std::uint32_t size_of(FieldType type) noexcept {
  constexpr std::uint32_t sizes[] = {0, 1, 1, 2, 2, 4, 4, 4, 8};  // NOLINT(modernize-avoid-c-arrays)
  return sizes[static_cast<std::uint8_t>(type)];
}

/// One field of a point: `count` values from byte `offset` of the point on.
struct PointField {
  std::string name;
  std::uint32_t offset = 0;
  FieldType type{};
  std::uint32_t count = 1;
  friend bool operator==(const PointField&, const PointField&) = default;
};

/// The points of a sensor_msgs/msg/PointCloud2, little-endian.
struct Cloud {
  std::uint32_t height = 1;
  std::uint32_t width = 0;
  std::vector<PointField> fields;
  std::uint32_t point_bytes = 0;
  bool dense = true;            ///< no point has a NaN
  std::vector<std::byte> data;  ///< height x width x point_bytes
};

/// A PointCloud2 as CDR in three slices; the large one is the cloud's own data, not copied.
struct EncodedCloud {
  std::vector<std::byte> front;  ///< encapsulation header up to the length of `data`
  ByteView data;                 ///< dies with the cloud
  std::byte tail{};              ///< is_dense
  [[nodiscard]] std::size_t size() const noexcept { return front.size() + data.size() + 1; }
};

/// Serialises a cloud as little-endian XCDR1.
/// @param stamp_ns  header.stamp, since 1970.
[[nodiscard]] EncodedCloud encode(const Cloud& cloud, std::int64_t stamp_ns, std::string_view frame_id);
/// The same of other data than the cloud's own.
[[nodiscard]] EncodedCloud encode(const Cloud& cloud, ByteView data, std::int64_t stamp_ns,
                                  std::string_view frame_id);

/// A decoded PointCloud2; views point into the decoded bytes.
struct CloudView {
  std::int64_t stamp_ns = 0;
  std::string_view frame_id;
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  std::vector<PointField> fields;
  bool big_endian = false;
  std::uint32_t point_bytes = 0;
  std::uint32_t row_bytes = 0;
  ByteView data;
  bool dense = false;
};

/// Over all that a cloud says, its stamp and frame too: whoever sends it and whoever receives it tell by it
/// whether it is the same. Any changed byte shows. Both must be processes of one program: it is std::hash.
[[nodiscard]] std::uint64_t checksum(const EncodedCloud& cloud) noexcept;
/// Of a cloud that was received: over what it would be if it were written here. So padding and the byte order
/// of the message do not count.
/// @param cloud  whose points are little-endian.
[[nodiscard]] std::uint64_t checksum(const CloudView& cloud);

/// Reads a serialised PointCloud2 of either byte order; up to 3 bytes of padding may follow it.
/// @return the cloud, or what is wrong with the sample.
[[nodiscard]] tl::expected<CloudView, std::string> decode(ByteView cdr);

}  // namespace trestle::measure
