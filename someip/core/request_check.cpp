#include "someip/core/request_check.hpp"

#include <cassert>

namespace trestle::someip {
namespace {

// Whether the method may be called with this message type. For an unknown method either is accepted: the
// fault is then not the type.
bool is_configured(MessageType type, MethodKind method) noexcept {
  switch (method) {
    case MethodKind::request_response:
      return type == MessageType::request;
    case MethodKind::fire_and_forget:
      return type == MessageType::request_no_return;
    case MethodKind::unknown:
    case MethodKind::either:
      break;
  }
  return type == MessageType::request || type == MessageType::request_no_return;
}

std::optional<ReturnCode> fault_of(const Header& received, const RequestTarget& target) noexcept {
  if (received.protocol != protocol_version) {
    return ReturnCode::wrong_protocol_version;
  }
  if (!is_configured(received.type, target.method)) {
    return ReturnCode::wrong_message_type;
  }
  if (!target.service) {
    return ReturnCode::unknown_service;
  }
  if (!target.interface_version) {
    return ReturnCode::wrong_interface_version;
  }
  if (target.method == MethodKind::unknown) {
    return ReturnCode::unknown_method;
  }
  return std::nullopt;
}

bool is_answered(ReturnCode fault, const AnswerRules& rules) noexcept {
  switch (fault) {
    case ReturnCode::wrong_protocol_version:
      return rules.answer_wrong_protocol_version;
    case ReturnCode::unknown_service:
      return rules.answer_unknown_service;
    case ReturnCode::wrong_interface_version:
      return rules.answer_wrong_interface_version;
    case ReturnCode::unknown_method:
      return rules.answer_unknown_method;
    default:
      return true;
  }
}

}  // namespace

RequestCheck check_request(const Header& received, const RequestTarget& target,
                           const AnswerRules& rules) noexcept {
  RequestCheck check{fault_of(received, target), std::nullopt};
  if (check.fault) {
    if (is_answered(*check.fault, rules)) {
      check.answer = error_answer(received, *check.fault, rules);
    }
  } else if (received.return_code != ReturnCode::ok && !rules.process_request_with_return_code) {
    check.fault = ReturnCode::not_ok;
  }
  return check;
}

Header answer_header(const Header& request, ReturnCode code, const AnswerRules& rules) noexcept {
  assert(rules.error_type == MessageType::response || rules.error_type == MessageType::error);
  Header answer = request;             // Message ID, Request ID and Interface Version stay
  answer.protocol = protocol_version;  // never the unknown one that was received  [feat_req_someip_703]
  answer.type = code == ReturnCode::ok ? MessageType::response : rules.error_type;
  answer.return_code = code;  // [feat_req_someip_367] [feat_req_someip_683]
  return answer;
}

std::optional<Header> error_answer(const Header& received, ReturnCode code,
                                   const AnswerRules& rules) noexcept {
  // Only requests are answered [feat_req_someip_718], and a segment of one is a request too.
  if (without_tp(received.type) != MessageType::request || received.return_code != ReturnCode::ok) {
    return std::nullopt;
  }
  return answer_header(received, code, rules);
}

}  // namespace trestle::someip
