#include "someip/core/request_check.hpp"

#include <gtest/gtest.h>

#include "test/covers.hpp"

namespace trestle::someip::request_check_test {
namespace {

using test::covers;

const Header request{.service = ServiceId{0x1234},
                     .method = MethodId{0x0421},
                     .client = ClientId{0x0102},
                     .session = SessionId{0x0304},
                     .interface_version = 5,
                     .type = MessageType::request};

TEST(ErrorAnswer, CopiesTheIdsOfTheRequest) {
  covers({"feat_req_someip_655", "feat_req_someip_726"});
  Header expected = request;
  expected.type = MessageType::response;
  expected.return_code = ReturnCode::unknown_method;
  EXPECT_EQ(error_answer(request, ReturnCode::unknown_method), expected);
}

TEST(ErrorAnswer, UsesTheProtocolVersionThatIsSupported) {
  covers({"feat_req_someip_703"});
  Header strange = request;
  strange.protocol = 9;
  EXPECT_EQ(error_answer(strange, ReturnCode::wrong_protocol_version)->protocol, 1);
}

TEST(ErrorAnswer, IsGivenToASegmentAsAWholeMessage) {
  Header segment = request;
  segment.type = MessageType::tp_request;
  EXPECT_EQ(error_answer(segment, ReturnCode::unknown_service)->type, MessageType::response);
}

TEST(ErrorAnswer, IsGivenToRequestsOnly) {
  covers({"feat_req_someip_597", "feat_req_someip_654", "feat_req_someip_718", "feat_req_someip_348",
          "feat_req_someip_142"});
  for (int type = 0; type < 256; ++type) {
    Header other = request;
    other.type = MessageType{static_cast<std::uint8_t>(type)};
    const bool is_request = other.type == MessageType::request || other.type == MessageType::tp_request;
    EXPECT_EQ(error_answer(other, ReturnCode::unknown_method).has_value(), is_request) << type;
  }
}

TEST(ErrorAnswer, IsOfTypeErrorOnlyWhereThatIsConfigured) {
  covers({"feat_req_someip_726", "feat_req_someip_106", "feat_req_someip_101"});
  EXPECT_EQ(error_answer(request, ReturnCode::not_ok)->type, MessageType::response);
  EXPECT_EQ(error_answer(request, ReturnCode::not_ok, {.error_type = MessageType::error})->type,
            MessageType::error);
}

TEST(ErrorAnswer, IsNotGivenToAnError) {
  covers({"feat_req_someip_704"});
  Header error = request;
  error.return_code = ReturnCode::not_ok;
  EXPECT_FALSE(error_answer(error, ReturnCode::unknown_method));
}

TEST(AnswerHeader, TurnsTheRequestAround) {
  covers({"feat_req_someip_338", "feat_req_someip_367", "feat_req_someip_79"});
  Header expected = request;
  expected.type = MessageType::response;
  EXPECT_EQ(answer_header(request, ReturnCode::ok), expected);
  EXPECT_EQ(answer_header(request, ReturnCode::ok, {.error_type = MessageType::error}), expected)
      << "success is never an ERROR";
  expected.return_code = ReturnCode{0x20};
  EXPECT_EQ(answer_header(request, ReturnCode{0x20}), expected);
}

/// A message, what is known about its target, and what is to come of it.
struct Case {
  const char* what;
  std::uint8_t protocol;
  std::uint8_t type;
  RequestTarget target;
  std::optional<ReturnCode> fault;
  bool answered;
};

using enum MethodKind;
constexpr RequestTarget method{.service = true, .interface_version = true, .method = request_response};
constexpr RequestTarget signal{.service = true, .interface_version = true, .method = fire_and_forget};
constexpr RequestTarget both{.service = true, .interface_version = true, .method = either};
constexpr RequestTarget no_method{.service = true, .interface_version = true};
constexpr RequestTarget no_version{.service = true};
constexpr RequestTarget no_service{};

TEST(CheckRequest, FollowsTheFlowChart) {
  covers({"feat_req_someip_718", "feat_req_someip_721", "feat_req_someip_597", "feat_req_someip_654",
          "feat_req_someip_348", "feat_req_someip_95"});
  const std::array cases{
      Case{"request of a method", 1, 0x00, method, {}, false},
      Case{"fire and forget", 1, 0x01, signal, {}, false},
      Case{"either, called", 1, 0x00, both, {}, false},
      Case{"either, told", 1, 0x01, both, {}, false},
      // Each fault alone, and that an earlier one hides a later one.
      Case{"protocol version", 2, 0x00, method, ReturnCode::wrong_protocol_version, true},
      Case{"protocol version 0", 0, 0x00, method, ReturnCode::wrong_protocol_version, true},
      Case{"protocol version before type", 2, 0x00, signal, ReturnCode::wrong_protocol_version, true},
      Case{"protocol version before service", 2, 0x00, no_service, ReturnCode::wrong_protocol_version, true},
      Case{"request of what is fire and forget", 1, 0x00, signal, ReturnCode::wrong_message_type, true},
      Case{"fire and forget of a method", 1, 0x01, method, ReturnCode::wrong_message_type, false},
      Case{"unknown type", 1, 0x55, method, ReturnCode::wrong_message_type, false},
      Case{"unknown type before service", 1, 0x55, no_service, ReturnCode::wrong_message_type, false},
      Case{"acknowledgement, which is reserved", 1, 0x40, method, ReturnCode::wrong_message_type, false},
      Case{"notification", 1, 0x02, both, ReturnCode::wrong_message_type, false},
      Case{"response", 1, 0x80, both, ReturnCode::wrong_message_type, false},
      Case{"error", 1, 0x81, both, ReturnCode::wrong_message_type, false},
      Case{"service", 1, 0x00, no_service, ReturnCode::unknown_service, true},
      Case{"service, told", 1, 0x01, no_service, ReturnCode::unknown_service, false},
      Case{"interface version", 1, 0x00, no_version, ReturnCode::wrong_interface_version, true},
      Case{"interface version, told", 1, 0x01, no_version, ReturnCode::wrong_interface_version, false},
      Case{"method", 1, 0x00, no_method, ReturnCode::unknown_method, true},
      Case{"method, told", 1, 0x01, no_method, ReturnCode::unknown_method, false},
  };
  for (const Case& one : cases) {
    Header received = request;
    received.protocol = one.protocol;
    received.type = MessageType{one.type};
    const RequestCheck check = check_request(received, one.target);
    EXPECT_EQ(check.fault, one.fault) << one.what;
    EXPECT_EQ(check.answer.has_value(), one.answered) << one.what;
    if (check.answer) {
      Header expected = request;
      expected.type = MessageType::response;
      expected.return_code = *one.fault;
      EXPECT_EQ(check.answer, expected) << one.what;
    }
  }
}

TEST(CheckRequest, LeavesOutTheAnswersThatAreSwitchedOff) {
  covers({"feat_req_someip_816", "feat_req_someip_818", "feat_req_someip_598"});
  Header strange = request;
  strange.protocol = 2;
  const auto answered = [](const Header& received, const RequestTarget& target, const AnswerRules& rules) {
    EXPECT_TRUE(check_request(received, target, rules).fault);
    return check_request(received, target, rules).answer.has_value();
  };
  EXPECT_FALSE(answered(request, no_service, {.answer_unknown_service = false}));
  EXPECT_TRUE(answered(request, no_method, {.answer_unknown_service = false}));
  EXPECT_FALSE(answered(request, no_method, {.answer_unknown_method = false}));
  EXPECT_TRUE(answered(request, no_version, {.answer_unknown_method = false}));
  EXPECT_FALSE(answered(request, no_version, {.answer_wrong_interface_version = false}));
  EXPECT_TRUE(answered(request, no_service, {.answer_wrong_interface_version = false}));
  EXPECT_FALSE(answered(strange, method, {.answer_wrong_protocol_version = false}));
  EXPECT_TRUE(answered(request, signal, {.answer_wrong_protocol_version = false}));
}

TEST(CheckRequest, NeverAnswersAnErrorWithAnError) {
  covers({"feat_req_someip_704", "feat_req_someip_683"});
  Header error = request;
  error.return_code = ReturnCode{0xc0};
  EXPECT_EQ(check_request(error, no_service).fault, ReturnCode::unknown_service);
  EXPECT_FALSE(check_request(error, no_service).answer);
  EXPECT_FALSE(check_request(error, method).fault) << "processed, as vsomeip and TC8 have it";
  const RequestCheck strict = check_request(error, method, {.process_request_with_return_code = false});
  EXPECT_TRUE(strict.fault);
  EXPECT_FALSE(strict.answer);
}

}  // namespace
}  // namespace trestle::someip::request_check_test
