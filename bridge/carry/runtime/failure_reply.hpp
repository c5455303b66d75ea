#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/messages/types/message_definition.hpp"

namespace trestle::carry {

/// What a ROS client is answered whose call went wrong, if the type of the response has a way to say so: a
/// `bool success` (false, with the reason in `string message`, `error_message` or `status_message`), as those
/// of std_srvs, or what action servers answer. All other members have their defaults.
class FailureReply {
 public:
  /// @param service  "std_srvs/srv/SetBool", "pkg/action/Name_SendGoal".
  /// @return nothing if there is no way to say it.
  [[nodiscard]] static std::optional<FailureReply> of(std::string_view service,
                                                      const messages::TypeTree& response);

  /// @param reason  for people.
  /// @param is_certain  whether what was asked for has certainly not been done.
  /// @return the response as CDR; nothing if that can only be said when it is certain.
  [[nodiscard]] std::optional<std::vector<std::byte>> sample(std::string_view reason, bool is_certain) const;

 private:
  explicit FailureReply(messages::TypeTree response) : response_{std::move(response)} {}

  messages::TypeTree response_;
  std::string reason_member_{};     ///< empty: there is none
  std::size_t longest_reason_ = 0;  ///< bytes
  std::string code_member_{};       ///< empty: there is none
  bool only_when_certain_ = false;
};

}  // namespace trestle::carry
