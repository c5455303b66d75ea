#include "someip/core/error_answer.hpp"

namespace trestle::someip {

std::optional<Header> error_answer(const Header& received, ReturnCode code) noexcept {
  // Only requests are answered [feat_req_someip_718], and a segment of one is a request too.
  if (without_tp(received.type) != MessageType::request || received.return_code != ReturnCode::ok) {
    return std::nullopt;
  }
  Header answer = received;             // Message ID, Request ID and Interface Version stay
  answer.protocol = protocol_version;   // never the unknown one that was received  [feat_req_someip_703]
  answer.type = MessageType::response;  // 0x81 only where it is configured  [feat_req_someip_726]
  answer.return_code = code;
  return answer;
}

}  // namespace trestle::someip
