// Property: whatever unpack() accepts, by any rules, pack() writes again, and those bytes are the same
// values.
//
// The input is 4 bytes of rules, one that chooses the type, and the payload.
#include <cstdlib>
#include <cstring>

#include "fuzz/payload_rules.hpp"
#include "someip/net/parameters.hpp"

using namespace trestle;
using namespace trestle::someip;

namespace {

enum class Colour : std::uint8_t { red };
struct Point {
  std::int16_t x = 0;
  std::uint64_t y = 0;
  Colour colour{};
};
struct Texts {
  std::string name;
  std::u16string title;
  FixedString<12> plate;
  std::vector<std::u16string> others;
};
struct Numbers {
  bool flag = false;
  std::vector<std::uint8_t> bytes;
  LittleEndian<std::array<std::int32_t, 2>> pair{};
  std::map<std::uint8_t, std::uint16_t> map;
};
using Choice = std::variant<std::monostate, std::uint8_t, Point, FixedString<9>>;
using Union = std::vector<std::variant<Choice, std::string, std::vector<Choice>>>;
struct Tagged {
  std::uint16_t number = 0;
  std::optional<std::string> text{};
  std::optional<std::variant<std::uint32_t, Point>> choice{};
  std::optional<std::vector<Point>> points{};
  static constexpr std::array data_ids{1, 2, 3, 0xfff};
};
struct Nested {
  std::optional<Tagged> inner{};
  std::optional<FixedString<9>> fixed{};
  std::optional<std::array<std::u16string, 2>> titles{};
  static constexpr std::array data_ids{7, 0, 9};
};

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

template <typename T>
void check(ByteView payload, const PayloadRules& rules) {
  const auto value = unpack<T>(payload, rules);
  if (!value) {
    return;
  }
  std::vector<std::byte> bytes;
  try {
    bytes = pack(rules, *value);
  } catch (const std::invalid_argument&) {
    // Padding that was left out can be too much for a short length field; a tag may announce a length field
    // that the writer may not choose; and a tagged struct without one may have been the last of its kind.
    require(rules.alignment > 1 || !rules.smallest_tagged_length || rules.struct_length == FieldWidth::none);
    return;
  }
  // As bytes: not every value equals itself.
  const auto again = unpack<T>(bytes, rules);
  require(again && pack(rules, *again) == bytes);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input{std::as_bytes(std::span{data, size})};
  const PayloadRules rules = fuzz::payload_rules(input);
  switch (input.next() % 6) {
    case 0:
      check<Texts>(input.rest(), rules);
      break;
    case 1:
      check<Numbers>(input.rest(), rules);
      break;
    case 2:
      check<Union>(input.rest(), rules);
      break;
    case 3:
      check<Tagged>(input.rest(), rules);
      break;
    case 4:
      check<Nested>(input.rest(), rules);
      break;
    default:
      check<std::vector<Nested>>(input.rest(), rules);
      break;
  }
  return 0;
}
