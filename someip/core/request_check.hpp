#pragma once
#include <optional>

#include "someip/wire/header.hpp"

namespace trestle::someip {

/// What a server does where the specification leaves it open, or where the configuration of an interface
/// decides; the values below are what the specification does by itself.  [feat_req_someip_598]
struct AnswerRules {
  /// The type of messages that carry an error: RESPONSE, or ERROR (0x81) where the interface is configured
  /// so. [feat_req_someip_726] [feat_req_someip_106] [feat_req_someip_101]
  MessageType error_type = MessageType::response;
  bool answer_unknown_service = true;          ///< optional  [feat_req_someip_816]
  bool answer_unknown_method = true;           ///< optional  [feat_req_someip_816]
  bool answer_wrong_interface_version = true;  ///< as the flow chart has it  [feat_req_someip_718]
  /// The flow chart has this answer, elsewhere it is obsolete.  [feat_req_someip_718] [feat_req_someip_818]
  bool answer_wrong_protocol_version = true;
  /// Whether a request whose return code is not E_OK, as it has to be [feat_req_someip_683], is processed as
  /// if it were; else it is dropped. No error is sent for one in either case.  [feat_req_someip_704]
  bool process_request_with_return_code = true;
  friend constexpr bool operator==(const AnswerRules&, const AnswerRules&) = default;
};

/// What a method is configured as.
enum class MethodKind : std::uint8_t {
  unknown,           ///< no such method
  request_response,  ///< called by REQUEST
  fire_and_forget,   ///< called by REQUEST_NO_RETURN
  either,            ///< whichever the caller likes
};

/// What the receiver of a message knows about what it is addressed to.
struct RequestTarget {
  bool service = false;                     ///< the Service ID is known at the endpoint it came to
  bool interface_version = false;           ///< that service has this Interface Version there
  MethodKind method = MethodKind::unknown;  ///< of that service in that version
};

/// What check_request() found: what is wrong with a message, and what to answer.
struct RequestCheck {
  /// What is wrong with the message; nothing: hand it to the method.
  std::optional<ReturnCode> fault;
  /// The header of the message to answer it with, which has no payload; nothing when it is dropped silently.
  std::optional<Header> answer;
};

/// Judges a received message that is no notification that was subscribed to and no answer to a call, in the
/// order of the specification's flow chart.  [feat_req_someip_721] [feat_req_someip_718]
///
/// Not here: headers that are incomplete never get this far [feat_req_someip_798], segments are put together
/// before, answers are CallTable's, and whether a payload can be deserialised is for the method to find out,
/// which then answers with ReturnCode::malformed_message.
[[nodiscard]] RequestCheck check_request(const Header& received, const RequestTarget& target,
                                         const AnswerRules& rules = {}) noexcept;

/// The header of the message that answers `request`, with success or with an error.  [feat_req_someip_338]
/// [feat_req_someip_655] A payload goes with success, and with an error only where the interface says so.
[[nodiscard]] Header answer_header(const Header& request, ReturnCode code,
                                   const AnswerRules& rules = {}) noexcept;

/// The header of the error message for `received`; its payload is empty.  [feat_req_someip_655]
///
/// @param code  why; not ReturnCode::ok.
/// @return nothing when no error may be sent: to events, fire-and-forget requests, responses and errors.
///         [feat_req_someip_597] [feat_req_someip_654] [feat_req_someip_348] [feat_req_someip_704]
[[nodiscard]] std::optional<Header> error_answer(const Header& received, ReturnCode code,
                                                 const AnswerRules& rules = {}) noexcept;

}  // namespace trestle::someip
