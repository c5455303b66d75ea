#include <trestle/fuzz/mutate/generate.hpp>
#include <trestle/fuzz/mutate/typed.hpp>

int main() {
  trestle::fuzz::Random random{1};
  trestle::fuzz::Bytes message = trestle::fuzz::make_request({.service = 0x1234, .methods = {1}}, 32, random);
  trestle::fuzz::mutate(message, 1400, random);
  using trestle::fuzz::Shape;
  const Shape number{.parts = {{.kind = Shape::Kind::number, .bytes = 4}}};
  const bool right = trestle::fuzz::make_payload(number, 1400, random).size() == 4;
  return message.empty() || !right ? 1 : 0;
}
