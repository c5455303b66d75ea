#pragma once
#include <cstddef>
#include <string>

namespace trestle::traffic {

/// A rule that some bytes break.
struct Violation {
  const char* name = "";  ///< what is wrong; a WireError's name where there is one
  const char* rule = "";  ///< requirement of the Open SOME/IP Specification; empty if none speaks of it
  std::size_t offset = 0;
  std::string detail;   ///< for people
  std::string field{};  ///< of a payload that does not fit its description; else empty
};

}  // namespace trestle::traffic
