#pragma once
#include <map>
#include <memory>
#include <string>

#include "bridge/describe/lower.hpp"
#include "bridge/messages/convert/interface_binding.hpp"
#include "bridge/messages/types/type_source.hpp"

namespace trestle::describe {

/// Gives a TypeLibrary the types of a model, with ids and wire rules.
class ModelSource : public messages::TypeSource {
 public:
  /// @param place  what the model was read from, for "not found in ...".
  ModelSource(const Model& model, Lowered lowered, std::string place);

  [[nodiscard]] tl::expected<std::optional<messages::InterfaceMessages>, messages::TypeError> find(
      const messages::InterfaceName& interface) const override;
  [[nodiscard]] std::string place() const override { return place_; }
  /// Of the first member that carries this interface; `members` names all of its service that have the same
  /// rules: an event or method by its name; a field by its name (notifier), with ".get" and ".set" behind it.
  [[nodiscard]] std::shared_ptr<const messages::InterfaceBinding> binding(
      const messages::InterfaceName& interface) const override;

  [[nodiscard]] const Lowered& lowered() const noexcept { return lowered_; }

 private:
  Lowered lowered_;
  std::string place_;
  std::map<std::string, std::shared_ptr<messages::InterfaceBinding>, std::less<>> bindings_;
};

}  // namespace trestle::describe
