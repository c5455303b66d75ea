// Does not compile: for each CASE the compiler has to say why. See test/someip/CMakeLists.txt.
#include "someip/net/parameters.hpp"

namespace trestle::someip {

struct Parameter {
#if CASE == 1
  std::optional<int> limit{};
#elif CASE == 2
  int* count = nullptr;
#elif CASE == 3
  std::variant<int, std::monostate> limit{};
#elif CASE == 4
  int first = 0;
  int second = 0;
  static constexpr std::array data_ids{1};
#elif CASE == 5
  int first = 0;
  int second = 0;
  static constexpr std::array data_ids{1, 1};
#elif CASE == 6
  int first = 0;
  static constexpr std::array data_ids{0x1000};
#endif
};

#ifdef READ
const auto read = unpack<Parameter>({});
#else
const auto written = pack(Parameter{});
#endif

}  // namespace trestle::someip
