#include "ets/interface.hpp"

#include <algorithm>
#include <iterator>

#include <trestle/someip/wire/payload_reader.hpp>
#include <trestle/someip/wire/payload_writer.hpp>

namespace ets {
namespace {

/// What a method reads from and writes to.
struct Parameters {
  PayloadReader in;
  PayloadWriter out;
  std::span<char> text;
};

template <typename T>
constexpr T reversed_bits(T number) noexcept {
  T result = 0;
  for (unsigned bit = 0; bit < sizeof(T) * 8; ++bit) {
    result = static_cast<T>(2U * result + ((static_cast<unsigned>(number) >> bit) & 1U));
  }
  return result;
}

// Each copies a value of one kind. What was not there is read as 0; the reader remembers that it failed.
void one_byte(Parameters& p) noexcept {
  p.out.u8(p.in.u8());
}
void four_bytes(Parameters& p) noexcept {
  p.out.u32(p.in.u32());
}
void eight_bytes(Parameters& p) noexcept {
  p.out.u64(p.in.u64());
}
void byte_array(Parameters& p) noexcept {
  p.out.byte_array(p.in.byte_array());
}

void shaped_as_e2e(Parameters& p) noexcept {
  for (int count = 0; count < 4; ++count) {
    four_bytes(p);
  }
  one_byte(p);
}

void fixed_text(Parameters& p) noexcept {
  constexpr std::size_t size = 64;
  p.out.fixed_string(p.in.fixed_string(size, p.text), size);
}
void text(Parameters& p) noexcept {
  p.out.string(p.in.string(p.text));
}

/// Of uint8, uint16, uint32.
void union_of_three(Parameters& p) noexcept {
  const auto from = p.in.begin_union(3);
  const auto to = p.out.begin_union(from.type);
  switch (from.type) {
    case 1:
      p.out.u8(p.in.u8());
      break;
    case 2:
      p.out.u16(p.in.u16());
      break;
    default:
      p.out.u32(p.in.u32());
      break;
  }
  p.in.end(from.open);
  p.out.end(to);
}

void sum(Parameters& p) noexcept {
  const std::uint32_t first = p.in.u8();
  p.out.u32(first + p.in.u16());
}

/// The basic types, in reverse order.
void common_types(Parameters& p) noexcept {
  const bool a = p.in.boolean();
  const std::uint8_t b = p.in.u8();
  const std::uint16_t c = p.in.u16();
  const std::uint32_t d = p.in.u32();
  const std::int8_t e = p.in.i8();
  const std::int16_t f = p.in.i16();
  const std::int32_t g = p.in.i32();
  const std::uint32_t h = p.in.u32();  // a float32, bit for bit
  p.out.u64(p.in.u64());               // a float64, likewise
  p.out.u32(h);
  p.out.i32(g);
  p.out.i16(f);
  p.out.i8(e);
  p.out.u32(d);
  p.out.u16(c);
  p.out.u8(b);
  p.out.boolean(a);
}

void array_of_arrays(Parameters& p) noexcept {
  auto from = p.in.begin_array();
  const auto to = p.out.begin_array();
  while (p.in.more(from)) {
    byte_array(p);
  }
  p.in.end(from);
  p.out.end(to);
}

void five_bytes(Parameters& p) noexcept {
  p.out.bytes(p.in.bytes(5));
}

void bits(Parameters& p) noexcept {
  p.out.u8(reversed_bits(p.in.u8()));
  p.out.u16(reversed_bits(p.in.u16()));
  p.out.u32(reversed_bits(p.in.u32()));
}

constexpr PayloadRules usual{};
constexpr PayloadRules in_utf16{.string_encoding = StringEncoding::utf16be};
constexpr PayloadRules array_length_8{.array_length = FieldWidth::bits8};
constexpr PayloadRules array_length_16{.array_length = FieldWidth::bits16};

struct Echo {
  MethodId method{};
  void (*copy)(Parameters&) noexcept = nullptr;
  const PayloadRules* rules = &usual;
};

// With their types written out, here and below: GCC 12 puts constants of a deduced type into RAM.
constexpr std::array<Echo, echoes.size()> how_to_echo{{
    {echo_uint8, one_byte},
    {MethodId{0x09}, byte_array},
    {MethodId{0x0a}, one_byte},
    {MethodId{0x0b}, shaped_as_e2e},
    {MethodId{0x0e}, one_byte},
    {MethodId{0x12}, eight_bytes},
    {MethodId{0x13}, fixed_text},
    {MethodId{0x14}, fixed_text, &in_utf16},
    {MethodId{0x15}, text},
    {MethodId{0x16}, text, &in_utf16},
    {MethodId{0x17}, one_byte},
    {MethodId{0x19}, union_of_three},
    {MethodId{0x1f}, sum},
    {MethodId{0x23}, common_types},
    {MethodId{0x35}, array_of_arrays},
    {MethodId{0x36}, five_bytes},
    {MethodId{0x37}, byte_array},  // of three to five elements
    {MethodId{0x3e}, byte_array, &array_length_8},
    {MethodId{0x3f}, byte_array, &array_length_16},
    {MethodId{0x41}, bits},
}};
static_assert(std::ranges::equal(how_to_echo, echoes, {}, &Echo::method));

constexpr MethodId echo_few{0x37};
constexpr std::size_t few_at_least = 4 + 3;  // with the length field
constexpr std::size_t few_at_most = 4 + 5;

// What is protected: 8 bytes of the SOME/IP header, the E2E header, four bytes of payload.
constexpr std::uint32_t data_bits(std::uint32_t header_bytes) {
  return (8 + header_bytes + 4) * 8;
}
constexpr std::array<std::uint8_t, 16> data_ids{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
// The first request of a client is as good as any.
constexpr e2e::EarlySequence early{.behavior = e2e::Behavior::pre_r4_2};
constexpr std::array<e2e::Config, protected_echoes.size()> protections{
    e2e::Profile1{.data_id = 0x0123, .data_bits = data_bits(2), .sequence = early},
    e2e::Profile2{.data_id_list = data_ids, .data_bits = data_bits(2), .sequence = early},
    e2e::Profile4{.data_id = 0x0a0b'0c04},
    e2e::Profile4m{{.data_id = 0x0a0b'0c14}},
    e2e::Profile5{.data_id = 0x0105, .data_bits = data_bits(3)},
    e2e::Profile6{.data_id = 0x0106},
    e2e::Profile7{.data_id = 0x0a0b'0c07},
    e2e::Profile7m{{.data_id = 0x0a0b'0c17}},
    e2e::Profile8{{.data_id = 0x0a0b'0c08}},
    e2e::Profile11{.data_id = 0x0b23, .data_id_mode = e2e::DataIdMode::nibble, .data_bits = data_bits(2)},
    e2e::Profile22{.data_id_list = data_ids, .data_bits = data_bits(2)},
    e2e::Profile44{{.data_id = 0x0a0b'0c44}},
    e2e::Profile44m{{.data_id = 0x0a0b'0c54}},
    e2e::Profile8m{{.data_id = 0x0a0b'0c18}}};

}  // namespace

const e2e::Config& protection_of(MethodId method) noexcept {
  return protections[place_of_protected(method)];
}

Result<ByteView, ReturnCode> echo(MethodId method, ByteView payload, const Room& room) noexcept {
  const auto found = std::ranges::find(how_to_echo, method, &Echo::method);
  const Echo how = found != how_to_echo.end() ? *found
                   : is_protected(method)     ? Echo{method, four_bytes}
                                              : Echo{};
  if (how.copy == nullptr) {
    return tl::unexpected{ReturnCode::unknown_method};
  }
  Parameters parameters{.in = PayloadReader{payload, *how.rules},
                        .out = PayloadWriter{room.answer, *how.rules},
                        .text = room.text};
  how.copy(parameters);
  if (const auto error = parameters.in.error()) {
    return tl::unexpected{*error == WireError::no_room ? ReturnCode::not_ok : ReturnCode::malformed_message};
  }
  const auto answer = parameters.out.finish();
  if (!answer) {
    return tl::unexpected{ReturnCode::not_ok};
  }
  if (method == echo_few && (answer->size() < few_at_least || answer->size() > few_at_most)) {
    return tl::unexpected{ReturnCode::malformed_message};
  }
  return *answer;
}

}  // namespace ets
