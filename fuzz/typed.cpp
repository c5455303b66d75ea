// Property: whatever payload there is, and whatever shape, fuzz::mutate_payload() ends within its room; and
// the values of a payload are written so that, where that can be read, they are written the same again.
//
// Input: four bytes of a seed, the shape as in parse(), a byte 0xff, and the payload.
#include <algorithm>
#include <cstdlib>
#include <vector>

#include "fuzz/mutate/typed.hpp"
#include "fuzz/mutate/value_tree.hpp"
#include "someip/wire/bytes.hpp"

using namespace trestle;
using fuzz::Shape;

namespace {

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

/// A byte of the kind, one of how it stands there; those that have others in them take these up to a byte
/// 0xfe or 0xff.
std::vector<Shape> parse(someip::ByteReader& in, int depth) {
  std::vector<Shape> shapes;
  while (shapes.size() < 5) {
    const std::uint8_t kind = in.u8();
    if (kind >= 0xfe || in.failed()) {
      break;
    }
    const std::uint8_t how = in.u8();
    Shape shape{.kind = Shape::Kind{static_cast<std::uint8_t>(kind % 5)},
                .order = (how & 1U) != 0 ? std::endian::big : std::endian::little,
                .bytes = static_cast<std::uint8_t>(1U << (how >> 1U & 3U)),
                .length = static_cast<std::uint8_t>(how >> 1U & 3U)};
    shape.length = static_cast<std::uint8_t>(shape.length == 3 ? 4 : shape.length);
    shape.encoding = Shape::Encoding{static_cast<std::uint8_t>(how % 3)};
    shape.bom = (how & 8U) != 0;
    shape.terminator = (how & 16U) != 0;
    // Without a length, something has to say where it ends.
    shape.terminator = shape.terminator || shape.length == 0;
    shape.fixed_bytes = (how & 32U) != 0 ? 8 : 0;
    shape.alignment = (how & 64U) != 0 ? 4 : 1;
    shape.length_first = (how & 128U) != 0;
    if (shape.kind == Shape::Kind::number) {
      shape.bits =
          (how & 8U) != 0 ? static_cast<std::uint8_t>(1 + kind / 5 % (shape.bytes * 8)) : std::uint8_t{0};
    } else if (shape.kind != Shape::Kind::text && depth < 3) {
      shape.parts = parse(in, depth + 1);
    }
    if (shape.kind == Shape::Kind::list) {
      shape.parts.resize(1, Shape{.kind = Shape::Kind::number});
      shape.most = (how & 32U) != 0 ? 3 : shape.most;
      shape.fewest = (how & 64U) != 0 && (how & 32U) != 0 ? 3 : 0;
    }
    if (shape.kind == Shape::Kind::choice) {
      shape.parts.resize(std::max<std::size_t>(shape.parts.size(), 1), Shape{.kind = Shape::Kind::number});
      for (std::uint32_t selector = 1; selector <= shape.parts.size(); ++selector) {
        shape.selectors.push_back(selector);
      }
    }
    shapes.push_back(std::move(shape));
  }
  return shapes;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  someip::ByteReader in{std::as_bytes(std::span{data, size})};
  fuzz::Random random{in.u32()};
  const Shape shape{.parts = parse(in, 0)};
  const ByteView rest = in.rest();
  fuzz::Bytes payload{rest.begin(), rest.end()};
  if (const auto values = fuzz::read_values(payload, shape)) {
    const fuzz::Bytes again = fuzz::write_values(*values);
    if (const auto second = fuzz::read_values(again, shape)) {
      require(fuzz::write_values(*second) == again);
    }
  }
  for (int count = 0; count < 4; ++count) {
    fuzz::mutate_payload(payload, shape, 2'000, random);
    require(payload.size() <= 2'000);
  }
  return 0;
}
