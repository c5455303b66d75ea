#include "someip/core/error_answer.hpp"

#include <gtest/gtest.h>

#include "test/covers.hpp"

namespace trestle::someip {
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
  covers({"feat_req_someip_597", "feat_req_someip_654", "feat_req_someip_718"});
  for (int type = 0; type < 256; ++type) {
    Header other = request;
    other.type = MessageType{static_cast<std::uint8_t>(type)};
    const bool is_request = other.type == MessageType::request || other.type == MessageType::tp_request;
    EXPECT_EQ(error_answer(other, ReturnCode::unknown_method).has_value(), is_request) << type;
  }
}

TEST(ErrorAnswer, IsNotGivenToAnError) {
  covers({"feat_req_someip_704"});
  Header error = request;
  error.return_code = ReturnCode::not_ok;
  EXPECT_FALSE(error_answer(error, ReturnCode::unknown_method));
}

}  // namespace
}  // namespace trestle::someip
