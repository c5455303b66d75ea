#include "bridge/messages/types/interface_name.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "bridge/messages/types/characters.hpp"

namespace trestle::messages {
namespace {

constexpr std::array kinds{InterfaceKind::message, InterfaceKind::service, InterfaceKind::action};

/// Removes the first of the suffixes that it has; false if it has none, or nothing before it.
bool remove_suffix(std::string& type, std::span<const std::string_view> suffixes) {
  for (const std::string_view suffix : suffixes) {
    if (type.ends_with(suffix) && type.size() > suffix.size()) {
      type.resize(type.size() - suffix.size());
      return true;
    }
  }
  return false;
}

}  // namespace

std::string_view to_string(InterfaceKind kind) noexcept {
  switch (kind) {
    case InterfaceKind::message:
      return "msg";
    case InterfaceKind::service:
      return "srv";
    case InterfaceKind::action:
      return "action";
  }
  return "?";
}

std::string InterfaceName::full() const {
  return fmt::format("{}/{}/{}", package, to_string(kind), type);
}

std::optional<InterfaceName> interface_name(std::string_view name, InterfaceKind usual) {
  const std::size_t first = name.find('/');
  if (first == std::string_view::npos) {
    return std::nullopt;
  }
  InterfaceName parts{std::string{name.substr(0, first)}, usual, {}};
  name.remove_prefix(first + 1);
  if (const std::size_t second = name.find('/'); second != std::string_view::npos) {
    const auto* const kind = std::ranges::find_if(
        kinds, [&](InterfaceKind one) { return to_string(one) == name.substr(0, second); });
    if (kind == kinds.end()) {
      return std::nullopt;
    }
    parts.kind = *kind;
    name.remove_prefix(second + 1);
  }
  parts.type = name;
  return is_identifier(parts.package) && is_identifier(parts.type) ? std::optional{std::move(parts)}
                                                                   : std::nullopt;
}

std::optional<InterfaceName> defining_interface(const InterfaceName& message) {
  InterfaceName interface = message;
  switch (message.kind) {
    case InterfaceKind::message:
      return interface;
    case InterfaceKind::service:
      return remove_suffix(interface.type, service_suffixes) ? std::optional{std::move(interface)}
                                                             : std::nullopt;
    case InterfaceKind::action: {
      constexpr std::array<std::string_view, 1> feedback_message{"_FeedbackMessage"};
      const bool is_message = remove_suffix(interface.type, service_suffixes)
                                  ? remove_suffix(interface.type, action_services)
                                  : remove_suffix(interface.type, action_suffixes) ||
                                        remove_suffix(interface.type, feedback_message);
      return is_message ? std::optional{std::move(interface)} : std::nullopt;
    }
  }
  return std::nullopt;
}

}  // namespace trestle::messages
