#pragma once
#include <functional>
#include <string>
#include <tl/expected.hpp>

namespace trestle::describe {

/// A file as readers get it.
struct SourceText {
  std::string name;  ///< as people know it: "fidl/Door.fidl"; in problems, and where imports start from
  std::string text;
};

/// Loads a file that another one names: its text, or why there is none.
using Load = std::function<tl::expected<std::string, std::string>(const std::string& name)>;

}  // namespace trestle::describe
