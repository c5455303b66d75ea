#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// Members and enumerators that types have of those that they extend, counted once for each of these types.
inline constexpr std::size_t max_inherited_members = 1'000'000;

/// Makes one description of a model that several sources were appended to.
///
/// - Services without types and names of their own (of vsomeip JSON, of captures) that have the id of a
///   described one add to it what it lacks: members and eventgroups, transports, segmentation, times, E2E,
///   the version; then they are gone. Methods with the id of a getter or setter belong to that field.
/// - Two described services of one name, or of one id and name, from two files, that nobody on the wire could
///   tell apart become one: the first.
/// - Instances of the same service, id and role become one; each adds what the others lack.
///
/// @return what contradicts: two services of one name, or of one id with different names, or two members of
///         one id, told where the id stands, or two values of one setting (contradictions.hpp); ids that are
///         reserved; enumerators that the wire has no room for; and what is too large to work with: types
///         nested deeper than max_type_nesting, more than max_inherited_members
[[nodiscard]] std::vector<documents::Problem> join(Model& model);
/// The same of a model that was joined before, and was added to or edited.
/// @param told  gets the problems that are not there yet.
void join_again(Model& model, std::vector<documents::Problem>& told);

/// What contradicts in a model that reading has found errors in: to be mended together with these. What may
/// follow from the errors is left out: that two files describe a service differently, and faults of types.
/// @param told  gets the problems that are not there yet.
void join_with_errors(Model& model, std::vector<documents::Problem>& told);

/// "Door.fidl:12:3", or the file, or nothing.
[[nodiscard]] std::string to_string(const Model& model, const Place& place);

}  // namespace trestle::describe
