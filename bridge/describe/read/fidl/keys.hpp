#pragma once
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/describe/read/fidl/fdepl_tree.hpp"

/// The keys of CommonAPI's deployment specifications for SOME/IP, versions 1 and 2, and of their core.
namespace trestle::describe::fidl {

/// Whether a deployment of this specification is read: SOME/IP's, or the core's.
[[nodiscard]] bool is_known_specification(std::string_view name);

/// All of them, sorted.
[[nodiscard]] const std::vector<std::string>& known_keys();

/// The keys of a specification among the files.
struct DeclaredKeys {
  Name specification{};
  std::string base{};  ///< the specification that it extends
  std::set<std::string, std::less<>> keys{};
  std::set<std::string, std::less<>> unread{};  ///< those that a deployment has, and nobody knows
};

/// Warns of keys that nobody knows, or that mean nothing where they stand, in the element and all within it.
/// @param declared  that of the deployment and those that it extends; what one of them declares is put into
/// its `unread`
void check_keys(const Node& deployment, const std::vector<DeclaredKeys*>& declared, Problems& findings);

/// Reads values; anything else than a value of the kind is an error.
[[nodiscard]] std::optional<std::int64_t> number_of(const Setting& setting, std::int64_t min,
                                                    std::int64_t max, Problems& findings);
[[nodiscard]] std::vector<std::int64_t> numbers_of(const Setting& setting, std::int64_t min, std::int64_t max,
                                                   Problems& findings);
[[nodiscard]] std::vector<std::string> texts_of(const Setting& setting, Problems& findings);
[[nodiscard]] std::optional<bool> truth_of(const Setting& setting, Problems& findings);
/// One of the words; the first when it is none of them.
[[nodiscard]] std::size_t word_of(const Setting& setting, const std::vector<std::string>& words,
                                  Problems& findings);
/// As a FDEPL file has it: 5, "text", { 1, 2 }.
[[nodiscard]] std::string written(const Setting& setting);

}  // namespace trestle::describe::fidl
