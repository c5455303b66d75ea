#pragma once
#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bridge/describe/model.hpp"

namespace trestle::generate {

/// What somebody wants a service to be called and where it shall be, in place of what the sources say or what
/// would be chosen: --package, --name, --major, --minor, --event, --argument, --service-id, --event-id,
/// --eventgroup, --instance-name, --instance, --address, --udp-port, --tcp-port.
class ServiceInputs {
 public:
  void add_to(CLI::App& command);

  /// Changes the one service of the model, and its first provided instance, which it makes if there is none.
  /// @return what is wrong: there are several services, or no event to give a name to.
  [[nodiscard]] std::vector<documents::Problem> apply(describe::Model& model) const;

  /// How many were given.
  [[nodiscard]] std::size_t count() const;
  /// Whether one of them is a name that the names of types are made of.
  [[nodiscard]] bool has_names() const noexcept { return package_ || name_ || event_ || argument_; }
  [[nodiscard]] const std::string& address() const noexcept { return address_; }

  /// --address is the bridge's in route files. Where they are written, an instance that has an address in the
  /// sources keeps it.
  bool writes_routes = false;

 private:
  std::optional<std::string> package_{};
  std::optional<std::string> name_{};
  std::optional<unsigned> major_{};
  std::optional<std::uint32_t> minor_{};
  std::optional<std::string> event_{};
  std::optional<std::string> argument_{};
  std::optional<std::string> service_id_{};
  std::optional<std::string> event_id_{};
  std::optional<std::string> eventgroup_{};
  std::optional<std::string> instance_name_{};
  std::optional<std::string> instance_{};
  std::string address_{};
  std::optional<std::uint16_t> udp_port_{};
  std::optional<std::uint16_t> tcp_port_{};
};

}  // namespace trestle::generate
