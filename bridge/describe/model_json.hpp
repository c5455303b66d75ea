#pragma once
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// A model as JSON. Its field names are an interface: docs/describe.md has them all. What is as usual has no
/// key: an optional part that is not there, a wire rule that is the default of its kind.
/// @param with_places  whether elements tell where they were read, "place": "door.fidl:3:5".
[[nodiscard]] nlohmann::ordered_json to_json(const Model& model, bool with_places = false);

/// to_json() as text with an indent of two spaces and a line end. Bytes that are no UTF-8 become U+FFFD.
[[nodiscard]] std::string to_json_text(const Model& model, bool with_places = false);

/// Whether the outermost object of a JSON text is a model: it has these members.
[[nodiscard]] bool is_model(std::span<const std::string_view> names);

/// A text that is the same for models that mean the same: neither the order of types, services and their
/// elements counts, nor indices, places, and how often the same type is there. For comparisons; its form is
/// no interface.
[[nodiscard]] std::string canonical(const Model& model);

/// A name for each type of a model, by its index: "scope.Name". Types that are different but have one name
/// get "#2", "#3" … behind it, in the order of the model. Those without a name: "uint16", "string", "bytes",
/// or their kind and index, "array#12".
[[nodiscard]] std::vector<std::string> type_labels(const Model& model);

}  // namespace trestle::describe
