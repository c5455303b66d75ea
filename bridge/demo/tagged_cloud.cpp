#include "bridge/demo/tagged_cloud.hpp"

#include <fmt/format.h>

#include <bit>
#include <charconv>
#include <cstring>

#include "someip/wire/bytes.hpp"

namespace trestle::bridge::demo {

namespace {

constexpr std::uint64_t prime_1 = 0x9e3779b185ebca87;
constexpr std::uint64_t prime_2 = 0xc2b2ae3d27d4eb4f;
constexpr std::uint64_t prime_3 = 0x165667b19e3779f9;
constexpr std::uint64_t prime_4 = 0x85ebca77c2b2ae63;
constexpr std::uint64_t prime_5 = 0x27d4eb2f165667c5;

std::uint64_t round_of(std::uint64_t lane, std::uint64_t input) noexcept {
  return std::rotl(lane + input * prime_2, 31) * prime_1;
}

template <typename T>
T little(const std::byte* from) noexcept {
  if constexpr (std::endian::native == std::endian::little) {
    T number{};
    std::memcpy(&number, from, sizeof(number));
    return number;
  } else {
    return someip::load<T>(from, std::endian::little);
  }
}

/// Over the message as it would be with only `front` of the tag. `shape` has everything but the data.
std::string sum_of(const Cloud& shape, std::int64_t stamp_ns, std::string_view front, ByteView data) {
  const EncodedCloud encoded = encode(shape, stamp_ns, front);
  return fmt::format("{:016x}", xxh64(data, xxh64(encoded.front, static_cast<std::uint64_t>(encoded.tail))));
}

Cloud shape_of(std::uint32_t height, std::uint32_t width, const std::vector<Field>& fields,
               std::uint32_t point_bytes, bool dense) {
  Cloud shape;
  shape.height = height;
  shape.width = width;
  shape.fields = fields;
  shape.point_bytes = point_bytes;
  shape.dense = dense;
  return shape;
}

bool parse(std::string_view text, std::uint64_t& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc{} && end == text.data() + text.size();
}

}  // namespace

std::uint64_t xxh64(ByteView bytes, std::uint64_t seed) noexcept {
  const std::byte* at = bytes.data();
  std::size_t left = bytes.size();
  std::uint64_t hash = seed + prime_5;
  constexpr std::size_t stripe = 32;
  if (left >= stripe) {
    std::uint64_t a = seed + prime_1 + prime_2;
    std::uint64_t b = seed + prime_2;
    std::uint64_t c = seed;
    std::uint64_t d = seed - prime_1;
    for (; left >= stripe; at += stripe, left -= stripe) {
      a = round_of(a, little<std::uint64_t>(at));
      b = round_of(b, little<std::uint64_t>(at + 8));
      c = round_of(c, little<std::uint64_t>(at + 16));
      d = round_of(d, little<std::uint64_t>(at + 24));
    }
    hash = std::rotl(a, 1) + std::rotl(b, 7) + std::rotl(c, 12) + std::rotl(d, 18);
    for (const std::uint64_t lane : {a, b, c, d}) {
      hash = (hash ^ round_of(0, lane)) * prime_1 + prime_4;
    }
  }
  hash += bytes.size();
  for (; left >= 8; at += 8, left -= 8) {
    hash = std::rotl(hash ^ round_of(0, little<std::uint64_t>(at)), 27) * prime_1 + prime_4;
  }
  if (left >= 4) {
    hash = std::rotl(hash ^ little<std::uint32_t>(at) * prime_1, 23) * prime_2 + prime_3;
    at += 4;
    left -= 4;
  }
  for (; left > 0; ++at, --left) {
    hash = std::rotl(hash ^ std::to_integer<std::uint64_t>(*at) * prime_5, 11) * prime_1;
  }
  hash = (hash ^ (hash >> 33U)) * prime_2;
  hash = (hash ^ (hash >> 29U)) * prime_3;
  return hash ^ (hash >> 32U);
}

EncodedCloud encode_tagged(const Cloud& cloud, std::uint64_t sequence, std::int64_t stamp_ns) {
  const std::string front = fmt::format("lidar/{:06}", sequence);
  const Cloud shape = shape_of(cloud.height, cloud.width, cloud.fields, cloud.point_bytes, cloud.dense);
  return encode(cloud, stamp_ns, front + "/" + sum_of(shape, stamp_ns, front, cloud.data));
}

tl::expected<Tagged, std::string> check_tagged(ByteView cdr) {
  const auto view = decode(cdr);
  if (!view) {
    return tl::unexpected{view.error()};
  }
  Tagged result;
  result.stamp_ns = view->stamp_ns;
  const std::string_view tag = view->frame_id;
  const std::size_t first = tag.find('/');
  const std::size_t second = tag.rfind('/');
  if (first == second || tag.substr(0, first) != "lidar" ||
      !parse(tag.substr(first + 1, second - first - 1), result.sequence)) {
    return tl::unexpected{std::string{"frame_id is not that of the demo"}};
  }
  const Cloud shape = shape_of(view->height, view->width, view->fields, view->point_bytes, view->dense);
  if (view->big_endian) {
    result.reason = "is_bigendian has changed";
  } else if (sum_of(shape, view->stamp_ns, tag.substr(0, second), view->data) != tag.substr(second + 1)) {
    result.reason = "the checksum does not fit the content";
  } else {
    result.intact = true;
  }
  return result;
}

}  // namespace trestle::bridge::demo
