#pragma once
#include <cstdint>
#include <functional>
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

/// Which instance a text means that names none.
enum class UnnamedInstance : std::uint8_t {
  any,
  only,         ///< the only one of the description; where there is no such one, it is an error
  only_or_any,  ///< the only one of the description, or any; "*" is any
};

/// Reads SERVICE[.INSTANCE] or SERVICE[.INSTANCE].ELEMENT.
/// @param interfaces  null: only ids.
[[nodiscard]] Target parse_target(const describe::Interfaces* interfaces, const std::string& text,
                                  UnnamedInstance unnamed);
/// Adds an element of the target's service: "moved", "Door.moved", or an id.
/// @param name  of the argument, for errors.
/// @return those that were added.
std::vector<const describe::ServiceElement*> add_element(const describe::Interfaces* interfaces,
                                                         Target& target, const std::string& name,
                                                         const std::string& text);

/// What a Node tells of discovery, with the names of services and eventgroups: "eventgroup 0x0002 (moved) of
/// Door.0x0001".
/// @param interfaces  null: there are none.
[[nodiscard]] std::string with_names(const describe::Interfaces* interfaces, const std::string& line);
/// Prints that on standard error; Session::log() and warn() with names.
[[nodiscard]] std::function<void(const std::string& line)> named_log(const describe::Interfaces* interfaces,
                                                                     bool quiet);
[[nodiscard]] std::function<void(const std::string& line)> named_warning(
    const describe::Interfaces* interfaces);

}  // namespace trestle::cli
