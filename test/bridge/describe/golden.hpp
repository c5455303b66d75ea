#pragma once
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "test/bridge/describe/lowered.hpp"
#include "test/bytes.hpp"
#include "test/source_dir.hpp"

/// The bytes of CommonAPI's runtime: each line of test/fixtures/commonapi_golden.jsonl is a type with its
/// deployment, a value and its bytes.
namespace trestle::describe::golden {

using json = nlohmann::json;

inline std::vector<json> lines() {
  std::vector<json> result;
  std::ifstream in{test::source_dir() + "/test/fixtures/commonapi_golden.jsonl"};
  for (std::string line; std::getline(in, line);) {
    result.push_back(json::parse(line));
  }
  return result;
}

/// The number behind `words` in a deployment; nothing: they are not there.
inline std::optional<std::uint32_t> number_behind(const std::string& deployment, const std::string& words) {
  const std::size_t at = deployment.find(words);
  return at == std::string::npos ? std::nullopt
                                 : std::optional{static_cast<std::uint32_t>(
                                       std::strtoul(deployment.c_str() + at + words.size(), nullptr, 10))};
}

/// The value of a line as JSON of the message: of a type of ROS as it is, of any other as its member `value`.
inline json message_of(const json& line) {
  const std::string type = line["type"];
  const std::string name = line["name"];
  json given = line.value("value", json{});
  if (given == "bytes 0..31") {
    given = json::array();
  }
  if (given.is_object() && given.contains("data")) {
    given["data"] = json::array();
    for (int i = 0; i < 32; ++i) {
      given["data"].push_back(i);
    }
  }
  json message;
  if (type.starts_with("struct{")) {
    message = given.is_array() ? json{{"a", given[0]}, {"b", given[1]}} : json{};
  } else if (type.starts_with("union")) {
    const bool is_first = name.ends_with("> uint8");
    message["value"][is_first ? "a" : "b"] = json::array({given});
  } else if (given.is_object()) {
    message = given;
  } else {
    message["value"] = given;
  }
  return message;
}

/// Where we do otherwise, and why.
inline bool is_exception(const json& line) {
  const std::string name = line["name"];
  return (name == "bool true" && line["endianness"] == "le") ||  // a fault of that runtime: it writes 00
         name == "read:variant type 4" ||             // 4 of 3 types: refused [feat_req_someip_273]
         name == "read:struct length 3 (too small)";  // a length that its content exceeds: refused
}

/// Expects that the only event of a model has the bytes of a line, both ways.
inline void compare(const json& line, const Model& model) {
  const std::string name = line["name"];
  const Lowered lowered = lower(model);
  ASSERT_EQ(lowered.members.size(), 1U) << (lowered.not_carried.empty() ? "" : lowered.not_carried[0].what);
  const messages::MessageValues values = lowered::values_of(lowered, lowered.members[0]);
  const std::string expected = line["hex"];
  const auto bytes = test::hex(expected);
  if (name.starts_with("read:")) {
    EXPECT_EQ(values.print(bytes, messages::ValueForm::json).has_value(), line["accepted"].get<bool>());
    return;
  }
  const auto payload = values.parse(message_of(line).dump(), messages::ValueForm::json);
  if (expected.empty() && line["value"] != json::array()) {
    EXPECT_FALSE(payload) << "accepted what does not fit";
    return;
  }
  ASSERT_TRUE(payload) << to_string(payload.error());
  EXPECT_EQ(test::to_hex(*payload), expected);
  const auto printed = values.print(bytes, messages::ValueForm::json);
  ASSERT_TRUE(printed) << printed.error();
  const auto again = values.parse(*printed, messages::ValueForm::json);
  ASSERT_TRUE(again) << *printed;
  EXPECT_EQ(test::to_hex(*again), expected) << *printed;
}

}  // namespace trestle::describe::golden
