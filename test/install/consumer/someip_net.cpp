#include <trestle/someip/net/parameters.hpp>

int main() {
  const auto bytes = trestle::someip::pack(std::string{"hello"});
  return trestle::someip::unpack<std::string>(bytes) == "hello" ? 0 : 1;
}
