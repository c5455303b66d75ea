// What payloads are made of: a struct with tags, a union and strings of other kinds, as bytes and back.
#include <cstdio>

#include <trestle/someip/net/parameters.hpp>

using namespace trestle::someip;

struct Circle {
  float radius = 0;
};
struct Polygon {
  std::vector<float> corners;
};
using Shape = std::variant<std::monostate, Circle, Polygon>;  // type 0 is no shape, 1 a circle, 2 a polygon

struct Obstacle {
  std::uint32_t number = 0;
  Shape shape;
  FixedString<12> kind;                // 12 bytes, BOM and terminator included
  std::optional<std::u16string> note;  // in UTF-16; may be left out
  static constexpr std::array data_ids{1, 2, 3, 9};
};

int main() {
  const Obstacle cone{.number = 7, .shape = Circle{0.25F}, .kind = {"cone"}, .note = {}};
  const std::vector<std::byte> payload = pack(cone);
  for (const std::byte byte : payload) {
    std::printf("%02x", std::to_integer<unsigned>(byte));
  }
  const auto obstacle = unpack<Obstacle>(payload);
  if (!obstacle) {
    std::printf("\nno obstacle: %s\n", to_string(obstacle.error()));
    return 1;
  }
  const Circle* circle = std::get_if<Circle>(&obstacle->shape);
  std::printf("\n%s %u: radius %.2f, %s\n", obstacle->kind.text.c_str(), obstacle->number,
              circle != nullptr ? circle->radius : 0, obstacle->note ? "with a note" : "no note");
}
