#pragma once
#include <string>
#include <vector>

/// The words of FIDL and FDEPL that readers and writers both have to know.
namespace trestle::describe {

/// Words that a name of a FIDL file may only have with ^ before it; sorted.
[[nodiscard]] const std::vector<std::string>& fidl_keywords();
/// The same of FDEPL files.
[[nodiscard]] const std::vector<std::string>& fdepl_keywords();

}  // namespace trestle::describe
