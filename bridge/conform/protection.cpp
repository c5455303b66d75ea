#include "bridge/conform/protection.hpp"

#include <algorithm>
#include <array>

namespace trestle::conform {
namespace {

/// A CRC in the words of its catalogues: width, polynomial, initial value, reflected or not, final XOR.
struct Crc {
  unsigned width;
  std::uint64_t polynomial;
  std::uint64_t initial;
  bool reflected;
  std::uint64_t last_xor;

  [[nodiscard]] std::uint64_t of(ByteView bytes) const {
    const std::uint64_t mask = width == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << width) - 1;
    std::uint64_t sum = initial;
    for (const std::byte one : bytes) {
      for (unsigned bit = 0; bit < 8; ++bit) {
        // Reflected: the lowest bit of each byte comes first.
        const unsigned place = reflected ? bit : 7 - bit;
        const std::uint64_t in = (std::to_integer<std::uint64_t>(one) >> place) & 1U;
        const std::uint64_t top = (sum >> (width - 1)) & 1U;
        sum = (sum << 1U) & mask;
        sum ^= (top ^ in) != 0 ? polynomial : 0;
      }
    }
    if (reflected) {
      std::uint64_t mirrored = 0;
      for (unsigned bit = 0; bit < width; ++bit) {
        mirrored = mirrored << 1U | ((sum >> bit) & 1U);
      }
      sum = mirrored;
    }
    return (sum ^ last_xor) & mask;
  }
};

// Profiles 1 and 11 begin with 0 and have no final XOR, unlike CRC-8 SAE J1850 elsewhere.
constexpr Crc crc8{8, 0x1d, 0, false, 0};
constexpr Crc crc8_h2f{8, 0x2f, 0xff, false, 0xff};
constexpr Crc crc16{16, 0x1021, 0xffff, false, 0};
constexpr Crc crc32_p4{32, 0xf4ac'fb13, 0xffff'ffff, true, 0xffff'ffff};
constexpr Crc crc64{64, 0x42f0'e1eb'a9ea'3693, ~std::uint64_t{0}, true, ~std::uint64_t{0}};

void append_u64(Bytes& to, std::uint64_t number) {
  append_u32(to, static_cast<std::uint32_t>(number >> 32U));
  append_u32(to, static_cast<std::uint32_t>(number));
}

struct Shape {
  E2eProfile profile;
  std::string_view name;
  std::size_t header_bytes;
  std::uint64_t counter_end;
};
constexpr std::array<Shape, 14> shapes{{{E2eProfile::p1, "1", 2, 15},
                                        {E2eProfile::p2, "2", 2, 16},
                                        {E2eProfile::p4, "4", 12, 1U << 16U},
                                        {E2eProfile::p4m, "4m", 16, 1U << 16U},
                                        {E2eProfile::p5, "5", 3, 1U << 8U},
                                        {E2eProfile::p6, "6", 5, 1U << 8U},
                                        {E2eProfile::p7, "7", 20, std::uint64_t{1} << 32U},
                                        {E2eProfile::p7m, "7m", 24, std::uint64_t{1} << 32U},
                                        {E2eProfile::p8, "8", 16, std::uint64_t{1} << 32U},
                                        {E2eProfile::p8m, "8m", 20, std::uint64_t{1} << 32U},
                                        {E2eProfile::p11, "11", 2, 15},
                                        {E2eProfile::p22, "22", 2, 16},
                                        {E2eProfile::p44, "44", 12, 1U << 16U},
                                        {E2eProfile::p44m, "44m", 16, 1U << 16U}}};

const Shape& shape_of(E2eProfile profile) {
  return *std::ranges::find(shapes, profile, &Shape::profile);
}

std::uint32_t number_at(ByteView bytes, std::size_t at, std::size_t size) {
  std::uint32_t number = 0;
  for (std::size_t index = 0; index < size; ++index) {
    number = number << 8U | std::to_integer<std::uint32_t>(bytes[at + index]);
  }
  return number;
}

/// What profiles for methods have at the end of their header: type in 2 bits, result in 2, source in 28.
std::uint32_t method_word(const E2eProtection& how, bool response) {
  return (response ? 1U << 30U : 0U) | (how.source & 0x0fff'ffffU);
}

/// The parts of a header around its CRC.
struct Header {
  Bytes before_crc;
  Bytes after_crc;
};

}  // namespace

std::string_view to_string(E2eProfile profile) noexcept {
  return shape_of(profile).name;
}

bool is_for_methods_alone(E2eProfile profile) noexcept {
  return profile == E2eProfile::p4m || profile == E2eProfile::p7m || profile == E2eProfile::p8m ||
         profile == E2eProfile::p44m;
}

std::size_t e2e_header_bytes(E2eProfile profile) noexcept {
  return shape_of(profile).header_bytes;
}

std::uint64_t e2e_counter_end(E2eProfile profile) noexcept {
  return shape_of(profile).counter_end;
}

std::uint32_t e2e_counter_of(E2eProfile profile, ByteView payload) noexcept {
  switch (profile) {
    case E2eProfile::p1:
    case E2eProfile::p2:
    case E2eProfile::p11:
    case E2eProfile::p22:
      return number_at(payload, 1, 1) & 0x0fU;
    case E2eProfile::p5:
      return number_at(payload, 2, 1);
    case E2eProfile::p6:
      return number_at(payload, 4, 1);
    case E2eProfile::p7:
    case E2eProfile::p7m:
      return number_at(payload, 12, 4);
    case E2eProfile::p8:
    case E2eProfile::p8m:
      return number_at(payload, 8, 4);
    default:
      return number_at(payload, 2, 2);
  }
}

Bytes protect(const E2eProtection& how, ByteView before, ByteView payload, std::uint32_t counter,
              bool response) {
  const auto length =
      static_cast<std::uint32_t>(before.size() + e2e_header_bytes(how.profile) + payload.size());
  const auto id = how.data_id;
  const auto low = static_cast<std::uint8_t>(id);
  const auto high = static_cast<std::uint8_t>(id >> 8U);
  Header header;
  // What the CRC covers: `first`, all of the message but the CRC itself, `last`.
  Bytes first;
  Bytes last;
  switch (how.profile) {
    case E2eProfile::p1:
    case E2eProfile::p11:
      append_u8(first, low);
      append_u8(first, how.nibble ? 0 : high);
      append_u8(header.after_crc,
                static_cast<std::uint8_t>((how.nibble ? (high & 0x0fU) << 4U : 0U) | counter));
      break;
    case E2eProfile::p2:
    case E2eProfile::p22:
      append_u8(header.after_crc, static_cast<std::uint8_t>(counter));
      append_u8(last, std::to_integer<std::uint8_t>(how.data_ids.at(counter)));
      break;
    case E2eProfile::p5:
      append_u8(header.after_crc, static_cast<std::uint8_t>(counter));
      append_u8(last, low);
      append_u8(last, high);
      break;
    case E2eProfile::p6:
      append_u16(header.after_crc, static_cast<std::uint16_t>(length));
      append_u8(header.after_crc, static_cast<std::uint8_t>(counter));
      append_u8(last, high);
      append_u8(last, low);
      break;
    case E2eProfile::p7:
    case E2eProfile::p7m:
    case E2eProfile::p8:
    case E2eProfile::p8m:
      append_u32(header.after_crc, length);
      append_u32(header.after_crc, counter);
      append_u32(header.after_crc, id);
      break;
    case E2eProfile::p4:
    case E2eProfile::p4m:
    case E2eProfile::p44:
    case E2eProfile::p44m:
      append_u16(header.before_crc, static_cast<std::uint16_t>(length));
      append_u16(header.before_crc, static_cast<std::uint16_t>(counter));
      append_u32(header.before_crc, id);
      break;
  }
  if (is_for_methods_alone(how.profile)) {
    append_u32(header.after_crc, method_word(how, response));
  }
  Bytes covered = first;
  append(covered, before);
  append(covered, header.before_crc);
  append(covered, header.after_crc);
  append(covered, payload);
  append(covered, last);

  Bytes all = header.before_crc;
  switch (how.profile) {
    case E2eProfile::p1:
    case E2eProfile::p11:
      append_u8(all, static_cast<std::uint8_t>(crc8.of(covered)));
      break;
    case E2eProfile::p2:
    case E2eProfile::p22:
      append_u8(all, static_cast<std::uint8_t>(crc8_h2f.of(covered)));
      break;
    case E2eProfile::p5: {
      // The only one with the low byte first.
      const auto sum = static_cast<std::uint16_t>(crc16.of(covered));
      append_u8(all, static_cast<std::uint8_t>(sum));
      append_u8(all, static_cast<std::uint8_t>(sum >> 8U));
      break;
    }
    case E2eProfile::p6:
      append_u16(all, static_cast<std::uint16_t>(crc16.of(covered)));
      break;
    case E2eProfile::p7:
    case E2eProfile::p7m:
      append_u64(all, crc64.of(covered));
      break;
    default:
      append_u32(all, static_cast<std::uint32_t>(crc32_p4.of(covered)));
      break;
  }
  append(all, header.after_crc);
  append(all, payload);
  return all;
}

Bytes protected_header(const someip::Header& header) {
  Bytes all;
  append_u16(all, value(header.client));
  append_u16(all, value(header.session));
  append_u8(all, header.protocol);
  append_u8(all, header.interface_version);
  append_u8(all, static_cast<std::uint8_t>(header.type));
  append_u8(all, static_cast<std::uint8_t>(header.return_code));
  return all;
}

}  // namespace trestle::conform
