#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

/// The names of ROS 2 interfaces, "pkg/msg/Type", "pkg/srv/Type" and "pkg/action/Type", and of the messages
/// that are made from them.
namespace trestle::messages {

/// What kind of interface a name has: pkg/msg, pkg/srv, pkg/action.
enum class InterfaceKind : std::uint8_t { message, service, action };

/// The part of the name that tells them apart, which is also the file's extension: "msg", "srv", "action".
[[nodiscard]] std::string_view to_string(InterfaceKind kind) noexcept;

/// A name in its parts. Each is a letter with letters, digits and underscores after it, and so safe as a part
/// of a path.
struct InterfaceName {
  std::string package;
  InterfaceKind kind = InterfaceKind::message;
  std::string type;
  [[nodiscard]] std::string full() const;  ///< "pkg/srv/Type"
  friend bool operator==(const InterfaceName&, const InterfaceName&) = default;
};

/// The parts of "pkg/msg/Type", "pkg/srv/Type" or "pkg/action/Type". Of "pkg/Type", too: its kind is `usual`.
[[nodiscard]] std::optional<InterfaceName> interface_name(std::string_view name,
                                                          InterfaceKind usual = InterfaceKind::message);

/// The name of a service's messages end in these. rosidl makes the last from the first two.
inline constexpr std::array<std::string_view, 3> service_suffixes{"_Request", "_Response", "_Event"};
/// The parts of an action in the order of its file.
inline constexpr std::array<std::string_view, 3> action_suffixes{"_Goal", "_Result", "_Feedback"};
/// The services that rosidl makes from an action, beside the message X_FeedbackMessage. (Cancelling is
/// action_msgs/srv/CancelGoal for all actions.)
inline constexpr std::array<std::string_view, 2> action_services{"_SendGoal", "_GetResult"};

/// The interface in whose file a message is defined: of "pkg/srv/Name_Request" it is pkg/srv/Name, of
/// "pkg/action/Name_SendGoal_Request" pkg/action/Name, and of a message itself. Nothing when its name is not
/// formed like that of a message: "pkg/srv/Name" is a service, and no message.
[[nodiscard]] std::optional<InterfaceName> defining_interface(const InterfaceName& message);

}  // namespace trestle::messages
