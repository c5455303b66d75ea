#pragma once
#include <deque>
#include <span>
#include <string>
#include <vector>

#include "bridge/describe/read/fidl/fdepl_tree.hpp"
#include "bridge/describe/read/fidl/fidl_tree.hpp"
#include "bridge/describe/read/fidl/read_fidl.hpp"
#include "bridge/describe/read/source_text.hpp"

namespace trestle::describe::fidl {

struct FidlSource {
  std::uint32_t file = 0;
  FidlTree tree{};
};

struct FdeplSource {
  std::uint32_t file = 0;
  FdeplTree tree{};
  std::vector<std::uint32_t> imports{};  ///< files
  /// Of CommonAPI's specification for SOME/IP that it imports, itself or through others; 0: none.
  int version = 0;
};

/// All files that are read, parsed.
struct Sources {
  std::vector<std::string> names{};
  std::deque<FidlSource> fidl{};
  std::deque<FdeplSource> fdepl{};
  /// There was more than the limits allow. What is here is not all, so that nothing can be said of it.
  bool too_much = false;
};

/// Parses the files and all that they import.
[[nodiscard]] Sources load_sources(std::span<const SourceText> files, const Load& load,
                                   const FidlLimits& limits, Problems& findings);

/// "a/b/../c.fidl" beside "x/y.fidl" is "x/a/c.fidl".
[[nodiscard]] std::string beside(std::string_view file, std::string_view import);

}  // namespace trestle::describe::fidl
