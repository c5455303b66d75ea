#pragma once
#include <optional>
#include <string>
#include <utility>

#include "bridge/describe/lower.hpp"
#include "bridge/messages/types/type_source.hpp"

namespace trestle::describe {

/// The messages of an interface among those of a model; nothing: the model does not have all of them.
/// @param place  what the model was read from.
[[nodiscard]] std::optional<messages::InterfaceMessages> messages_of(const Lowered& lowered,
                                                                     const messages::InterfaceName& interface,
                                                                     const std::string& place);

/// Gives a TypeLibrary the types of a model.
class ModelSource : public messages::TypeSource {
 public:
  /// @param place  what the model was read from, for "not found in ...".
  ModelSource(Lowered lowered, std::string place) : lowered_{std::move(lowered)}, place_{std::move(place)} {}

  [[nodiscard]] tl::expected<std::optional<messages::InterfaceMessages>, messages::TypeError> find(
      const messages::InterfaceName& interface) const override;
  [[nodiscard]] std::string place() const override { return place_; }
  [[nodiscard]] const Lowered& lowered() const noexcept { return lowered_; }

 private:
  Lowered lowered_;
  std::string place_;
};

}  // namespace trestle::describe
