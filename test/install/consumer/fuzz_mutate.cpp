#include <trestle/fuzz/mutate/generate.hpp>

int main() {
  trestle::fuzz::Random random{1};
  trestle::fuzz::Bytes message = trestle::fuzz::make_request({.service = 0x1234, .methods = {1}}, 32, random);
  trestle::fuzz::mutate(message, 1400, random);
  return message.empty() ? 1 : 0;
}
