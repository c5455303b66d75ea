#pragma once
#include <memory>
#include <string>
#include <vector>

#include "bridge/cli/options.hpp"
#include "bridge/describe/interfaces.hpp"

namespace trestle::cli {

/// --interfaces: descriptions by which a command speaks in names. What is wrong with them is thrown as
/// CLI::ValidationError, after all of it was printed.
class InterfaceOptions {
 public:
  /// @param also  what one can do with it, for the help.
  void add_to(CLI::App& command, const std::string& also);

  /// Reads the descriptions, if there are any. Call once, before the others.
  void load();
  /// Null: none were given.
  [[nodiscard]] const describe::Interfaces* get() const noexcept { return interfaces_.get(); }
  [[nodiscard]] std::vector<std::string>& files() noexcept { return files_; }

 private:
  std::vector<std::string> files_;
  std::unique_ptr<const describe::Interfaces> interfaces_;
};

/// What the arguments SERVICE[.INSTANCE] and ELEMENT of a command mean, by names or by ids.
struct Target {
  ServiceArgument service{};
  std::optional<std::size_t> described{};  ///< index of the service in the model; nothing: it is not there
  std::vector<const describe::ServiceElement*> elements{};  ///< those that are named
  const describe::Instance* instance = nullptr;  ///< the instance of the description, if it is there
  std::uint8_t major = 1;                        ///< by the description
  std::uint32_t minor = 0;
};

/// Reads SERVICE[.INSTANCE] or SERVICE[.INSTANCE].ELEMENT.
/// @param interfaces    null: only ids.
/// @param any_instance  whether none need be named, even where the description has several; without it the
///                      description's only instance is taken.
[[nodiscard]] Target parse_target(const describe::Interfaces* interfaces, const std::string& text,
                                  bool any_instance);
/// Adds an element of the target's service: "moved", "Door.moved", or an id.
/// @param name  of the argument, for errors.
/// @return those that were added.
std::vector<const describe::ServiceElement*> add_element(const describe::Interfaces* interfaces,
                                                         Target& target, const std::string& name,
                                                         const std::string& text);

}  // namespace trestle::cli
