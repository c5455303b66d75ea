#pragma once
#include <optional>
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

/// Adds what `from` knows of `to`, by the ids of the members: what `to` knows itself stays, and where `from`
/// says something else, this is told. Members that `to` does not have are added.
void add_service(Service& to, const Service& from, Contradictions& contradictions);

}  // namespace trestle::describe
