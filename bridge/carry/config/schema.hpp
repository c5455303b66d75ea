#pragma once
#include <string>

namespace trestle::carry {

/// The JSON Schema (draft 7, which editors know) of a configuration file, as JSON. It is made of what the
/// loaders ask for, so no key can be missing from it. It refuses nothing that `trestle check` accepts, and
/// what stands by itself: unknown and missing keys, words, numbers and forms of values. How values go
/// together only `check` knows.
[[nodiscard]] std::string config_schema();

}  // namespace trestle::carry
