#pragma once
#include <string>

namespace trestle::test {

/// The folder of the source tree, without a '/' at its end. Only source_dir.cpp is told of it when it is
/// compiled, so that a compiler cache knows all other tests in another clone, too.
[[nodiscard]] std::string source_dir();

}  // namespace trestle::test
