#include "test/source_dir.hpp"

namespace trestle::test {

std::string source_dir() {
  return TRESTLE_SOURCE_DIR;
}

}  // namespace trestle::test
