#include "bridge/measure/demo/checksum.hpp"

#include <bit>
#include <cstring>

#include "someip/wire/bytes.hpp"

namespace trestle::measure::demo {

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

std::uint64_t checksum(const EncodedCloud& cloud) noexcept {
  return xxh64(cloud.data, xxh64(cloud.front, static_cast<std::uint64_t>(cloud.tail)));
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

}  // namespace trestle::measure::demo
