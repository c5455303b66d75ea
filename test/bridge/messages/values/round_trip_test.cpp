// All built-in types and every kind of field, under all wire rules, with values and bytes from the
// independent implementation in test/bridge/oracle/oracle.py.
#include <fstream>
#include <map>
#include <sstream>

#include "test/bridge/messages/convert/profiles.hpp"
#include "test/bridge/messages/values/support.hpp"
#include "test/source_dir.hpp"

namespace trestle::messages::round_trip_test {
namespace {

using namespace trestle::test;

struct Message {
  std::string type;
  std::string profile;
  std::vector<std::byte> little;
  std::vector<std::byte> big;
  std::vector<std::byte> payload;
  std::string json;
};

const std::vector<Message>& messages() {
  static const std::vector<Message> all = [] {
    std::vector<Message> result;
    std::ifstream in{TRESTLE_MESSAGES};
    for (std::string line; std::getline(in, line);) {
      std::istringstream words{line};
      Message message;
      std::string little;
      std::string big;
      std::string payload;
      words >> message.type >> message.profile >> little >> big >> payload >> std::ws;
      std::getline(words, message.json);
      message.little = hex(little);
      message.big = hex(big);
      message.payload = hex(payload);
      result.push_back(std::move(message));
    }
    return result;
  }();
  return all;
}

/// The byte that stands for an empty message is random in the oracle's messages, and not in the text.
bool has_empty_message(const TypeTree& tree) {
  return std::ranges::any_of(tree.messages, [](const auto& message) { return message.fields.empty(); });
}

template <typename Check>
void for_each_message(const Check& check) {
  TypeLibrary library{{test::source_dir() + "/test/bridge/oracle/msgs"}};
  std::map<std::pair<std::string, std::string>, MessageValues> known;
  const auto builtin = TypeLibrary::builtin_names();
  const auto is_message = [](const std::string& name) { return name.find("/msg/") != std::string::npos; };
  ASSERT_GE(std::ssize(messages()), 10 * std::ranges::count_if(builtin, is_message));
  for (const Message& message : messages()) {
    SCOPED_TRACE(message.type + " " + message.profile + " " + to_hex(message.payload) + " " + message.json);
    auto values = known.find({message.type, message.profile});
    if (values == known.end()) {
      values = known
                   .emplace(std::pair{message.type, message.profile},
                            values_with(*library.resolve(message.type),
                                        message_rules(message.profile, *library.resolve(message.type))))
                   .first;
    }
    check(message, values->second);
    if (testing::Test::HasFailure()) {
      return;  // one is enough to read
    }
  }
}

TEST(RoundTrip, ValuesBecomeTheBytesOfTheOracle) {
  for_each_message([](const Message& message, const MessageValues& values) {
    const auto payload = values.parse(message.json, ValueForm::json);
    ASSERT_TRUE(payload) << to_string(payload.error());
    const auto sample = values.parse_sample(message.json, ValueForm::json);
    ASSERT_TRUE(sample);
    if (!has_empty_message(values.tree())) {
      EXPECT_EQ(to_hex(*payload), to_hex(message.payload));
      EXPECT_EQ(to_hex(*sample), to_hex(message.little));
    }
    // JSON is YAML, but for surrogate pairs, which escape what is beyond 16 bits.
    if (message.json.find("\\ud8") == std::string::npos) {
      EXPECT_EQ(from_yaml(values, message.json), to_hex(*payload));
    }
  });
}

TEST(RoundTrip, PrintedTextBecomesTheSameBytes) {
  for_each_message([](const Message& message, const MessageValues& values) {
    for (const ValueForm form : {ValueForm::yaml, ValueForm::json}) {
      for (const BytesForm bytes : {BytesForm::list, BytesForm::base64, BytesForm::hex}) {
        const auto text = values.print(message.payload, form, {.bytes = bytes});
        ASSERT_TRUE(text) << text.error();
        EXPECT_EQ(values.print_sample(message.little, form, {.bytes = bytes}), text);
        EXPECT_EQ(values.print_sample(message.big, form, {.bytes = bytes}), text);
        const auto payload = values.parse(*text, form);
        ASSERT_TRUE(payload) << *text << to_string(payload.error());
        if (!has_empty_message(values.tree())) {
          EXPECT_EQ(to_hex(*payload), to_hex(message.payload)) << *text;
        }
        EXPECT_EQ(*values.print(*payload, form, {.bytes = bytes}), *text);
      }
    }
  });
}

TEST(RoundTrip, CutTextIsNeverLonger) {
  for_each_message([](const Message& message, const MessageValues& values) {
    const auto whole = values.print(message.payload, ValueForm::json);
    const auto cut = values.print(message.payload, ValueForm::json, {.longest = 64});
    EXPECT_EQ(*cut, *whole);  // nothing is that long here
    EXPECT_TRUE(values.print(message.payload, ValueForm::yaml, {.longest = 1}));
  });
}

}  // namespace
}  // namespace trestle::messages::round_trip_test
