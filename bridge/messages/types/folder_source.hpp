#pragma once
#include <filesystem>

#include "bridge/messages/types/type_source.hpp"

namespace trestle::messages {

/// A folder of `.msg`, `.srv`, `.action` and `.idl` files. "pkg/msg/Type" is `pkg/msg/Type.msg` or
/// `share/pkg/msg/Type.msg`. Where there is an `.idl` file beside the other one, which says the same, that
/// is not looked at.
class FolderSource : public TypeSource {
 public:
  explicit FolderSource(std::filesystem::path folder) : folder_{std::move(folder)} {}

  [[nodiscard]] tl::expected<std::optional<InterfaceMessages>, TypeError> find(
      const InterfaceName& interface) const override;
  [[nodiscard]] std::string place() const override { return folder_.string(); }

 private:
  [[nodiscard]] std::filesystem::path file_of(const InterfaceName& interface) const;

  std::filesystem::path folder_;
};

}  // namespace trestle::messages
