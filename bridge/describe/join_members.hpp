#pragma once
#include <optional>
#include <string_view>
#include <vector>

#include "bridge/describe/contradictions.hpp"
#include "bridge/describe/model.hpp"

/// How what one description knows of a service is put into another one, for join().
namespace trestle::describe {

template <typename T>
void fill(std::optional<T>& to, const std::optional<T>& from) {
  if (!to) {
    to = from;
  }
}
void fill(Notes& to, const Notes& from);
void fill(std::vector<someip::EventgroupId>& to, const std::vector<someip::EventgroupId>& from);

/// Tells of what two descriptions of the E2E protection of one message say differently.
void compare_protections(std::string_view message, const Protection& first, const Place& first_at,
                         const Protection& second, const Place& second_at, Contradictions& contradictions);

/// Adds what `from` knows of `to`, by the ids of the members: what `to` knows itself stays, and where `from`
/// says something else, this is told. Members that `to` does not have are added.
void add_service(Service& to, const Service& from, Contradictions& contradictions);

}  // namespace trestle::describe
