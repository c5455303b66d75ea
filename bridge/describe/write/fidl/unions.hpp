#pragma once
#include <optional>

#include "bridge/describe/model.hpp"

/// Unions whose members have one type. Franca: "Duplicate element type".
namespace trestle::describe::fidl_writing {

/// The same with a struct around each member of a union whose type an earlier member has, too. Such a struct
/// has no length field, so that the bytes are the same; an annotation tells readers that it is none of the
/// model's. Nothing where there are no such members.
[[nodiscard]] std::optional<Model> with_distinct_members(const Model& model);

}  // namespace trestle::describe::fidl_writing
