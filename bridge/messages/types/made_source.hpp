#pragma once
#include <functional>
#include <map>

#include "bridge/messages/types/type_source.hpp"

namespace trestle::messages {

/// Definitions that the program makes itself, as of the services for fields.
class MadeSource : public TypeSource {
 public:
  /// Adds an interface as if there were a file with this text.
  void define(const InterfaceName& interface, std::string text) {
    texts_.insert_or_assign(interface.full(), std::move(text));
  }

  [[nodiscard]] tl::expected<std::optional<InterfaceMessages>, TypeError> find(
      const InterfaceName& interface) const override;

 private:
  std::map<std::string, std::string, std::less<>> texts_;  ///< by full name
};

}  // namespace trestle::messages
