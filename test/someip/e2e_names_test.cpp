// The words that users read in logs and reports.
#include <gtest/gtest.h>

#include "someip/core/e2e/checker.hpp"
#include "someip/core/e2e/protector.hpp"

namespace trestle::someip::e2e::e2e_names_test {
namespace {

TEST(E2eNames, AreThoseOfTheEnumerators) {
  EXPECT_STREQ(to_string(ProtectError::too_short), "too_short");
  EXPECT_STREQ(to_string(ProtectError::too_long), "too_long");
  EXPECT_STREQ(to_string(ProtectError::header_in_front), "header_in_front");
  EXPECT_STREQ(to_string(ProtectError::source_id), "source_id");
  EXPECT_STREQ(to_string(Fault::none), "none");
  EXPECT_STREQ(to_string(Fault::data_length), "data_length");
  EXPECT_STREQ(to_string(Fault::header_in_front), "header_in_front");
  EXPECT_STREQ(to_string(Fault::crc), "crc");
  EXPECT_STREQ(to_string(Fault::counter), "counter");
  EXPECT_STREQ(to_string(Fault::length_field), "length_field");
  EXPECT_STREQ(to_string(Fault::data_id), "data_id");
  EXPECT_STREQ(to_string(Fault::message_type), "message_type");
  EXPECT_STREQ(to_string(Fault::message_result), "message_result");
  EXPECT_STREQ(to_string(Fault::source_id), "source_id");
  EXPECT_STREQ(to_string(CheckStatus::ok), "ok");
  EXPECT_STREQ(to_string(CheckStatus::ok_some_lost), "ok_some_lost");
  EXPECT_STREQ(to_string(CheckStatus::repeated), "repeated");
  EXPECT_STREQ(to_string(CheckStatus::wrong_sequence), "wrong_sequence");
  EXPECT_STREQ(to_string(CheckStatus::error), "error");
  EXPECT_STREQ(to_string(CheckStatus::no_new_data), "no_new_data");
  EXPECT_STREQ(to_string(State::no_data), "no_data");
  EXPECT_STREQ(to_string(State::init), "init");
  EXPECT_STREQ(to_string(State::valid), "valid");
  EXPECT_STREQ(to_string(State::invalid), "invalid");
}

TEST(E2eCodes, TellTheClientWhatTheCheckOfItsRequestSays) {
  EXPECT_EQ(code_of(CheckStatus::ok), ReturnCode::ok);
  EXPECT_EQ(code_of(CheckStatus::ok_some_lost), ReturnCode::ok);
  EXPECT_EQ(code_of(CheckStatus::repeated), ReturnCode::e2e_repeated);
  EXPECT_EQ(code_of(CheckStatus::wrong_sequence), ReturnCode::e2e_wrong_sequence);
  EXPECT_EQ(code_of(CheckStatus::no_new_data), ReturnCode::e2e_no_new_data);
  EXPECT_EQ(code_of(CheckStatus::error), ReturnCode::e2e);
}

}  // namespace
}  // namespace trestle::someip::e2e::e2e_names_test
